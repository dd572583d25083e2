"""The page: the 3D view, and beside it the plan, the prior, the search, facts about a part, and planning again."""

import contextlib
import logging
import threading
import time
from collections.abc import Mapping

import viser

from neurosym.errors import InputError
from neurosym.language.problem import Problem
from neurosym.planning.staging import stage
from neurosym.viewer import panels
from neurosym.viewer.exhibit import REFUSED, Exhibit, Maker, Query, Search
from neurosym.viewer.facts import part_facts
from neurosym.viewer.form import Form, assign
from neurosym.viewer.planning import Planning, check_query, problem_maker
from neurosym.viewer.scene import PlanScene, named_at_first
from neurosym.viewer.score_table import scores_table
from neurosym.viewer.server import LocalServer
from neurosym.viewer.steps import BECAUSE, MOST_REFUSALS, TRIED, attempts, caption, looked_at, most_refused, steps
from neurosym.viewer.timeline import Timeline

_log = logging.getLogger(__name__)
#: Scene updates a second while the film plays, and seconds that a step takes at speed 1.
RATE, SECONDS_PER_STEP = 30.0, 1.5

SPEEDS = ("0.5×", "1×", "2×", "4×", "8×")
NO_PART = "(no part)"
#: Width of the panel beside the view (CSS pixels).
PANEL = 420


