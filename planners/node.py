"""A state, and the way that a search took to it."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, Self

from neurosym.geometry.step_motion import StepMotion
from neurosym.language.search_problem import Step


@dataclass(slots=True, eq=False)
class Node:
    """A state, and the order of actions that led to it; planners add what they know of it.

    Attributes:
        used: bit a is set when action a was done, unless it is one of `repeating`.
        parent: where the last action was done; None at the root, where `action` and `motion` mean nothing.
        completion: the best order of actions from here on, when it is known.
        promises: rejections at this node that hold below it: action -> a bitset, one of which must be done first.
        repeating: a bitset of the actions that may be done again.
    """

    state: Any
    used: int = 0
    depth: int = 0
    parent: Self | None = None
    action: int = -1
    motion: StepMotion | None = None
    completion: tuple[int, ...] = ()
    promises: dict[int, int] = field(default_factory=dict)
    repeating: int = 0

    def child(self, action: int, step: Step[Any]) -> Self:
        """The node that a successful attempt leads to."""
        rest = self.completion[1:] if self.completion[:1] == (action,) else ()
        used = self.used | (1 << action & ~self.repeating)
        depth, repeating = self.depth + 1, self.repeating
        return type(self)(step.state, used, depth, self, action, step.motion, rest, repeating=repeating)

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

    def __len__(self) -> int:
        """How many actions led here; iterated over, the node gives them."""
        return self.depth

    def __bool__(self) -> bool:
        return True

    def __iter__(self) -> Iterator[int]:
        return iter(self.prefix())

    def __contains__(self, action: object) -> bool:
        return action in self.prefix()
