"""An exploded view: the parts pulled apart, named, numbered by the plan, in lines and faces that print sharp."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from neurosym.errors import InputError
from neurosym.geometry.shapes import Box
from neurosym.plotting.labels import AWAY, LETTERS, PITCH, Label, in_columns, said_of, width_of
from neurosym.plotting.layers import in_inches
from neurosym.plotting.paint import RGB, on_page, paint, seen_at
from neurosym.plotting.painter import Piece, back_to_front
from neurosym.plotting.solids import pieces_of, seen_from
from neurosym.plotting.style import COLUMN, SMALL, TITLE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from neurosym.geometry.assembly import Assembly
    from neurosym.planning.staging import Staging

Array = NDArray[np.float64]

#: More parts than this are drawn without names.
MOST_NAMED = 64
#: The drawing's greatest height, a cube's greatest edge, and an arm of the scale at most (inches).
_HIGHEST, _CUBE, _ARM = 4.6, 0.42, 0.34
#: Around all, for the title above, for the scale and the notes below, and between the drawing and the names (inches).
_MARGIN, _ABOVE, _BELOW, _BESIDE = 0.06, 0.4, 0.66, 0.12
_INK, _FIXED = "0.15", (0.78, 0.78, 0.78)


def exploded_figure(
    what: Assembly | Staging,
    *,
    spread: float = 1.0,
    view: tuple[float, float] = (-58.0, 24.0),
    title: str = "assembly",
) -> Figure:
    """The parts pulled apart: along their ways where there is a plan, else away from the middle.

    With a plan each part bears the numbers of the steps in which it moves, and a dashed line leads to where it rests.
    Fixed parts are grey. What hides what is exact, and lengths along one direction keep their proportions: the view is
    from infinitely far. The three arms of the scale are equally long along x, y and z. A dot marks the part that a
    name belongs to, an open dot one of which nothing can be seen from here. More than `MOST_NAMED` parts have no
    names. Save it as ``.svg`` or ``.pdf`` for print.

    Args:
        what: an assembly, or a plan in space, as
            ``neurosym.planning.staging.stage(problem, result.plan, result.how)`` gives it.
        spread: how far apart: 1 so that a plan's parts are clear of one another, 0 not at all.
        view: azimuth and elevation of the viewer in degrees; 0, 0 looks from +x, and z is up.
        title: what it is.

    Raises:
        InputError: a spread below 0, or a view that is not two numbers.
    """
    from neurosym.planning.staging import Staging
    from neurosym.simulation.exploded import explode  # geometry: no simulator is loaded

    if np.shape(view) != (2,) or not np.isfinite(view).all():
        raise InputError(f"Expected a view as azimuth and elevation in degrees; got {view!r}.")
    staging = what if isinstance(what, Staging) else Staging(what, what.names, ())
    assembly, turn = staging.assembly, seen_from(*view)
    shifts = explode(staging, spread=spread)
    rest = {name: _middle(assembly, k) for k, name in enumerate(assembly.names)}
    ways = [
        Piece(k, (), (), (np.array([rest[name], rest[name] + shifts[name]]) @ turn.T,), np.zeros((0, 4)))
        for k, name in enumerate(assembly.names)
        if staging.motions and shifts[name].any()
    ]
    pieces = back_to_front([*pieces_of(assembly, shifts, turn), *ways], turn.T.copy())
    numbers = _numbers(staging)
    said = {name: said_of(name, numbers.get(name, "")) for name in assembly.names[:MOST_NAMED]}
    named = len(said) == len(assembly)
    room = max(map(width_of, said.values())) + AWAY + _BESIDE if named else 0.0
    low, size = _extent(pieces)
    edge = _cube_edge(assembly)
    scale = min((COLUMN - 2 * (_MARGIN + room)) / size[0], _HIGHEST / size[1], _CUBE / edge if edge else np.inf)
    high = max(float(scale * size[1]), (-(-len(said) // 2) - 1) * PITCH if named else 0.0)
    figure, axis = in_inches(high + _ABOVE + _BELOW + 2 * _MARGIN)
    origin = np.array([COLUMN / 2, _BELOW + _MARGIN + high / 2]) - scale * (low + size / 2)
    placed = [on_page(piece, scale, origin) for piece in pieces]
    paint(axis, placed, _colours(staging))
    if named:
        seen = {assembly.names[part]: place for part, place in seen_at(placed).items()}
        hidden = set(said) - set(seen)
        for name in hidden:
            x, y, _ = (rest[name] + shifts[name]) @ turn.T
            seen[name] = (float(scale * x + origin[0]), float(scale * y + origin[1]))
        reach = float(scale * size[0]) / 2 + _BESIDE
        span = (_BELOW + _MARGIN, _BELOW + _MARGIN + high)
        _write_names(axis, in_columns(said, seen, COLUMN / 2 - reach, COLUMN / 2 + reach, span), hidden)
    _write_title(axis, title, len(assembly), named)
    _draw_scale(axis, turn, float(scale), edge, assembly.units)
    _write_notes(axis, staging)
    return figure


def _middle(assembly: Assembly, part: int) -> Array:
    own = assembly.body_bounds[assembly.owners == part]
    return np.asarray((own[:, 0].min(axis=0) + own[:, 1].max(axis=0)) / 2)


def _extent(pieces: Sequence[Piece]) -> tuple[Array, Array]:
    """The lower left corner of what is seen, and its width and height, float64 (2,) both."""
    every = np.concatenate([piece.points[:, :2] for piece in pieces])
    return every.min(axis=0), np.maximum(np.ptp(every, axis=0), 1e-12)


def _numbers(staging: Staging) -> dict[str, str]:
    """Part -> numbers of the steps in which it moves."""
    found: dict[str, list[str]] = {}
    for step, motion in enumerate(staging.motions):
        for name in motion.parts:
            found.setdefault(name, []).append(str(step + 1))
    return {name: "+".join(steps) for name, steps in found.items()}


def _colours(staging: Staging) -> list[RGB]:
    """One a part, as in films; what is fixed in a paler grey, on which lines show."""
    from neurosym.simulation.scene import part_colours  # loads no simulator

    found = part_colours(staging) | {name: _FIXED for name in staging.assembly.fixed if name not in staging.colours}
    return [found[name] for name in staging.assembly.names]


def _cube_edge(assembly: Assembly) -> float | None:
    """The edge of the cubes, where all bodies are equal ones."""
    if not all(isinstance(body.shape, Box) for body in assembly.bodies):
        return None
    edges = assembly.box_sizes
    return float(edges[0, 0]) if np.allclose(edges, edges[0, 0], rtol=1e-6) else None


def _write_names(axis: Axes, labels: Sequence[Label], hidden: Collection[str]) -> None:
    for label in labels:
        away = AWAY if label.right else -AWAY
        (x, y), (across, up) = label.place, label.point
        for colour, width in (("white", 1.2), (_INK, 0.4)):  # a light rim tells the line from edges of parts
            axis.plot([x - away / 2, across], [y, up], color=colour, lw=width, zorder=3)
        inside, rim = ("white", _INK) if label.key in hidden else (_INK, "white")
        axis.plot(across, up, "o", ms=2.2, mfc=inside, mec=rim, mew=0.4, zorder=4)
        side = "left" if label.right else "right"
        axis.text(x, y, label.said, fontsize=LETTERS, ha=side, va="center_baseline", zorder=5)


def _write_title(axis: Axes, title: str, parts: int, named: bool) -> None:
    said = f"{title}: exploded view\nn = {parts} part{'s' if parts != 1 else ''}"
    said += "" if named else "; names are left out"
    top = axis.get_ylim()[1] - _MARGIN
    axis.text(COLUMN / 2, top, said, fontsize=TITLE, ha="center", va="top", linespacing=1.3)


def _write_notes(axis: Axes, staging: Staging) -> None:
    arrives = {motion.arrives for motion in staging.motions}
    order = "of assembly" if arrives == {True} else "of removal" if arrives == {False} else "of the plan's steps"
    notes = [f"numbers: order {order}", "dashed: to its place"] if arrives else ["no plan: away from the middle"]
    if staging.assembly.fixed:
        notes.append("grey: fixed")
    said = "\n".join(notes)
    axis.text(COLUMN - _MARGIN, _BELOW / 2, said, fontsize=SMALL, ha="right", va="center", linespacing=1.25)


def _draw_scale(axis: Axes, turn: Array, scale: float, edge: float | None, units: str | None) -> None:
    """Three arms along x, y and z, and how long each is: 1, 2 or 5 times a power of ten, of cubes at least one."""
    unit = edge or 1.0
    most = _ARM / (scale * unit)
    power = 10.0 ** np.floor(np.log10(most))
    length = max(k * power for k in (1.0, 2.0, 5.0) if k * power <= most * (1 + 1e-9))
    length = max(length, 1.0) if edge else length
    arms = scale * unit * length * turn[:2].T
    low, high = np.minimum(arms.min(axis=0), 0), np.maximum(arms.max(axis=0), 0)
    start = np.array([_MARGIN + 0.08 - low[0], _BELOW / 2 - (low[1] + high[1]) / 2])
    for arm, name in zip(arms, "xyz"):
        long = float(np.linalg.norm(arm))
        axis.plot(*np.array([start, start + arm]).T, color=_INK, lw=1.0, solid_capstyle="round", zorder=3)
        if long > 0.05:  # one that is seen from its end is a point
            x, y = start + arm * (1 + 0.07 / long)
            axis.text(x, y, name, fontsize=6, ha="center", va="center", zorder=3)
    many = "" if length == 1 else "s"
    said = f"{length:g} cube{many}" if edge else f"{length:g} {units or f'unit{many} of length'}"
    said += f" of {edge:g} {units}" if edge and units else ""
    beside = start[0] + high[0] + 0.16
    axis.text(beside, _BELOW / 2, f"each arm:\n{said}", fontsize=SMALL, va="center", linespacing=1.25)
