"""Settling, and the oracle that asks PyBullet."""

from __future__ import annotations

import gc
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pytest

from neurosym.errors import InputError, UnknownNameError
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.shapes import Body, Convex, Mesh, Part
from neurosym.language.search_problem import Rejection, Step
from neurosym.simulation import PhysicsOracle, World, open_clients, stands
from neurosym.simulation.solids import rigid_bodies

Cells = Mapping[str, Sequence[tuple[int, int, int]]]

TOWER: Cells = {name: [(0, 0, z)] for z, name in enumerate("abcdef")}
BOX_WITH_LID: Cells = {
    "box": [(x, y, z) for x in range(3) for y in range(3) for z in range(2) if (x, y, z) != (1, 1, 1)],
    "core": [(1, 1, 1)],
    "lid": [(x, y, 2) for x in range(3) for y in range(3)],
}


class Removals:
    """A grounded problem in which any part that is there may be removed: bit i of a state says that part i is."""

    def __init__(self, count: int) -> None:
        self.actions = [f"remove {i}" for i in range(count)]
        self.classes = list(range(count))
        self.initial = (1 << count) - 1

    def is_goal(self, state: int) -> bool:
        return state == 0

    def candidates(self, state: int) -> list[int]:
        return [i for i in range(len(self.actions)) if state >> i & 1]

    def apply(self, state: int, action: int) -> int:
        return state & ~(1 << action)


@pytest.fixture(autouse=True)
def _every_client_is_closed() -> Iterator[None]:
    gc.collect()
    before = open_clients()
    yield
    gc.collect()
    assert open_clients() == before


def oracle(cells: Cells, **options: object) -> PhysicsOracle:
    return PhysicsOracle(Removals(len(cells)), Assembly.from_cells(cells), removes=list(cells), **options)