class Page:
    """The page of one server; all who look at it see, and steer, the same.

    The form for planning again says the query at first; `given` makes, of options, the problems that bear no number in
    a family, by their names.
    """

    def __init__(self, server: LocalServer, query: Query, given: Mapping[str, Maker] | None = None) -> None:
        self.server = server
        self.query = query
        self.given = dict(given or {})
        self.exhibit: Exhibit | None = None
        self.planning: Planning | None = None
        self.playing = False
        self._lock = threading.RLock()
        self._step_shown: tuple[int | None, int] | None = None
        self._facts_for: tuple[str, tuple[str, ...]] | None = None
        self._closed = threading.Event()
        self.scene = PlanScene(server, self._clicked)
        self._build()
        self._clock = threading.Thread(target=self._run, name="neurosym view", daemon=True)
        self._clock.start()

    def show(self, exhibit: Exhibit) -> None:
        """Put a problem with its search on the page, at the beginning of its film."""
        with self._lock:
            self.exhibit, self.playing = exhibit, False
            timeline, search = exhibit.timeline, exhibit.search
            n_steps, names = (timeline.n_steps, timeline.names) if timeline else (0, ())
            self.scene.put(timeline, exhibit.buildable)
            self.slider.max = max(n_steps, 1)
            self.slider.disabled = self.play.disabled = n_steps == 0
            assign(self.slider, 0.0)
            self.part.options = (NO_PART, *names)
            assign(self.part, NO_PART)
            assign(self.names, named_at_first(timeline))
            table = scores_table(search.scores, exhibit.problem.actions, search.steps)
            reference = f"<p><b>Reference</b></p>{panels.pictures(exhibit.pictures)}"
            self.prior_tab.content = panels.styled(table + reference)
            self._list_attempts(search, 0)
            self.refusal.max, self.refusal.disabled = max(len(search.refusals), 1), not search.refusals
            assign(self.refusal, 0)
            self.refusal_text.content = ""
            self._step_shown = self._facts_for = None
            self._moved(0.0)

    def plan(self, query: Query, problem: Problem | None = None) -> None:
        """Plan in the background, the problem itself where it is made already; what comes out of it is shown.

        Raises InputError: there is no such domain, planner or prior, or a search is under way.
        """
        with self._lock:
            if self.planning is not None and self.planning.running:
                raise InputError("Expected one search at a time; stop the one that is under way first.")
            check_query(query)
            self.query = query
            make = problem_maker(query, self.given) if problem is None else lambda: problem
            self.planning = Planning(make, query)
            self.form.refuse("")
            if self.exhibit is None and problem is not None:
                # What is there before any step, while the first search goes on.
                with contextlib.suppress(*REFUSED):
                    self.scene.put(Timeline(stage(problem, ()), problem.geometry))

    def close(self) -> None:
        """End the page's thread and any search; the server is left to who made it."""
        self._closed.set()
        self._stop()
        self._clock.join(5.0)

    def _build(self) -> None:
        gui = self.server.gui
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(0, 114, 178))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(PANEL)
        self.caption = gui.add_html("")
        self.slider = gui.add_slider("Step", min=0.0, max=1.0, step=0.01, initial_value=0.0, disabled=True)
        self.play = gui.add_button("Play", icon=viser.Icon.PLAYER_PLAY, disabled=True)
        self.speed = gui.add_dropdown("Speed", SPEEDS, initial_value="1×")
        self.names = gui.add_checkbox("Names of parts", False)
        self.forces = gui.add_checkbox("Contact forces", False, hint="between steps; red: about to slip")
        self.forces_text = gui.add_html("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Plan"):
            self.plan_tab = gui.add_html("")
        with tabs.add_tab("Prior"):
            self.prior_tab = gui.add_html("")
        with tabs.add_tab("Search"):
            self.refusal = gui.add_slider("Look at", min=0, max=1, step=1, initial_value=0, hint="a refusal, by number")
            self.refusal_text = gui.add_html("")
            self.search_tab = gui.add_html("")
        with tabs.add_tab("Part"):
            self.part = gui.add_dropdown("Part", (NO_PART,))
            self.part_tab = gui.add_html("")
        with tabs.add_tab("Plan again"):
            self.form = Form(gui, self.query, self.given)
        self.slider.on_update(lambda _: self._moved(self.slider.value))
        self.play.on_click(lambda _: self._toggle())
        self.names.on_update(lambda _: self.scene.name_parts(self.names.value))
        self.forces.on_update(lambda _: self._show_forces())
        self.part.on_update(lambda _: self._picked(self.part.value))
        self.refusal.on_update(lambda _: self._look_at(self.refusal.value))
        self.form.again.on_click(lambda _: self._again())
        self.form.stop.on_click(lambda _: self._stop())

    def _list_attempts(self, search: Search, around: int) -> None:
        """List attempts: where there are too many, those about a refusal by its number."""
        self.search_tab.content = panels.styled(most_refused(search) + attempts(search, around))

    def _moved(self, t: float) -> None:
        """Show time t, and what the panel says of it."""
        with self._lock:
            exhibit = self.exhibit
            if exhibit is None:
                return
            self.scene.show(t)
            now = exhibit.timeline.step_at(t) if exhibit.timeline else None
            if (now, int(t)) != self._step_shown:
                self._step_shown = now, int(t)
                self.plan_tab.content = panels.styled(panels.overview(exhibit) + steps(exhibit, now))
                self.caption.content = panels.styled(caption(exhibit, t))
                self._tell_facts()
                self._show_forces()

    def _toggle(self) -> None:
        with self._lock:
            timeline = self.exhibit.timeline if self.exhibit else None
            if timeline is None:
                return
            if not self.playing and self.slider.value >= timeline.n_steps:
                assign(self.slider, 0.0)
            self._play(not self.playing)

    def _play(self, playing: bool) -> None:
        self.playing = playing
        self.play.label = "Pause" if playing else "Play"
        self.play.icon = viser.Icon.PLAYER_PAUSE if playing else viser.Icon.PLAYER_PLAY

    def _picked(self, name: str) -> None:
        """A part was chosen."""
        with self._lock:
            # A click may come late, for a part of what was shown before.
            if self.exhibit is None or name not in self.part.options:
                return
            if self.part.value != name:
                assign(self.part, name)  # which calls this again
                return
            if name != NO_PART:
                assign(self.refusal, 0)
            self.scene.stand_out(None if name == NO_PART else {name: None})
            self._facts_for = None
            self._tell_facts()

    def _clicked(self, name: str) -> None:
        """A part was clicked; a click on the one that is chosen lets go of it."""
        self._picked(NO_PART if self.part.value == name else name)

    def _look_at(self, number: int) -> None:
        """Show refusal `number`, from 1: what was tried and what stood in the way; 0 ends it."""
        with self._lock:
            exhibit = self.exhibit
            if exhibit is None or not 0 <= number <= len(exhibit.search.refusals):
                return
            if number == 0:
                self.refusal_text.content = ""
                if self.part.value == NO_PART:
                    self.scene.stand_out(None)
                return
            assign(self.part, NO_PART)
            refusal = exhibit.search.refusals[number - 1]
            self.refusal_text.content = panels.styled(looked_at(number, refusal))
            if len(exhibit.search.refusals) > MOST_REFUSALS:
                self._list_attempts(exhibit.search, number)
            timeline = exhibit.timeline
            if timeline is None:
                return
            if refusal.side == "full" and exhibit.search.steps[: len(refusal.after)] == refusal.after:
                self._play(False)
                assign(self.slider, float(len(refusal.after)))
            colours: dict[str, tuple[int, int, int] | None] = dict.fromkeys(refusal.because, BECAUSE)
            moved = {a: m.parts for a, m in zip(timeline.staging.plan, timeline.staging.motions)}
            self.scene.stand_out(colours | dict.fromkeys(moved.get(refusal.action, (refusal.action,)), TRIED))

    def _tell_facts(self) -> None:
        timeline = self.exhibit.timeline if self.exhibit else None
        name = self.part.value
        if timeline is None or name not in timeline.names:
            self.part_tab.content = panels.styled("<p>Click a part, or choose one.</p>")
            self._facts_for = None
            return
        there = timeline.state_at(self.slider.value)
        if (name, there) == self._facts_for:
            return
        self._facts_for = (name, there)
        # The first question about a large assembly takes seconds.
        self.part_tab.content = panels.styled("<p class='quiet'>Asking geometry …</p>")
        try:
            self.part_tab.content = panels.styled(panels.facts(part_facts(timeline.geometry, name, there)))
        except REFUSED as error:
            self.part_tab.content = panels.styled(panels.message(str(error)))

    def _show_forces(self) -> None:
        """Between steps, and where they are asked for, contact forces of the parts in place, or how these fall."""
        with self._lock:
            timeline = self.exhibit.timeline if self.exhibit else None
            self.scene.show_forces(None)
            self.forces_text.content = ""
            if timeline is None or not self.forces.value or timeline.step_at(self.slider.value) is not None:
                return
            geometry = timeline.geometry
            there = geometry.mask(timeline.state_at(self.slider.value))
            try:
                self.scene.show_forces(geometry.springs.forces(there))
                moves = [m.sentence(geometry.names) for m in geometry.springs.movements(there)]
                self.forces_text.content = panels.styled(panels.falls(moves)) if moves else ""
            except REFUSED as error:
                self.forces_text.content = panels.styled(panels.message(str(error)))

    def _again(self) -> None:
        try:
            self.plan(self.form.asked())
        except REFUSED as error:
            self.form.refuse(str(error))

    def _stop(self) -> None:
        planning = self.planning  # asked once: it may end meanwhile
        if planning is not None:
            planning.stop()

    def _watch(self) -> None:
        """What a search that is under way, or has just ended, shows."""
        with self._lock:
            planning = self.planning
            if planning is None:
                return
            if planning.running:
                self.form.busy(planning)
                if self.exhibit is None:
                    self.caption.content = panels.styled(panels.progress(planning.progress, stopping=planning.stopped))
                return
            self.planning = None
            self.form.busy(None)
            if planning.exhibit is None:
                message = planning.message or ""
                self.form.refuse(message)
                if self.exhibit is None:
                    self.caption.content = panels.styled(panels.message(message))
                return
            try:
                self.show(planning.exhibit)
            except Exception as error:
                # A plug-in's fault, such as pictures that are none: the page says so and goes on.
                _log.exception("What was planned cannot be shown.")
                self.form.refuse(f"What was planned cannot be shown: {type(error).__name__}: {error}")
                return
            self.form.say(panels.overview(planning.exhibit))

    def _run(self) -> None:
        last, watched = time.perf_counter(), 0.0
        while not self._closed.wait(1.0 / RATE):
            now = time.perf_counter()
            passed, last = now - last, now
            with self._lock:
                timeline = self.exhibit.timeline if self.exhibit else None
                if self.playing and timeline is not None:
                    pace = float(self.speed.value.removesuffix("×")) / SECONDS_PER_STEP
                    t = min(self.slider.value + passed * pace, float(timeline.n_steps))
                    assign(self.slider, t)
                    if t >= timeline.n_steps:
                        self._play(False)
            if now - watched > 0.1:
                watched = now
                self._watch()
