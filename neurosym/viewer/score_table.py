"""A prior's order scores as a table, steps by actions, in HTML."""

from collections.abc import Sequence
from html import escape

import numpy as np

from neurosym.planning.order_scores import OrderScores
from neurosym.support.arrays import Array, Numbers
from neurosym.viewer.panels import WIDTH, as_data

#: A table of scores with more columns leaves out those that are neither likely at any step nor taken.
MOST_COLUMNS = 24
#: A table with more rows is drawn as a picture, without numbers and names.
MOST_ROWS = 40
#: Okabe and Ito's blue for probability, and vermilion for what was taken.
_INK, _TAKEN = np.array([0, 90, 140]), "#D55E00"


def scores_table(scores: OrderScores | None, actions: Sequence[str], taken: Sequence[str]) -> str:
    """A prior's order scores, steps by actions: the darker, the likelier; what the plan took has a ring."""
    if scores is None:
        return "<p>Planned without a prior.</p>"
    P, shared = np.exp(scores.log_prob), ""
    column = {name: j for j, name in enumerate(actions)}
    if len(actions) > MOST_COLUMNS and len(P) <= MOST_ROWS and len(set(scores.classes)) < len(actions):
        P, actions, column = _by_class(P, actions, scores.classes)
        shared = " Interchangeable actions share a column (a +2: a and two more)."
    marks = [(i, column[name]) for i, name in enumerate(taken) if name in column and i < len(P)]
    left_out = ""
    if len(P) > MOST_ROWS:
        drawn = _as_picture(P, marks)
    else:
        kept = _columns_to_show(P, [j for _, j in marks])
        if len(kept) < len(actions):
            rest = float(P[:, np.setdiff1d(np.arange(len(actions)), kept)].max())
            left_out = f" {len(actions) - len(kept)} actions of at most {rest:.2g} at any step are left out."
        place = {int(j): k for k, j in enumerate(kept)}
        drawn = _as_cells(P[:, kept], [actions[j] for j in kept], [(i, place[j]) for i, j in marks])
    legend = "The darker, the likelier the prior holds an action (column) at a step (row); a ring marks what was taken."
    return f"{drawn}<p class='quiet'>{legend}{shared}{left_out}</p>"


def _by_class(P: Array, actions: Sequence[str], classes: Sequence[int]) -> tuple[Array, list[str], dict[str, int]]:
    """A column a class, its probabilities summed; the columns' names; and the column of each action."""
    members: dict[int, list[int]] = {}
    for j, number in enumerate(classes):
        members.setdefault(number, []).append(j)
    names = [f"{actions[js[0]]} +{len(js) - 1}" if len(js) > 1 else actions[js[0]] for js in members.values()]
    summed = np.stack([P[:, js].sum(axis=1) for js in members.values()], axis=1)
    return summed, names, {actions[j]: k for k, js in enumerate(members.values()) for j in js}


def _columns_to_show(P: Array, taken: Sequence[int]) -> Numbers:
    if P.shape[1] <= MOST_COLUMNS:
        return np.arange(P.shape[1])
    likely = np.argsort(-P.max(axis=0), kind="stable")[: max(MOST_COLUMNS - len(set(taken)), 0)]
    return np.unique(np.concatenate([likely, np.array(taken, dtype=np.int64)]))


def _as_cells(P: Array, names: Sequence[str], marks: Sequence[tuple[int, int]]) -> str:
    """An SVG with a square a cell, its probability as a tooltip and, where there is room, as a number."""
    rows, columns = P.shape
    side = float(np.clip((WIDTH - 30) / max(columns, 1), 10, 44))
    longest = max((len(n) for n in names), default=0)
    upright = longest * 7 <= side
    head = 18 if upright else 6 * longest + 8
    font = min(11.0, 0.7 * side)
    svg = []

    def square(i: int, j: int, margin: float, look: str) -> str:
        x, y, size = 24 + j * side + margin, head + i * side + margin, side - 1 - 2 * margin
        return f"<rect x='{x:.1f}' y='{y:.1f}' width='{size:.1f}' height='{size:.1f}' {look}"

    for j, name in enumerate(names):
        x, y = 24 + (j + 0.5) * side, head - 5 + (0.0 if upright else 0.35 * font)
        turn = "" if upright else f" transform='rotate(-90 {x:.1f} {head - 5})'"
        anchor = "middle" if upright else "start"
        svg.append(f"<text x='{x:.1f}' y='{y:.1f}' text-anchor='{anchor}'{turn}>{escape(name)}</text>")
    for i in range(rows):
        svg.append(f"<text x='18' y='{head + (i + 0.65) * side:.1f}' text-anchor='end'>{i + 1}</text>")
        for j, name in enumerate(names):
            p = float(P[i, j])
            tip = f"<title>step {i + 1}, {escape(name)}: {p:.3g}</title>"
            svg.append(square(i, j, 0.0, f"fill='{_shade(p)}'>{tip}</rect>"))
            if side >= 26 and p >= 0.005:
                svg.append(
                    f"<text x='{24 + (j + 0.5) * side:.1f}' y='{head + (i + 0.62) * side:.1f}' text-anchor='middle' "
                    f"fill='{'#fff' if p > 0.45 else '#222'}' pointer-events='none'>"
                    f"{f'{p:.2f}'.removeprefix('0') if p < 0.995 else '1'}</text>"
                )
    svg.extend(square(i, j, 1.0, f"fill='none' stroke='{_TAKEN}' stroke-width='2.5' rx='3'/>") for i, j in marks)
    width, height = 26 + columns * side, head + rows * side + 2
    return (
        f"<svg width='{width:.0f}' height='{height:.0f}' viewBox='0 0 {width:.0f} {height:.0f}' "
        f"style='font:{font:.1f}px sans-serif;max-width:100%'>{''.join(svg)}</svg>"
    )


def _as_picture(P: Array, marks: Sequence[tuple[int, int]]) -> str:
    """A large table as a picture, a pixel a cell, what was taken in colour."""
    colours = np.rint(255 + (_INK - 255) * np.sqrt(P)[..., None]).astype(np.uint8)
    for i, j in marks:
        colours[i, j] = (213, 94, 0)
    height = max(40, round(WIDTH * P.shape[0] / P.shape[1]))
    return (
        f"<img src='{as_data(colours)}' width='{WIDTH}' height='{height}' alt='order scores' "
        "style='image-rendering:pixelated;border:1px solid #ccc;max-width:100%'>"
    )


def _shade(p: float) -> str:
    r, g, b = np.rint(255 + (_INK - 255) * np.sqrt(min(max(p, 0.0), 1.0))).astype(int)
    return f"#{r:02x}{g:02x}{b:02x}"
