"""What a planner sees of a problem: actions, states, and an oracle that answers attempts.

A planner never sees geometry, pictures or networks. `SearchProblem` is all it may use, so a planner
can be tested on a number line, and an oracle can be exchanged (grounded geometry, a simulation) without
the planner knowing.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Generic, NamedTuple, Protocol, TypeVar

if TYPE_CHECKING:
    from neurosym.geometry.step_motion import StepMotion
    from neurosym.language.terms import Atom

S = TypeVar("S", bound=Hashable)


@dataclass(frozen=True, slots=True)
class Verdict:
    """The answer of a predicate, with its evidence. Truthy exactly when it holds.

    Attributes:
        because: names of the objects that decided it.
        reason: one sentence for a person.
        until: a promise, for a verdict that does not hold: it will not hold in any later state until one of these
            ground atoms changes. `None` promises nothing, an empty tuple that it never will. Planners learn from it,
            so it must be sound.
        unconditional: a stronger promise: the verdict does not depend on the rest of the state. It does not hold in
            any state in which the atoms of `until` are as they are now, whether or not it comes after this one.
        decided_by: the same promise for a state from which atoms may change either way, which a search from the goal
            needs: it does not hold in any state in which all these atoms are as they are now. `None` promises nothing,
            but where `unconditional` says that `until` will do.
        motion: for a verdict that holds, what it says of how the action may move parts, kept in the plan; a direction
            will do. Which parts move, and whether in or out, follows from the action's effects unless it says so.
        proved: for a verdict that does not hold, whether that is certain. A search for a path that ended without one
            proves nothing: what rests on it is given up, never called impossible. It can promise nothing either.
    """

    holds: bool
    because: tuple[str, ...] = ()
    reason: str = ""
    until: tuple[Atom, ...] | None = None
    motion: StepMotion | None = None
    unconditional: bool = False
    proved: bool = True
    decided_by: tuple[Atom, ...] | None = None

    def __bool__(self) -> bool:
        return self.holds


@dataclass(frozen=True, slots=True)
class Step(Generic[S]):
    """An attempt that succeeded: the new state, and how it moves parts, where it moves any."""

    state: S
    motion: StepMotion | None = None


@dataclass(frozen=True, slots=True)
class Rejection:
    """An attempt answered no, and why. An oracle gives the reason; a search's log adds what was attempted, and when.

    Attributes:
        reason: one sentence for a person.
        until: indices of actions. A promise: the action stays refused in every state reached from this one until one
            of these is done. Empty promises nothing. An action that can never succeed names itself. Planners prune by
            it, so it must be sound.
        unconditional: the promise holds in every state of the problem before one of `until` is done, not only in
            those reached from this one: what was learned in one branch of a search serves in all.
        given: indices of actions. An unconditional promise holds in those states alone in which all these are done.
        proved: whether the action is impossible for certain. A planner that met a rejection which is not must not
            call a problem unsolvable (`SearchLog.failed` sees to it).
        action: name of the action, in a result (`PlanResult.blame`).
        after: names of the actions that were done before it, likewise; from the empty side, of those undone before it.
        side: from which side of the problem it was asked, "full" or "empty", likewise.
    """

    reason: str
    because: tuple[str, ...] = ()
    until: tuple[int, ...] = ()
    unconditional: bool = False
    proved: bool = True
    given: tuple[int, ...] = ()
    action: str = field(default="", kw_only=True)
    after: tuple[str, ...] = field(default=(), kw_only=True)
    side: str = field(default="full", kw_only=True)


class RelaxedPlan(NamedTuple):
    """What a relaxation of a problem says of a state.

    Attributes:
        at_least: no plan from there has fewer actions: a bound, which must be sound.
        actions: indices of the actions of a plan of the relaxation, in order ("helpful", Hoffmann and Nebel 2001).
    """

    at_least: int
    actions: tuple[int, ...]


class SearchProblem(Protocol[S]):
    """All that a planner may use.

    Some more are looked for: ``relaxed_plan(state)``, a `RelaxedPlan` or None; ``exhaustive``, False where an action
    stands for several ways of which only one is tried, so that no search proves that a plan has the fewest actions;
    ``repeating``, a bitset of actions that may be done any number of times (none, where it lacks); ``remembered``, a
    bitset of those of which no state says whether they were done (all); ``costs`` of the actions (each the same), and
    ``task``, the `GroundTask` that heuristics ask.

    One of another kind than ground symbols that can be searched from its goal, too, has one method more: ``reversed()``
    gives the `SearchProblem` from there (`neurosym.language.reversal`).

    Attributes:
        actions: names of the N action primitives, in the order in which priors score them. Each can be used once in a
            plan, unless it is one of ``repeating``; the planner, not the state, remembers which were used.
        classes: one integer an action; swapping two actions of one class leaves the whole problem as it was.
        initial: the state to start from (hashable and small).
    """

    @property
    def actions(self) -> Sequence[str]: ...

    @property
    def classes(self) -> Sequence[int]: ...

    @property
    def initial(self) -> S: ...

    def is_goal(self, state: S) -> bool:
        """Whether the task is done in `state`."""
        ...

    def candidates(self, state: S) -> Iterable[int]:
        """Indices of the actions that are symbolically applicable in `state`: cheap, asks no oracle."""
        ...

    def attempt(self, state: S, action: int) -> Step[S] | Rejection:
        """Ask the oracle whether a candidate `action` may be done in `state`: costly, counted."""
        ...
