"""One file that plays a plan without a server and without the network."""

import json
from collections.abc import Sequence
from html import escape
from pathlib import Path

import numpy as np

from neurosym.errors import InputError
from neurosym.support.files import write_text
from neurosym.viewer import panels
from neurosym.viewer.exhibit import Exhibit
from neurosym.viewer.scene import PlanScene
from neurosym.viewer.score_table import scores_table
from neurosym.viewer.server import LocalServer
from neurosym.viewer.steps import attempts, caption, most_refused, steps

#: Scene updates a second of the recording, and seconds that a step takes.
RATE, SECONDS_PER_STEP = 15, 1.5
#: Seconds that the film rests at its beginning and its end, which it goes round and round.
PAUSE = 1.0
#: Width of the panel beside the view (CSS pixels).
PANEL = 400


def export_page(exhibit: Exhibit, path: str | Path) -> Path:
    """Write a self-contained page, whole or not at all; its folder is made. Returns the path.

    Raises InputError: a problem that has no parts in space, or a file name that does not end in .html.
    """
    path = Path(path)
    check_name(path)
    if exhibit.timeline is None:
        raise InputError(f"Expected a problem whose plan can be shown in space. {' '.join(exhibit.notes)}")
    write_text(path, _with_panel(_film(exhibit), exhibit))
    return path


def check_name(path: Path) -> None:
    """Refuse a file name that no browser would open as a page; to be asked before the work, not after it."""
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"Expected a file name that ends in .html; got {path.name!r}.")


def _film(exhibit: Exhibit) -> str:
    """viser's own player with the recording in it."""
    timeline = exhibit.timeline
    assert timeline is not None
    server = LocalServer()
    try:
        scene = PlanScene(server)
        scene.put(timeline, exhibit.buildable)
        recording = server.get_scene_serializer()
        recording.insert_sleep(PAUSE)
        frames = round(timeline.n_steps * SECONDS_PER_STEP * RATE)
        for t in np.linspace(0.0, timeline.n_steps, frames + 1)[1:]:
            scene.show(float(t))
            recording.insert_sleep(1.0 / RATE)
        recording.insert_sleep(PAUSE)
        return recording.as_html()
    finally:
        server.stop()


def _with_panel(film: str, exhibit: Exhibit) -> str:
    """The player with what the panel of the page says beside it."""
    search, total = exhibit.search, len(exhibit.search.steps)
    content = (
        f"<div id='now'>{caption(exhibit, 0.0)}</div>{panels.overview(exhibit)}"
        f"<div id='steps'>{steps(exhibit, None)}</div>"
        f"<p class='quiet hint'>A click on a step goes there and waits; the player's button plays on.</p>"
        f"<h3>Prior</h3>{scores_table(search.scores, exhibit.problem.actions, search.steps)}"
        f"<h3>Reference</h3>{panels.pictures(exhibit.pictures)}"
        f"<h3>Attempts, in order</h3>{most_refused(search)}{attempts(search)}"
    )
    style = (
        f"<style>body{{margin:0}}#root{{position:fixed!important;inset:0 {PANEL}px 0 0!important;width:auto!important}}"
        f"#said{{position:fixed;top:0;right:0;bottom:0;width:{PANEL}px;box-sizing:border-box;overflow:auto;"
        "padding:0 4px 10px;border-left:1px solid #ddd;background:#fff;color:#111;font-family:sans-serif}"
        "#said h3{font-size:14px;margin:14px 0 4px}#now{position:sticky;top:0;background:#fff;z-index:1;"
        "border-bottom:1px solid #ddd}#steps{max-height:45vh;overflow:auto}#steps.live li[data-step]{cursor:pointer}"
        "#steps.live li[data-step]:hover{background:#eef5fa}#steps.live li.now:hover{background:#ffe9c9}"
        ".hint{display:none}#steps.live+.hint{display:block}</style>"
    )
    times = (0.0, *(i + 0.5 for i in range(total)), float(total))
    script = follower([caption(exhibit, t) for t in times], PAUSE, SECONDS_PER_STEP) if total else ""
    title = f"<title>{escape(exhibit.problem.name)}</title>"
    aside = f"{style}<aside id='said'>{panels.styled(content)}</aside>{script}"
    before, body, after = film.replace("<title>Viser</title>", title, 1).rpartition("</body>")
    return f"{before}{aside}{body}{after}" if body else after + aside


#: Times a second that the clock is read.
LOOKS = 10


def follower(captions: Sequence[str], pause: float, seconds_per_step: float) -> str:
    """An HTML script that marks the step under way in `#steps`, says it in `#now`, and goes to a step that is clicked.

    The player is viser's, and its clock a field with the seconds; where there is no such field, nothing happens.
    Captions are HTML: before the first step, which is after a `pause` (seconds), one a step, and after the last.
    """
    texts = json.dumps(list(captions)).replace("<", "\\u003c")
    settings = f"{texts}, {pause:g}, {seconds_per_step:g}, {len(captions) - 2}, {1000 // LOOKS}"
    return f"<script>({_SCRIPT})({settings});</script>"


_SCRIPT = """(captions, pause, each, total, wait) => {
  const now = document.getElementById("now"), list = document.getElementById("steps");
  const rows = [...list.querySelectorAll("li[data-step]")];
  let marked = null;
  const clock = () => {
    const field = document.querySelector("#root input");
    return field && field.value.trim() !== "" && isFinite(field.value) ? field : null;
  };
  const follow = () => {
    const field = clock();
    list.classList.toggle("live", field !== null);
    if (field === null) return;
    // The clock shows tenths: half of one more, and a step begins no later than its number.
    const past = (Number(field.value) + 0.05 - pause) / each;
    const step = past < 0 ? -1 : Math.min(Math.floor(past), total);
    if (step === marked) return;
    marked = step;
    now.innerHTML = captions[step + 1];
    for (const row of rows) {
      const on = Number(row.dataset.step) === step;
      row.classList.toggle("now", on);
      if (!on) { row.removeAttribute("aria-current"); continue; }
      row.setAttribute("aria-current", "step");
      const over = row.getBoundingClientRect().top - list.getBoundingClientRect().top;
      if (over < 0 || over > list.clientHeight - row.offsetHeight) list.scrollTop += over - list.clientHeight / 3;
    }
  };
  list.addEventListener("click", (event) => {
    const row = event.target.closest("li[data-step]"), field = clock();
    if (!row || field === null) return;
    // The player listens as to someone who types.
    const type = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
    type.call(field, (pause + each * Number(row.dataset.step)).toFixed(1));
    field.dispatchEvent(new Event("input", { bubbles: true }));
    follow();
  });
  setInterval(follow, wait);
}"""
