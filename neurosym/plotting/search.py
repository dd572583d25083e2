"""Where a search went: each attempt a branch, coloured by the verdict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from matplotlib.axes import Axes

from neurosym.planning.result import PlanResult
from neurosym.plotting.style import (
    COLOURS,
    COLUMN,
    TITLE,
    Figure,
    add_legend,
    mark,
    shortened,
    tidy,
    width_of,
    without_common,
)

#: Refusals that are drawn, the first ones; the title says how many there were.
MOST_REFUSALS = 300
#: More rows than this are drawn without names; of many steps so many bear a number.
MOST_NAMES, MOST_TICKS = 60, 10
#: Size of names (points), and the least number of letters that a cut one has.
_LETTERS, _LEAST = 6.0, 4
#: Where branches leave a node, in steps.
_TRUNK = 0.1

ON_PLAN, LEFT, REFUSED = COLOURS[4], "0.6", COLOURS[3]


@dataclass
class _Node:
    """A state that the search accepted: what was refused there, and where it went on. A place, once it is laid out."""

    step: int
    on_plan: bool = False
    refused: list[str] = field(default_factory=list)
    next: dict[str, _Node] = field(default_factory=dict)
    row: float = 0.0
    refused_rows: list[int] = field(default_factory=list)


def search_figure(result: PlanResult, *, title: str = "search") -> Figure:
    """The search as a tree, from left to right a step a column: what was accepted, refused, and became the plan.

    It is drawn from the refusals that a result keeps. A state that was accepted, and left before anything was refused
    after it, is not among them.

    `result`: of any planner. `title`: what was planned, and how.
    """
    root, drawn = _tree(result)
    rows = _lay_out(root, 0)
    steps = max(node.step + (1 if node.refused else 0) for node in _all(root))
    named = rows <= MOST_NAMES
    height = min(max(0.13 * rows, 0.5), 7.0) if named else 5.0
    figure = Figure(figsize=(COLUMN, height + 1.05), layout="constrained")
    axis = figure.subplots()
    beyond = _beyond(root, steps) if named else 0.1
    step = (COLUMN - 0.2 - beyond) / (steps + 0.3)
    left_out = _draw(axis, root, step if named else 0.0)
    axis.set_ylim(rows - 0.4, -0.8)
    axis.set_xlim(-0.3, steps + beyond / step)
    every = max(1, -(-steps // MOST_TICKS))
    axis.set_xticks(range(0, steps + 1, every))
    axis.set_yticks([])
    tidy(axis, sides=("top", "left", "right"))
    axis.set_xlabel("steps done", fontsize=TITLE)
    cuts = [f"the first {drawn:,} of {len(result.blame):,} refusals"] if drawn < len(result.blame) else []
    cuts += ["names are left out"] if not named else [f"{left_out} names are left out"] if left_out else []
    ended = result.status.name.lower().replace("_", " ")
    lines = [f"{title}: {ended}", f"n = {_counts(result)}", *(["; ".join(cuts)] if cuts else [])]
    figure.suptitle("\n".join(lines), fontsize=TITLE)
    nodes = list(_all(root))
    marks = [mark("o", "the plan", ls="-", color=ON_PLAN, ms=4, lw=1.6)] if result.solved else []
    if any(not node.on_plan for node in nodes):
        label = "accepted, left" if result.solved else "accepted"
        marks.append(mark("o", label, ls="-", color=LEFT, ms=3.2, lw=0.7))
    if any(node.refused for node in nodes):
        marks.append(mark("x", "refused", ls=":", color=REFUSED, ms=3.2, lw=0.6))
    add_legend(figure, marks, columns=3)
    return figure


def _counts(result: PlanResult) -> str:
    counts = {"attempt": result.attempts, "iteration": result.iterations, "expansion": result.expansions}
    return ", ".join(f"{n:,} {what}{'' if n == 1 else 's'}" for what, n in counts.items())


def _beyond(root: _Node, steps: int) -> float:
    """What names of refusals at the right edge need (inches)."""
    last = [shortened(name) for node in _all(root) if node.step == steps - 1 for name in node.refused]
    return 0.15 + max((width_of(name, _LETTERS) for name in last), default=0.0)


def _tree(result: PlanResult) -> tuple[_Node, int]:
    """The tree of a search, and how many refusals are in it."""
    root = _Node(0)
    shown = [r for r in result.blame if r.side == "full"][:MOST_REFUSALS]
    names = [r.action for r in shown] + [a for r in shown for a in r.after] + list(result.plan or result.best_prefix)
    short = without_common(names)
    for refusal in shown:
        _reach(root, [short[a] for a in refusal.after])[-1].refused.append(short[refusal.action])
    for node in _reach(root, [short[a] for a in (result.plan or result.best_prefix)]):
        node.on_plan = result.solved
    return root, len(shown)


def _reach(root: _Node, actions: Sequence[str]) -> list[_Node]:
    """All nodes that these actions pass through, which are made where they are missing."""
    passed = [root]
    for action in actions:
        passed.append(passed[-1].next.setdefault(action, _Node(passed[-1].step + 1)))
    return passed


def _all(root: _Node) -> Iterator[_Node]:
    waiting = [root]
    while waiting:
        node = waiting.pop()
        yield node
        waiting += node.next.values()


def _lay_out(root: _Node, row: int) -> int:
    """Give every node and refusal a row; returns how many there are. Children first, without recursion."""
    for node, leaving in _walk(root):
        if not leaving:
            node.refused_rows = list(range(row, row + len(node.refused)))
            row += len(node.refused)
            if not node.next:
                node.row = float(row)
                row += 1
            continue
        if node.next:
            own = [child.row for child in node.next.values()]
            on_plan = [child.row for child in node.next.values() if child.on_plan]
            node.row = on_plan[0] if on_plan else sum(own) / len(own)
    return row


def _walk(root: _Node) -> Iterator[tuple[_Node, bool]]:
    """Each node twice: before and after its children."""
    waiting = [(root, False)]
    while waiting:
        node, leaving = waiting.pop()
        yield node, leaving
        if not leaving:
            waiting.append((node, True))
            waiting += [(child, False) for child in reversed(node.next.values())]


def _draw(axis: Axes, root: _Node, step: float) -> int:
    """All branches; names where a step is `step` inches wide, above 0. Returns how many names found no room."""
    size, left_out = 3.2 if step else 1.8, 0
    for node in _all(root):
        for name, child in node.next.items():
            kept = child.on_plan
            look = {"color": ON_PLAN if kept else LEFT, "lw": 1.6 if kept else 0.7, "zorder": 3 if kept else 2}
            _branch(axis, node, child.step, child.row, look)
            room = (1 - _TRUNK) * step - 0.02
            text = _fitting(name, room) if step else ""
            left_out += bool(step and not text)
            if text:
                # Clear of what is refused in the row above, if there is room.
                at = child.step - min(0.06, room - width_of(text, _LETTERS)) / step
                colour = ON_PLAN if kept else "0.35"
                axis.text(at, child.row - 0.12, text, fontsize=_LETTERS, color=colour, ha="right", va="bottom")
        for name, row in zip(node.refused, node.refused_rows):
            _branch(axis, node, node.step + 1, row, {"color": REFUSED, "lw": 0.6, "zorder": 1, "ls": ":"})
            axis.plot(node.step + 1, row, "x", color=REFUSED, ms=size, mew=1.0, zorder=4)
            if step:
                at = node.step + 1 + 0.05 / step
                place: dict[str, Any] = {"ha": "left", "va": "center_baseline", "zorder": 6}
                axis.text(at, row, shortened(name), fontsize=_LETTERS, color=REFUSED, **place)
        colour = ON_PLAN if node.on_plan else LEFT
        axis.plot(node.step, node.row, "o", color=colour, ms=size + (0.8 if node.on_plan else 0), zorder=5)
    return left_out


def _branch(axis: Axes, node: _Node, step: int, row: float, look: dict[str, Any]) -> None:
    bend = node.step + _TRUNK
    axis.plot([node.step, bend, bend, step], [node.row, node.row, row, row], solid_joinstyle="round", **look)


def _fitting(name: str, width: float) -> str:
    """The name, cut to a width (inches), or nothing where too little of it would be left."""
    letters = len(name)
    while letters and width_of(shortened(name, letters), _LETTERS) > width:
        letters -= 1
    return shortened(name, letters) if letters >= min(len(name), _LEAST) else ""
