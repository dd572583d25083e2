"""How often actions may be done, and which may stand for one another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Self

from neurosym.errors import DefinitionError, UnknownNameError
from neurosym.language.instances import Instance

if TYPE_CHECKING:
    from neurosym.language.problem import Problem


class Uses(NamedTuple):
    """Bitsets of ground actions.

    An action that takes away what it needs, which nothing brings back, is done once without being told.

    `again`: those that may be done any number of times. `remembered`: those that are done once though no state says
    whether they were.
    """

    again: int
    remembered: int

    @classmethod
    def of(cls, instances: Sequence[Instance]) -> Self:
        """Those of the ground actions that can be reached."""
        made = {e.atom for i in instances for e in i.effects() if e.positive}
        unmade = {e.atom for i in instances for e in i.effects() if not e.positive}
        again = remembered = 0
        for number, instance in enumerate(instances):
            gone = {e.atom for e in instance.eff if not e.positive} - made
            come = {e.atom for e in instance.eff if e.positive} - unmade
            spent = any(p.atom in (gone if p.positive else come) for p in instance.fluents)
            again |= (not spent and not instance.once) << number
            remembered |= (not spent and instance.once) << number
        return cls(again, remembered)


def classes_of(
    problem: Problem,
    groups: Sequence[Sequence[str]],
    actions: Sequence[str],
    all_names: Sequence[str],
    constrained: set[int],
    again: int,
) -> tuple[int, ...]:
    """One integer an action, the same for those of one of the `groups`, which are interchangeable.

    `constrained`: actions that its precedence singles out, which are no longer like the others. `again`: see `Uses`.
    Raises DefinitionError: names of no actions, in two groups, or of actions that may be done again.
    """
    place = f"In problem {problem.name!r}, interchangeable"
    index = {name: i for i, name in enumerate(actions)}
    classes = list(range(len(actions)))
    grouped: set[str] = set()
    for number, group in enumerate(groups):
        for name in group:
            if name not in all_names:
                raise DefinitionError(f"{place}[{number}]: {UnknownNameError('action', name, all_names)}")
        twice = grouped & set(group)
        if twice or len(set(group)) != len(group):
            raise DefinitionError(f"{place}: expected each action in one group; {sorted(twice) or group} is not.")
        grouped |= set(group)
        members = [index[name] for name in group if name in index and index[name] not in constrained]
        # One that was done and done again has left a trace in the state, which the others have not.
        if any(again >> member & 1 for member in members):
            raise DefinitionError(
                f"{place}[{number}]: expected actions that are done once, with once=True; got {', '.join(group)}."
            )
        for member in members:
            classes[member] = members[0]
    return tuple(classes)
