"""Where a search went: each attempt a branch, coloured by the verdict."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from neurosym.planner import PlanResult
from neurosym.plotting.layers import shortened
from neurosym.plotting.style import COLOURS, COLUMN, SMALL, TITLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Refusals that are drawn, the first ones; the title says how many there were.
MOST_REFUSALS = 300
#: More rows than this are drawn without names.
MOST_NAMES = 60

#: Width of a letter of names (inches).
_LETTER = 0.05

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

    Args:
        result: of any planner.
        title: what was planned, and how.
    """
    from matplotlib.figure import Figure

    root, drawn = _tree(result)
    rows = _lay_out(root, 0)
    steps = max(node.step + (1 if node.refused else 0) for node in _all(root))
    named = rows <= MOST_NAMES
    height = min(max(0.13 * rows, 0.5), 7.0) if named else 5.0
    figure = Figure(figsize=(COLUMN, height + 1.05), layout="constrained")
    axis = figure.subplots()
    room = int((COLUMN - 0.3) / (steps + 0.7) / _LETTER) - 1
    _draw(axis, root, max(room, 1) if named else 0)
    axis.set_ylim(rows - 0.4, -0.6)
    axis.set_xlim(-0.25, steps + 0.45)
    axis.set_xticks(range(steps + 1))
    axis.tick_params(labelsize=SMALL)
    axis.set_yticks([])
    for side in ("top", "left", "right"):
        axis.spines[side].set_visible(False)
    axis.set_xlabel("steps done", fontsize=TITLE)
    counts = f"n = {result.attempts} attempts, {result.iterations} iterations, {result.expansions} expansions"
    cut = f"\nthe first {drawn} of {len(result.blame)} refusals" if drawn < len(result.blame) else ""
    figure.suptitle(f"{title}: {_ended(result)}\n{counts}{cut}", fontsize=TITLE)
    _legend(figure, solved=result.solved)
    return figure


def _ended(result: PlanResult) -> str:
    return result.status.name.lower().replace("_", " ")


def _tree(result: PlanResult) -> tuple[_Node, int]:
    """The tree of a search, and how many refusals are in it."""
    root = _Node(0)
    shown = result.blame[:MOST_REFUSALS]
    names = [r.action for r in shown] + [a for r in shown for a in r.after] + list(result.plan or result.best_prefix)
    short = _shorter(names)
    for refusal in shown:
        _reach(root, [short[a] for a in refusal.after])[-1].refused.append(short[refusal.action])
    for node in _reach(root, [short[a] for a in (result.plan or result.best_prefix)]):
        node.on_plan = result.solved
    return root, len(shown)


def _reach(root: _Node, actions: Sequence[str]) -> list[_Node]:
    """All nodes on the way, which are made where they are missing."""
    way = [root]
    for action in actions:
        way.append(way[-1].next.setdefault(action, _Node(way[-1].step + 1)))
    return way


def _shorter(names: Sequence[str]) -> dict[str, str]:
    """Names without what all of them share: ``remove(leg)`` among removals is ``leg``."""
    heads = {name.partition("(")[0] for name in names}
    if len(heads) == 1 and all(name.endswith(")") and "(" in name for name in names):
        return {name: name.partition("(")[2][:-1] for name in names}
    return {name: name for name in names}


def _all(node: _Node) -> Iterator[_Node]:
    waiting = [node]
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


def _draw(axis: Axes, root: _Node, room: int) -> None:
    size = 3.2 if room else 1.8
    for node in _all(root):
        for name, child in node.next.items():
            kept = child.on_plan
            look = {"color": ON_PLAN if kept else LEFT, "lw": 1.6 if kept else 0.7, "zorder": 3 if kept else 2}
            _branch(axis, node, child.step, child.row, look)
            _name(axis, child.step, child.row, name, room, ON_PLAN if kept else "0.35")
        for name, row in zip(node.refused, node.refused_rows):
            _branch(axis, node, node.step + 1, row, {"color": REFUSED, "lw": 0.6, "zorder": 1, "ls": ":"})
            axis.plot(node.step + 1, row, "x", color=REFUSED, ms=size, mew=1.0, zorder=4)
            _name(axis, node.step + 1, row, name, room, REFUSED)
        colour = ON_PLAN if node.on_plan else LEFT
        axis.plot(node.step, node.row, "o", color=colour, ms=size + (0.8 if node.on_plan else 0), zorder=5)


def _branch(axis: Axes, node: _Node, step: int, row: float, look: dict[str, Any]) -> None:
    axis.plot([node.step, node.step + 0.25, step], [node.row, row, row], solid_joinstyle="round", **look)


def _name(axis: Axes, step: int, row: float, name: str, room: int, colour: str) -> None:
    if room:
        axis.text(step - 0.07, row - 0.08, shortened(name, room), fontsize=6, color=colour, ha="right", va="bottom")


def _legend(figure: Figure, *, solved: bool) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=LEFT, marker="o", ms=3.2, lw=0.7, label="accepted, left" if solved else "accepted"),
        Line2D([], [], color=REFUSED, marker="x", ms=3.2, lw=0.6, ls=":", label="refused"),
    ]
    if solved:
        handles.insert(0, Line2D([], [], color=ON_PLAN, marker="o", ms=4, lw=1.6, label="the plan"))
    figure.legend(handles=handles, loc="outside lower center", ncols=3, fontsize=SMALL, frameon=False)
