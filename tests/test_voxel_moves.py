"""Moves of voxel parts: the least number, against a search over all subsets; proofs that nothing comes apart."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import neurosym as ns
from neurosym.errors import InputError
from neurosym.geometry.paths import voxel_search
from neurosym.geometry.paths.grid import GridCells, cells_of
from neurosym.geometry.paths.path_check import check_path
from neurosym.geometry.paths.voxel_search import first_separation
from neurosym.geometry.paths.voxel_separation import DIRECTIONS, Separation, Stuck, separation_path
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.testing.burrs import BOLTS, BURRS, LEVEL_4, PAIRS, RINGS, STRAIGHT, burr, read_layers

FAR = 12


def grid(cells) -> GridCells:
    arrays = tuple(np.array(sorted(c), dtype=np.int64) for c in cells.values())
    return GridCells(tuple(cells), arrays, np.ones(3), np.eye(3), np.zeros(3))


def take_apart(cells: GridCells, among: int) -> tuple[list[Separation], Stuck | None]:
    """Separate a block, then both halves as they are in one's hands, until every part is single, or one is stuck.

    Nothing is lost by taking the first separation that comes: what takes the whole apart takes every subset apart, and
    moves can be undone. So where a sub-assembly is stuck for good, the whole is.
    """
    steps, blocks = [], [(among, {})]
    while blocks:
        block, start = blocks.pop()
        if block.bit_count() < 2:
            continue
        found = first_separation(cells, block, start=start)
        if isinstance(found, Stuck):
            return steps, found
        steps.append(found)
        halves = (found.group, found.rest)
        blocks.extend((half, {p: o for p, o in found.offsets.items() if half >> p & 1}) for half in halves)
    return steps, None


def brute_level(cells, fixed=(), floor=None, cap=4000):
    """Moves to the first separation, by all subsets of parts, all steps, cell by cell; None: never; -1: too many."""
    bodies = [frozenset(map(tuple, c)) for c in cells.values()]
    n = len(bodies)
    movable = [i for i, name in enumerate(cells) if name not in fixed]
    subsets = [s for k in range(1, n) for s in itertools.combinations(movable, k)]
    start = tuple((0, 0, 0) for _ in bodies)

    def placed(at):
        return [{tuple(np.add(c, o)) for c in body} for body, o in zip(bodies, at)]

    def canon(at):
        return at if fixed else tuple(tuple(np.subtract(o, at[0])) for o in at)

    layer, seen, level = [start], {start}, 0
    while layer:
        level += 1
        following = []
        for at in layer:
            where = placed(at)
            for subset in subsets:
                moving = set().union(*(where[i] for i in subset))
                rest = set().union(*(where[i] for i in range(n) if i not in subset))
                for d in DIRECTIONS:
                    for steps in range(1, FAR + 1):
                        shifted = {tuple(np.add(c, np.multiply(d, steps))) for c in moving}
                        if shifted & rest or (floor is not None and min(c[2] for c in shifted) < floor):
                            break
                        reached = [
                            tuple(int(v) for v in np.add(o, np.multiply(d, steps))) if i in subset else o
                            for i, o in enumerate(at)
                        ]
                        if steps < FAR:
                            state = canon(tuple(reached))
                            if state not in seen:
                                seen.add(state)
                                following.append(state)
                    else:
                        return level
        if len(seen) > cap:
            return -1
        layer = following
    return None


def stretched(cells, factor):
    """Every cell as so many cells in a row along x."""
    return {
        name: [(factor * x + k, y, z) for x, y, z in own for k in range(factor)] for name, own in sorted(cells.items())
    }


@st.composite
def puzzles(draw):
    """A known puzzle with a few cells given to other parts, or to none, perhaps stretched; parts may fall to pieces."""
    base = draw(st.sampled_from([LEVEL_4, LEVEL_4, PAIRS, STRAIGHT, RINGS, BOLTS])).cells
    owner = {cell: name for name, own in base.items() for cell in own}
    box = [range(max(cell[k] for cell in owner) + 1) for k in range(3)]
    for _ in range(draw(st.integers(0, 3))):
        cell = tuple(draw(st.sampled_from(span)) for span in box)
        name = draw(st.sampled_from([*base, None]))
        if name is None:
            owner.pop(cell, None)
        else:
            owner[cell] = name
    cells: dict[str, list] = {}
    for cell, name in owner.items():
        cells.setdefault(name, []).append(cell)
    return stretched(dict(sorted(cells.items())), draw(st.sampled_from([1, 1, 2])))


@given(puzzles())
@settings(max_examples=100, deadline=None)
@example(stretched(LEVEL_4.cells, 2))
@example(BOLTS.cells)
def test_levels_are_those_of_a_search_over_all_subsets(cells):
    if len(cells) < 2:
        return
    expected = brute_level(cells, cap=150)
    found = first_separation(grid(cells), (1 << len(cells)) - 1)
    if expected == -1:
        return
    if expected is None:
        assert isinstance(found, Stuck)
        assert found.proved
    else:
        assert isinstance(found, Separation)
        assert found.level == expected


@given(puzzles(), st.booleans())
@settings(max_examples=60, deadline=None)
@example(BOLTS.cells, False)
def test_fixed_parts_stay_and_nothing_goes_below_the_ground(cells, on_ground):
    if len(cells) < 2:
        return
    fixed = max(cells, key=lambda name: len(cells[name]))
    mask = 1 << list(cells).index(fixed)
    floor = min(c[2] for own in cells.values() for c in own) if on_ground else None
    expected = brute_level(cells, fixed={fixed}, floor=floor, cap=150)
    ground = None if floor is None else float(floor)
    found = first_separation(grid(cells), (1 << len(cells)) - 1, fixed=mask, ground=ground)
    if expected == -1:
        return
    assert (found.level if isinstance(found, Separation) else None) == expected
    if isinstance(found, Separation):
        assert not any(m.group & mask for m in found.moves)
        assert not (on_ground and found.moves[-1].direction == (0, 0, -1))


@pytest.mark.parametrize("puzzle", BURRS.values(), ids=BURRS)
def test_burrs_have_the_levels_that_they_state(puzzle):
    cells = puzzle.cells
    full = (1 << len(cells)) - 1
    assert brute_level(cells) == (None if puzzle.levels is None else puzzle.levels[0])
    steps, stuck = take_apart(grid(cells), full)
    if puzzle.levels is None:
        assert stuck is not None
        assert stuck.proved
        assert stuck.block == full
    else:
        assert stuck is None
        assert tuple(step.level for step in steps) == puzzle.levels
    graph = AssemblyGeometry(ns.Assembly.from_cells(cells)).blocking()
    single_is_free = any(graph.free_directions(p, full) for p in range(len(cells)))
    assert single_is_free == (puzzle is STRAIGHT)
    assert puzzle.groups == (puzzle is PAIRS)


def test_the_pair_leaves_together():
    found = first_separation(grid(PAIRS.cells), 0b1111)
    assert isinstance(found, Separation)
    assert found.level == 1
    assert {found.group, found.rest} == {0b0011, 0b1100}


@pytest.mark.parametrize("turn", [(0, 0, 0), (90, 0, 0), (30, 20, 10)], ids=str)
@pytest.mark.parametrize("name", ["straight", "pairs", "level-4", "bolts"])
def test_every_step_of_a_disassembly_passes_the_check_of_paths(name, turn):
    cells = burr(name).cells
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("zyx", turn, degrees=True).as_matrix()
    X[:3, 3] = (100.0, -20.0, 3.0)
    assembly = ns.Assembly.from_cells(cells, 0.02).transformed(X)
    on_grid = cells_of(assembly)
    assert on_grid is not None
    full = (1 << len(cells)) - 1
    steps, _ = take_apart(on_grid, full)
    assert tuple(step.level for step in steps) == burr(name).levels
    for step in steps:
        for home in (True, False):
            path = separation_path(on_grid, step, home=home)
            assert path.kind == "moves"
            assert set(path.parts) == set(assembly.in_mask(step.group))
            check = check_path(path, assembly, step.group | step.rest)
            assert check.holds, check.reason
            assert check_path(path.reversed(), assembly, step.group | step.rest).holds


def test_a_move_too_far_does_not_pass_the_check():
    assembly = ns.Assembly.from_cells(LEVEL_4.cells)
    on_grid = cells_of(assembly)
    assert on_grid is not None
    found = first_separation(on_grid, 0b111)
    assert isinstance(found, Separation)
    path = separation_path(on_grid, found)
    poses = path.tracks[0].poses.copy()
    poses[1:-1, :3, 3] *= 1.5
    bad = replace(path, tracks=(replace(path.tracks[0], poses=poses), *path.tracks[1:]))
    check = check_path(bad, assembly, 0b111)
    assert not check.holds
    assert set(check.parts) <= {"a", "b", "c"}
    assert "meets" in check.reason


def test_after_a_separation_both_halves_go_home():
    on_grid = grid(LEVEL_4.cells)
    found = first_separation(on_grid, 0b111)
    assert isinstance(found, Separation)
    path = separation_path(on_grid, found, home=True)
    ends = {name: t.poses[-1] for t in path.tracks for name in t.parts}
    leaving = [ends[name] for name in path.parts]
    assert all(np.allclose(X, leaving[0]) for X in leaving)
    assert all(np.allclose(X, np.eye(4)) for name, X in ends.items() if name not in path.parts)


@given(st.permutations("abc"), st.sampled_from(list(itertools.permutations(range(3)))), st.tuples(*[st.booleans()] * 3))
@settings(max_examples=25, deadline=None)
def test_the_level_depends_on_no_name_order_or_frame(names, axes, flips):
    cells = {new: LEVEL_4.cells[old] for new, old in zip(names, "abc")}
    turned = {
        name: [tuple((-1 if flips[k] else 1) * c[axes[k]] for k in range(3)) for c in own]
        for name, own in sorted(cells.items())
    }
    steps, _ = take_apart(grid(turned), 0b111)
    assert tuple(step.level for step in steps) == LEVEL_4.levels


def test_a_search_that_may_not_go_on_proves_nothing():
    found = first_separation(grid(RINGS.cells), 0b11, max_states=2)
    assert isinstance(found, Stuck)
    assert not found.proved
    whole = first_separation(grid(RINGS.cells), 0b11)
    assert isinstance(whole, Stuck)
    assert whole.proved
    assert whole.explored > 2


def test_only_wanted_groups_leave():
    on_grid = grid(STRAIGHT.cells)
    free = first_separation(on_grid, 0b11111)
    assert isinstance(free, Separation)
    for part in range(5):
        found = first_separation(on_grid, 0b11111, accept=lambda g, p=part: g == 1 << p, max_states=500)
        if isinstance(found, Separation):
            assert found.group == 1 << part
            assert found.level >= free.level


def test_the_grid_is_found_in_any_pose_and_for_bricks():
    bricks = {"a": [(0, 0, 0), (1, 0, 0)], "b": [(0, 0, 1), (1, 0, 1)], "c": [(2, 0, 0), (2, 0, 1)]}
    assembly = ns.Assembly.from_cells(bricks, 0.4)
    for degrees in (0, 17):
        X = np.eye(4)
        X[:3, :3] = Rotation.from_euler("xyz", [degrees, 2 * degrees, 90], degrees=True).as_matrix()
        X[:3, 3] = (1e3, 5.0, -2.0)
        found = cells_of(assembly.transformed(X))
        assert found is not None
        assert np.allclose(found.pitch, 0.4)
        corners = [X[:3, :3] @ ((np.array(c) + 0.5) * 0.4) + X[:3, 3] for c in bricks["c"]]
        centres = (found.cells[2] + 0.5) * found.pitch @ found.frame.T + found.origin
        assert np.allclose(sorted(map(tuple, centres.round(6))), sorted(map(tuple, np.round(corners, 6))))


def test_parts_off_the_grid_have_none():
    from neurosym.geometry.shapes import boxes_part

    one = boxes_part("one", np.zeros((1, 3)), np.ones(3))
    for offset, size in ((1.37, 1.0), (1.0, 1.0 / 7.3)):
        other = boxes_part("other", np.array([[0.5 + size / 2 + offset - 1.0, 0.0, 0.0]]), np.full(3, size))
        assert cells_of(ns.Assembly((one, other))) is None
    turned = np.eye(4)
    turned[:3, :3] = Rotation.from_euler("z", 20, degrees=True).as_matrix()
    turned[0, 3] = 3.0
    assert cells_of(ns.Assembly((one, boxes_part("other", np.zeros((1, 3)), np.ones(3), turned)))) is None


def test_bad_questions_are_refused():
    with pytest.raises(InputError, match="two or more parts"):
        first_separation(grid(RINGS.cells), 0b01)
    with pytest.raises(InputError, match="side by side"):
        read_layers("aa bb\naa")
    with pytest.raises(InputError, match="letter"):
        read_layers("... ...")
    with pytest.raises(InputError, match="level-4"):
        burr("level-5")


def test_a_fixed_part_stays_however_small_it_is():
    on_grid = grid(STRAIGHT.cells)
    for part in range(5):
        found = first_separation(on_grid, 0b11111, fixed=1 << part)
        assert isinstance(found, Separation)
        assert not any(move.group >> part & 1 for move in found.moves)
        assert found.rest >> part & 1


def test_where_nothing_is_wanted_the_search_ends():
    # Parts that are out of one another altogether are followed no farther, or the search would never end.
    cells = read_layers(
        """
        aba
        aaa
        """
    )
    found = first_separation(grid(cells), 0b11, accept=lambda group: False, max_states=2_000)
    assert isinstance(found, Stuck)
    assert found.proved
    assert found.explored > 10


def test_another_part_makes_way_for_the_one_that_is_wanted():
    # The tray t can leave upwards at once; drawn along by one cell, it lets w out of its pocket through its hole.
    cells = read_layers(
        """
        ffffff  ffffff  .ttt..
        ffffff  fffwff  .t.t..
        ffffff  ffffff  .ttt..
        """
    )
    first = first_separation(grid(cells), 0b111, fixed=1)
    assert isinstance(first, Separation)
    assert first.level == 1
    wanted = 1 << list(cells).index("w")
    found = first_separation(grid(cells), 0b111, fixed=1, accept=lambda group: group == wanted)
    assert isinstance(found, Separation)
    assert found.group == wanted
    assert found.level == 2


@given(puzzles(), st.booleans())
@settings(max_examples=40, deadline=None)
def test_many_parts_are_answered_as_few_are(cells, fixed):
    if len(cells) < 2:
        return
    full, held = (1 << len(cells)) - 1, int(fixed)
    few = first_separation(grid(cells), full, fixed=held)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(voxel_search, "FEW", 1)
        many = first_separation(grid(cells), full, fixed=held)
    assert type(many) is type(few)
    if isinstance(few, Separation) and isinstance(many, Separation):
        assert (many.level, many.group) == (few.level, few.group)
    else:
        assert many == few


def test_a_wall_of_hundreds_of_bricks_is_answered_at_once():
    cells = {f"{x} {z}": [(2 * x + z % 2 + k, 0, z) for k in (0, 1)] for x in range(20) for z in range(20)}
    found = first_separation(grid(cells), (1 << len(cells)) - 1)
    assert isinstance(found, Separation)
    assert found.level == 1
    assert found.group.bit_count() == 1
