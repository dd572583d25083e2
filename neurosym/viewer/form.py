"""The form for planning again: what it asks, what it says, and how it reads what was typed."""

import json
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import viser

from neurosym.errors import InputError
from neurosym.language.options import options_of, read_options
from neurosym.pipeline import ORACLES
from neurosym.registry import domain_names, planner_names, prior_names
from neurosym.viewer import panels
from neurosym.viewer.exhibit import REFUSED, Maker, Query
from neurosym.viewer.planning import Planning, maker_of

NO_PRIOR = "none"

T = TypeVar("T", int, float)


class Form:
    """Controls, which say a query at first, two buttons and a place for messages; made in the container that is open.

    `given` makes problems that bear no number in a family, by their names.
    """

    def __init__(self, gui: viser.GuiApi, query: Query, given: Mapping[str, Maker]) -> None:
        self.given = given
        prior = query.prior or NO_PRIOR
        self.domain = gui.add_dropdown("Domain", _offered(*given, *domain_names()), initial_value=query.domain)
        number = "" if query.number is None else str(query.number)
        self.number = gui.add_text("Problem", number, hint="its number")
        options = "; ".join(f"{k}={v if isinstance(v, str) else json.dumps(v)}" for k, v in query.options.items())
        self.options = gui.add_text("Options", options, hint='of the domain, as key=value; removed=["V"]')
        planners = _offered(*planner_names(), query.planner)
        self.takes = gui.add_html("")
        self.planner = gui.add_dropdown("Planner", planners, initial_value=query.planner)
        self.prior = gui.add_dropdown("Prior", _offered(NO_PRIOR, *prior_names(), prior), initial_value=prior)
        self.oracle = gui.add_dropdown("Oracle", ORACLES, initial_value=query.oracle)
        self.seed = gui.add_text("Seed", str(query.seed))
        seconds = "" if query.seconds is None else f"{query.seconds:g}"
        self.seconds = gui.add_text("Seconds", seconds, hint="budget; empty sets no limit")
        self.again = gui.add_button("Plan again", icon=viser.Icon.REFRESH)
        self.stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, color="red", disabled=True)
        self.bar = gui.add_progress_bar(0.0, animated=True, visible=False)
        self.message = gui.add_html("")
        self._asked_of, self._typed = query.domain, dict[str, tuple[str, str]]()
        self._tell_options()
        self.domain.on_update(lambda _: self._other_domain())

    def _other_domain(self) -> None:
        """Another domain was chosen: its number and options are those that were typed for it before, or none."""
        domain = self.domain.value
        if domain == self._asked_of:
            return
        self._typed[self._asked_of] = self.number.value, self.options.value
        self._asked_of = domain
        number, options = self._typed.get(domain, ("" if domain in self.given else "0", ""))
        assign(self.number, number)
        assign(self.options, options)
        self._tell_options()

    def _tell_options(self) -> None:
        """Say under the field which options the domain takes."""
        domain = self.domain.value
        self.number.disabled = domain in self.given
        try:
            content = panels.options(domain, options_of(maker_of(domain, self.given)))
        except REFUSED as error:
            content = panels.message(str(error))
        self.takes.content = panels.styled(content)

    def asked(self) -> Query:
        """What the form says. Raises InputError: a field that is not what it should be."""
        seconds = self.seconds.value
        return Query(
            domain=self.domain.value,
            number=None if self.domain.value in self.given else _number("Problem", self.number.value, int),
            options=_read_options(self.options.value),
            planner=self.planner.value,
            prior=None if self.prior.value == NO_PRIOR else self.prior.value,
            oracle=self.oracle.value,
            seed=_number("Seed", self.seed.value, int),
            seconds=_number("Seconds", seconds, float, "a number, or empty for no limit") if seconds.strip() else None,
        )

    def say(self, content: str) -> None:
        """Show HTML under the buttons."""
        self.message.content = panels.styled(content) if content else ""

    def refuse(self, text: str) -> None:
        """Show a message to be read."""
        self.say(panels.message(text) if text else "")

    def busy(self, planning: Planning | None) -> None:
        """Show how far a search is, or that there is none."""
        running = planning is not None
        self.again.disabled, self.stop.disabled, self.bar.visible = running, not running, running
        if planning is not None:
            progress = planning.progress
            assign(self.bar, 100.0 * progress.depth / max(progress.steps, 1))
            self.say(panels.progress(progress, stopping=planning.stopped))


def assign(handle: Any, value: object) -> None:
    """Set a control. (viser's setter stands apart from its getter, and type checkers take it for read-only.)"""
    handle.value = value


def _offered(*names: str) -> tuple[str, ...]:
    """Names to choose from, each once; what a plan's file names is among them even where it is not installed."""
    return tuple(dict.fromkeys(names))


def _number(label: str, text: str, kind: Callable[[str], T], expected: str = "a whole number") -> T:
    try:
        return kind(text)
    except ValueError:
        raise InputError(f"Expected {label} to be {expected}; got {text!r}.") from None


def _read_options(text: str) -> dict[str, Any]:
    """``key=value; key=value``, with spaces where anybody likes them."""
    pieces = ("=".join(half.strip() for half in piece.split("=", 1)) for piece in text.split(";"))
    return read_options(filter(None, pieces), "Options as key=value; key=value")
