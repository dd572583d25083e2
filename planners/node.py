"""A state, and the way that a search took to it."""

from dataclasses import dataclass, field
from typing import Any, Self

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Step


@dataclass(slots=True, eq=False)
class Node:
    """A state, and the order of actions that led to it; planners add what they know of it.

    Attributes:
        used: bit a is set when action a was done.
        parent: where the last action was done; None at the root, where `action` and `motion` mean nothing.
        completion: the best order of actions from here on, when it is known.
        promises: rejections at this node that hold below it: action -> a bitset, one of which must be done first.
    """

    state: Any
    used: int = 0
    depth: int = 0
    parent: Self | None = None
    action: int = -1
    motion: StepMotion | None = None
    completion: tuple[int, ...] = ()
    promises: dict[int, int] = field(default_factory=dict)

    def child(self, action: int, step: Step[Any]) -> Self:
        """The node that a successful attempt leads to."""
        rest = self.completion[1:] if self.completion[:1] == (action,) else ()
        return type(self)(step.state, self.used | 1 << action, self.depth + 1, self, action, step.motion, rest)

    def path(self) -> list[Self]:
        """The nodes after the root, this one last."""
        nodes, node = [], self
        while node.parent is not None:
            nodes.append(node)
            node = node.parent
        return nodes[::-1]

    def prefix(self) -> tuple[int, ...]:
        """The actions from the root to here."""
        return tuple([node.action for node in self.path()])
