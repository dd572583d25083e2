"""The form for planning again: what it asks, what it says, and how it reads what was typed."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import viser

from neurosym.errors import InputError
from neurosym.language.options import options_of
from neurosym.pipeline import ORACLES
from neurosym.registry import domain_names, planner_names, prior_names
from neurosym.viewer import panels
from neurosym.viewer.planning import Planning, maker_of
from neurosym.viewer.shown import REFUSED, Maker, Query

NO_PRIOR = "none"


class Form:
    """Controls for a query, two buttons and a place for messages; made in the container that is open.

    Args:
        gui: where they are made.
        query: what they say at first.
        given: names of problems that bear no number in a family, and what makes them.
    """

    def __init__(self, gui: viser.GuiApi, query: Query, given: Mapping[str, Maker]) -> None:
        self.given = given
        prior = query.prior or NO_PRIOR
        self.domain = gui.add_dropdown("Domain", _offered(*given, *domain_names()), initial_value=query.domain)
        number = "" if query.number is None else str(query.number)
        self.number = gui.add_text("Problem", number, hint="its number")
        self.options = gui.add_text(
            "Options", _written(query.options), hint='of the domain, as key=value; removed=["V"]'
        )
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
            known = options_of(maker_of(domain, self.given))
        except REFUSED as error:
            self.takes.content = panels.styled(panels.message(str(error)))
            return
        self.takes.content = panels.styled(panels.options(domain, known))

    def asked(self) -> Query:
        """What the form says.

        Raises:
            InputError: a field that is not what it should be.
        """
        return Query(
            domain=self.domain.value,
            number=None if self.domain.value in self.given else _whole("Problem", self.number.value),
            options=_read_options(self.options.value),
            planner=self.planner.value,
            prior=None if self.prior.value == NO_PRIOR else self.prior.value,
            oracle=self.oracle.value,
            seed=_whole("Seed", self.seed.value),
            seconds=_seconds(self.seconds.value),
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


def _whole(label: str, text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise InputError(f"Expected {label} to be a whole number; got {text!r}.") from None


def _seconds(text: str) -> float | None:
    if not text.strip():
        return None
    try:
        return float(text)
    except ValueError:
        raise InputError(f"Expected Seconds to be a number, or empty for no limit; got {text!r}.") from None


def _written(options: Mapping[str, Any]) -> str:
    return "; ".join(f"{k}={v if isinstance(v, str) else json.dumps(v)}" for k, v in options.items())


def _read_options(text: str) -> dict[str, Any]:
    """``key=value; key=value``: a value that is JSON is read as such, anything else is text."""
    found: dict[str, Any] = {}
    for piece in filter(None, (p.strip() for p in text.split(";"))):
        key, equals, value = (p.strip() for p in piece.partition("="))
        if not equals or not key.isidentifier():
            raise InputError(f"Expected Options as key=value; key=value; got {piece!r}.")
        try:
            found[key] = json.loads(value)
        except ValueError:
            found[key] = value
    return found
