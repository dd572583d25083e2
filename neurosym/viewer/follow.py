"""What lets the list of an exported page follow its film: a script that reads the player's clock, and sets it.

The player is viser's, and says nothing to the page about it; its clock is a field with the seconds. Where no such field
is found, the script does nothing: the list stays a list.
"""

import json
from collections.abc import Sequence

#: Times a second that the clock is read.
LOOKS = 10


def follower(captions: Sequence[str], pause: float, seconds_per_step: float) -> str:
    """An HTML script that marks the step under way in `#steps`, says it in `#now`, and goes to a step that is clicked.

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