def turned(degrees: float) -> np.ndarray:
    a = np.radians(degrees)
    X = np.eye(4)
    X[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
    return X


def test_the_banner_reaches_nobody() -> None:
    program = (
        "import os, sys\n"
        "from neurosym.simulation import Client, PictureStudio\n"
        "assert 'pybullet' not in sys.modules\n"
        "os.write(1, b'before|'); print('said', end='|')\n"
        "with Client() as c: c.p.stepSimulation(physicsClientId=c.id)\n"
        "PictureStudio().close()\n"
        "print('after', end='')\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("before|said|after", "")


def test_it_imports_with_the_standard_descriptors_closed() -> None:
    program = "import os; os.close(1); os.close(2)\nfrom neurosym.simulation import Client\nClient().close()\n"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


def test_clients_close_on_exceptions_and_when_forgotten() -> None:
    before = open_clients()
    with pytest.raises(UnknownNameError), World(Assembly.from_cells(TOWER)) as world:
        world.remove("nobody")
    assert open_clients() == before
    forgotten = oracle(TOWER)
    assert open_clients() == before + 1
    del forgotten
    gc.collect()
    assert open_clients() == before
    with pytest.raises(UnknownNameError):
        World(Assembly.from_cells(TOWER), present=["nobody"])
    assert open_clients() == before


@pytest.mark.parametrize("size", [1.0, 0.05, 40.0])
def test_a_tall_stack_stands_and_what_floats_falls(size: float) -> None:
    assert stands(Assembly.from_cells(TOWER, size)) == {}
    fallen = stands(Assembly.from_cells(TOWER, size), present=["a", "b", "d", "e"])
    assert set(fallen) == {"d", "e"}
    assert fallen["d"] == pytest.approx(size, rel=0.02)


def test_a_beam_tips_past_its_support_and_not_before() -> None:
    post, beam = [(0, 0, 0)], [(x, 0, 1) for x in range(4)]
    assert set(stands(Assembly.from_cells({"post": post, "beam": beam}))) == {"beam"}
    assert stands(Assembly.from_cells({"post": [(1, 0, 0), (2, 0, 0)], "beam": beam})) == {}


def test_a_world_is_put_back_exactly() -> None:
    with World(Assembly.from_cells(TOWER)) as world:
        world.remove("c")
        world.settle(60)
        first, there = world.displacement(), tuple(world.there)
        assert world.moved()
        world.restore(world.initial)
        assert world.moved() == {}
        assert len(world.there) == 6
        world.remove("c")
        world.settle(60)
        assert world.displacement() == first
        assert tuple(world.there) == there
        with pytest.raises(UnknownNameError):
            world.remove("c")


def test_masses_and_inertia_are_true_ones() -> None:
    beam = Assembly.from_cells({"beam": [(x, 0, 0) for x in range(3)]})
    (body,) = rigid_bodies(beam, "parts", 1.0)
    assert body.mass == pytest.approx(3)
    # A cuboid 3 x 1 x 1 of mass 3: m (b^2 + c^2) / 12.
    assert sorted(body.inertia) == pytest.approx([0.5, 2.5, 2.5])
    assert body.X_WC[:3, 3] == pytest.approx([1.5, 0.5, 0.5])
    assert np.linalg.det(body.X_WC[:3, :3]) == pytest.approx(1)


def test_convex_parts_settle_and_hollow_meshes_are_refused() -> None:
    import trimesh

    def part(name: str, mesh: trimesh.Trimesh, make: type, z: float) -> Part:
        X = np.eye(4)
        X[2, 3] = z
        return Part(name, (Body(make(np.array(mesh.vertices), np.array(mesh.faces)), np.eye(4)),), X)

    drum = trimesh.creation.cylinder(radius=0.6, height=1.0, sections=24)
    stack = Assembly((part("low", drum, Convex, 0.5), part("high", drum, Mesh, 1.5)))
    assert stands(stack) == {}
    assert set(stands(stack, present=["high"])) == {"high"}
    pipe = trimesh.creation.annulus(0.5, 0.6, 1.0)
    with pytest.raises(InputError, match=r"'pipe'.*convex"):
        stands(Assembly((part("pipe", pipe, Mesh, 0.5),)))


def test_a_part_of_several_convex_pieces_is_one_body() -> None:
    import trimesh

    block = trimesh.creation.box([1, 1, 1])
    shape = Convex(np.array(block.vertices), np.array(block.faces))
    left, right = np.eye(4), np.eye(4)
    left[0, 3], right[0, 3] = -1, 1
    top = Part("top", (Body(shape, left), Body(shape, np.eye(4)), Body(shape, right)), np.eye(4))
    base = np.eye(4)
    base[2, 3] = -1
    assert stands(Assembly((Part("base", (Body(shape, np.eye(4)),), base), top))) == {}


# -- the paper's rule -----------------------------------------------------------------------------------------


def first_collapse(cells: Cells, order: Sequence[str]) -> int:
    """The integer rule: more than one cube stands over an empty or falling place; fallen cubes settle down."""
    columns: dict[tuple[int, int], list[tuple[int, str]]] = {}
    for name, places in cells.items():
        for x, y, z in places:
            columns.setdefault((x, y), []).append((z, name))
    columns = {place: sorted(column) for place, column in columns.items()}
    for i, gone in enumerate(order):
        falling = 0
        for place, column in columns.items():
            left = [(z, name) for z, name in column if name != gone]
            falling += sum(z != level for level, (z, _) in enumerate(left))
            columns[place] = [(level, name) for level, (_, name) in enumerate(left)]
        if falling > 1:
            return i
    return len(order)


def random_stacks(rng: np.random.Generator, pieces: int) -> Cells:
    """A full 3 x 3 x 3 block, cut at random into connected pieces."""
    free = {(x, y, z) for x in range(3) for y in range(3) for z in range(3)}
    owner = {}
    for name in range(pieces):
        owner[sorted(free - set(owner))[rng.integers(len(free) - len(owner))]] = f"p{name}"
    while len(owner) < 27:
        x, y, z = sorted(owner)[rng.integers(len(owner))]
        around = [(x + 1, y, z), (x - 1, y, z), (x, y + 1, z), (x, y - 1, z), (x, y, z + 1), (x, y, z - 1)]
        near = [c for c in around if c in free and c not in owner]
        if near:
            owner[near[rng.integers(len(near))]] = owner[(x, y, z)]
    return {f"p{i}": [cell for cell, name in sorted(owner.items()) if name == f"p{i}"] for i in range(pieces)}


def run(asked: PhysicsOracle, order: Sequence[int]) -> int:
    state = asked.initial
    for i, action in enumerate(order):
        answer = asked.attempt(state, action)
        if isinstance(answer, Rejection):
            assert answer.because
            assert answer.until == ()
            return i
        state = answer.state
    assert asked.is_goal(state)
    return len(order)


@pytest.mark.parametrize(("degrees", "size"), [(0, 1.0), (30, 1.0), (0, 0.05)])
def test_the_cubes_rule_agrees_with_the_integer_rule(degrees: float, size: float) -> None:
    rng = np.random.default_rng(4)
    agreed, expected = 0, []
    for _ in range(7):
        cells = random_stacks(rng, 9)
        names = list(cells)
        assembly = Assembly.from_cells(cells, size).transformed(turned(degrees))
        with PhysicsOracle(Removals(9), assembly, removes=names) as asked:
            for _ in range(3):
                # From the top down, more or less: random orders collapse at once and would ask little.
                height = {name: max(z for *_, z in cells[name]) + rng.random() for name in names}
                order = sorted(names, key=lambda name: -height[name])
                expected.append(first_collapse(cells, order))
                agreed += run(asked, [names.index(n) for n in order]) == expected[-1]
    assert len(set(expected)) >= 5, "the orders ask little"
    assert agreed >= len(expected) - 1, f"{agreed} of {len(expected)} orders fail where the integer rule says"


def test_one_cube_may_fall_two_may_not() -> None:
    with oracle({"low": [(0, 0, 0)], "one": [(0, 0, 1)]}) as asked:
        assert isinstance(asked.attempt(asked.initial, 0), Step)
    with oracle({"low": [(0, 0, 0)], "one": [(0, 0, 1)], "two": [(0, 0, 2)]}) as asked:
        refused = asked.attempt(asked.initial, 0)
        assert isinstance(refused, Rejection)
        assert refused.because == ("one", "two")
        assert refused.reason == "2 cubes moved: of one and two."


@pytest.mark.parametrize("rule", ["cubes", "rigid"])
def test_the_same_history_has_the_same_answer_whatever_was_asked_before(rule: str) -> None:
    cells = random_stacks(np.random.default_rng(1), 5)

    def answers(orders: Sequence[Sequence[int]]) -> dict[tuple[int, ...], object]:
        found: dict[tuple[int, ...], object] = {}
        with oracle(cells, bodies=rule) as asked:
            for order in orders:
                state = asked.initial
                for action in order:
                    answer = asked.attempt(state, action)
                    found[(*state[1], action)] = answer
                    if isinstance(answer, Step):
                        state = answer.state
        return found

    rng = np.random.default_rng(0)
    orders = [rng.permutation(5).tolist() for _ in range(4)]
    forward, backward = answers(orders), answers(orders[::-1])
    assert len(forward) > 6
    assert forward == backward


def test_rigid_parts_leave_along_a_free_line_or_not_at_all() -> None:
    with oracle(BOX_WITH_LID, bodies="rigid") as asked:
        box, core, lid = range(3)
        held = asked.attempt(asked.initial, core)
        assert isinstance(held, Rejection)
        assert set(held.because) == {"box", "lid"}
        assert isinstance(asked.attempt(asked.initial, box), Rejection)
        opened = asked.attempt(asked.initial, lid)
        assert isinstance(opened, Step)
        assert opened.motion.direction == pytest.approx((0, 0, 1))
        assert asked.candidates(opened.state) == [box, core]
        empty = asked.attempt(opened.state, core)
        assert isinstance(empty, Step)
        last = asked.attempt(empty.state, box)
        assert isinstance(last, Step)
        assert asked.is_goal(last.state)


def test_rigid_parts_may_not_bring_down_others() -> None:
    with oracle({"post": [(0, 0, 0)], "beam": [(0, 0, 1), (1, 0, 1)]}, bodies="rigid") as asked:
        refused = asked.attempt(asked.initial, 0)
        assert isinstance(refused, Rejection)
        assert refused.because == ("beam",)
        assert isinstance(asked.attempt(asked.initial, 1), Step)


def test_what_is_absent_at_the_start_is_not_there() -> None:
    assembly = Assembly.from_cells(BOX_WITH_LID)
    with PhysicsOracle(Removals(2), assembly, removes=["box", "core"], bodies="rigid", absent={"lid"}) as asked:
        assert isinstance(asked.attempt(asked.initial, 1), Step)


def test_what_does_not_fit_is_refused() -> None:
    assembly = Assembly.from_cells(TOWER)
    with pytest.raises(InputError, match="got 2"):
        PhysicsOracle(Removals(6), assembly, removes=["a", "b"])
    with pytest.raises(InputError, match="nobody"):
        PhysicsOracle(Removals(1), assembly, removes=["nobody"])
    with pytest.raises(InputError, match="rigid"):
        PhysicsOracle(Removals(6), assembly, removes=list(TOWER), bodies="soft")  # type: ignore[arg-type]
    three = {"low": [(0, 0, 0)], "one": [(0, 0, 1)], "two": [(0, 0, 2)]}
    with oracle(three) as asked, pytest.raises(InputError, match="refused"):
        asked.attempt((0b110, (0,)), 1)
