"""What springs say stands, stands: by hand, under changes that change nothing, and against simulation."""

from __future__ import annotations

import functools
from dataclasses import fields, replace

import numpy as np
import pytest
from mujoco_referee import settled
from scipy.spatial.transform import Rotation
from structures import CASES, Case, assembly, between_walls, box, card_house, harmonic_stack, hull, plug, prism

import neurosym as ns
from neurosym.geometry.assembly import NO_TABLE
from neurosym.geometry.contact.contacts import Contact
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.shapes import Body, Box, Part
from neurosym.geometry.stability.contact_springs import contact_springs
from neurosym.geometry.stability.of_assembly import spring_stability as with_contacts
from neurosym.geometry.stability.patches import groups
from neurosym.geometry.stability.settling import settle
from neurosym.geometry.stability.spring_loads import drag, margin, standing_while_pulled
from neurosym.geometry.stability.spring_stability import SpringStability
from neurosym.geometry.stability.springs import DEFAULT_NUMBERS, DOWN
from neurosym.geometry.tolerances import Tolerances
from neurosym.simulation.world import stands as simulated


def everything(world: ns.Assembly) -> int:
    return (1 << len(world)) - 1


def spring_stability(world: ns.Assembly, **options) -> SpringStability:
    return with_contacts(world, AssemblyGeometry(world).contacts, **options)


@functools.cache
def built(case: Case) -> ns.Assembly:
    return case.make()


def stands(world: ns.Assembly, **options) -> bool:
    return spring_stability(world, **options).standing(everything(world)).stands


def soma(number: int) -> ns.Assembly:
    return ns.load_domain("soma").problem(number, collapse="rigid").world


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_known_structures(case):
    world = built(case)
    stability = spring_stability(world)
    answer = stability.standing(everything(world))
    assert answer.stands is case.stands
    assert bool(stability.movements(everything(world))) is not case.stands
    # Springs alone say what the shorter proofs said.
    assert stability.settled(everything(world)).stands is case.stands


def test_limit_analysis_balances_what_springs_let_fall():
    for world in (between_walls(0.5), plug(10, 0.5)):
        stability = spring_stability(world)
        answer = stability.standing(everything(world))
        assert not answer.stands
        assert answer.balanced
        assert not answer.promises
        assert stability.limit.standing(everything(world)).stands
    overhanging = spring_stability(harmonic_stack(1.2)).standing((1 << 10) - 1)
    assert overhanging.promises


@pytest.mark.parametrize("name", [f.name for f in fields(DEFAULT_NUMBERS)])
@pytest.mark.parametrize("factor", [0.5, 2.0])
def test_verdicts_do_not_hang_on_the_numbers(name, factor):
    value = getattr(DEFAULT_NUMBERS, name) * factor
    numbers = replace(DEFAULT_NUMBERS, **{name: max(1, int(value)) if name == "patience" else value})
    for case in CASES:
        world = built(case)
        assert spring_stability(world, numbers=numbers).settled(everything(world)).stands is case.stands, case.name
    rng = np.random.default_rng(5)
    for number in (3, 50, 120):
        usual, changed = spring_stability(soma(number)), spring_stability(soma(number), numbers=numbers)
        for subset in rng.integers(1, 128, 8).tolist():
            assert usual.settled(subset).stands is changed.settled(subset).stands


# -- what changes nothing ---------------------------------------------------------------------------------------


SAMPLE = [case for case in CASES if case.name in {
    "plug, narrowing by 3, 0.1", "plug, widening by 5", "arch of three", "card house, 0.95", "card house, 1.05",
    "harmonic stack, 0.95", "harmonic stack, 1.05", "book-end", "book-end in two", "wedged beam, -3, 0.5",
}]  # fmt: skip


def rebuilt(world: ns.Assembly, scale: float = 1.0, density: float = 1.0, order=None) -> ns.Assembly:
    """The parts in another order, scaled about the origin, of other density."""
    parts = []
    for part in world.parts:
        bodies = tuple(Body(_scaled(b.shape, scale), _moved(b.X_PB, scale)) for b in part.bodies)
        parts.append(Part(part.name, bodies, _moved(part.X_WP, scale), part.density * density))
    order = range(len(parts)) if order is None else order
    return ns.Assembly(tuple(parts[k] for k in order), friction=world.friction, fixed=world.fixed)


def _moved(X, scale):
    X = X.copy()
    X[:3, 3] *= scale
    return X


def _scaled(shape, scale):
    if isinstance(shape, Box):
        return Box(shape.size * scale)
    return type(shape)(shape.vertices * scale, shape.faces)


@pytest.mark.parametrize("case", SAMPLE, ids=lambda c: c.name)
def test_verdicts_do_not_depend_on_frame_units_order_or_mass(case):
    world = built(case)
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", 37.0, degrees=True).as_matrix()
    X[:3, 3] = 3.0, -2.0, 5.0
    order = np.random.default_rng(1).permutation(len(world))
    others = [world.transformed(X), rebuilt(world, order=order), rebuilt(world, density=10.0)]
    others += [rebuilt(world, scale=s, density=d) for s, d in ((1e-6, 1.0), (1e6, 1e-6), (1.0, 1e6), (1e-3, 1e-12))]
    for other in others:
        assert stands(other) is case.stands


def test_a_subset_of_soma_is_judged_alike_when_turned():
    X = np.eye(4)
    X[:3, :3] = Rotation.from_euler("z", 30.0, degrees=True).as_matrix()
    rng = np.random.default_rng(2)
    for number in (0, 17, 101):
        still, turned = spring_stability(soma(number)), spring_stability(soma(number).transformed(X))
        for subset in rng.integers(1, 128, 12).tolist():
            assert still.standing(subset).stands is turned.standing(subset).stands


def test_a_patch_in_two_halves_is_one():
    whole = {"base": [(x, 0, 0) for x in range(4)], "top": [(x, 0, 1) for x in (1, 2, 3, 4, 5)]}
    for length in (5, 6):
        cells = {**whole, "top": [(x, 0, 1) for x in range(1, 1 + length)]}
        one = assembly({"base": box((0, 0, 0), (4, 1, 1)), "top": box((1, 0, 1), (1 + length, 1, 2))})
        many = ns.Assembly.from_cells(cells)
        assert stands(one) is stands(many)
        a, b = spring_stability(one).settled(0b11), spring_stability(many).settled(0b11)
        np.testing.assert_allclose(a.share.max(), b.share.max(), rtol=1e-6)


def test_a_corner_told_twice_is_one():
    corners = np.array([[0.0, 0, 1], [1, 0, 1], [1, 2, 1], [0, 2, 1]])
    up = np.array([0.0, 0, 1])
    for twice in range(4):
        points = np.insert(corners, twice, corners[twice], axis=0)
        patch = Contact(0, 1, points, up, 2.0)
        springs = contact_springs([patch], np.ones(2), np.array([[0.5, 1, 0.5], [0.5, 1, 1.5]]), friction=0.5)
        for corner in corners:
            assert springs.across[(springs.at == corner).all(axis=1)].sum() == pytest.approx(0.25)


def test_tiny_parts_do_not_float():
    tiny = 1e-3
    base = box((0, 0, 0), (1, 1, 1))
    for corner, rests in (((0.5, 0.5, 1.0), True), ((0.5, 0.5, 1.5), False), ((1.0, 0.5, 0.5), False)):
        chip = box(corner, np.array(corner) + tiny)
        world = ns.Assembly.from_meshes({"base": base, "chip": chip, "far": box((5, 0, 0), (15, 10, 10))})
        assert stands(world) is rests
        assert spring_stability(world).settled(0b111).stands is rests


def test_a_thin_plate_bears_a_heavy_block():
    parts = {"plate": box((0, 0, 0), (1, 1, 1e-3)), "block": box((0.1, 0.1, 1e-3), (0.9, 0.9, 20))}
    assert stands(assembly(parts))


def test_nothing_falls_without_gravity():
    cells = {"ring": [(0, 0, 0), (1, 0, 0), (2, 0, 0), (2, 0, 1), (2, 0, 2), (1, 0, 2), (0, 0, 2), (0, 0, 1)]}
    cells["through"] = [(1, -1, 1), (1, 0, 1), (1, 1, 1)]
    world = ns.Assembly.from_cells(cells, table=NO_TABLE)
    assert stands(world, gravity=np.zeros(3))
    answer = spring_stability(world).standing(0b11)
    assert (answer.stands, answer.promises) == (False, True)


# -- the shorter proofs, groups, holding --------------------------------------------------------------------------


def wall(length: int, height: int) -> ns.Assembly:
    """Bricks of two cells in running bond."""
    cells = {f"{z}-{x}": [(2 * x + z % 2 + i, 0, z) for i in (0, 1)] for z in range(height) for x in range(length)}
    return ns.Assembly.from_cells(cells)


def test_proofs_say_what_springs_say():
    world = wall(6, 6)
    stability = spring_stability(world)
    rng = np.random.default_rng(3)
    for _ in range(60):
        gone = rng.choice(len(world), int(rng.integers(1, 5)), replace=False)
        subset = everything(world) & ~sum(1 << int(k) for k in gone)
        assert stability.standing(subset).stands is stability.settled(subset).stands
    assert all(stability.asked.values()), stability.asked


def test_groups_are_judged_by_themselves():
    cells = {f"{k}-{z}": [(3 * k, 0, z)] for k in range(6) for z in range(3)}
    world = ns.Assembly.from_cells(cells)
    stability = spring_stability(world)
    assert len(groups(everything(world), stability.touching)) == 6
    floating = everything(world) & ~world.mask(["2-0"])
    assert stability.standing(floating).moving == world.mask(["2-1"])
    assert stability.standing(floating & ~world.mask(["2-1", "2-2", "0-2"])).stands


def test_what_falls_is_held():
    world = ns.Assembly.from_cells({"base": [(0, 0, 0)], "arm": [(0, 0, 1), (1, 0, 1), (2, 0, 1)]})
    stability = spring_stability(world)
    answer = stability.standing_when_held(0b11, 1)
    assert (answer.stands, answer.held) == (True, world.mask(["arm"]))
    assert not stability.standing_when_held(0b11, 0).stands
    walls = spring_stability(between_walls(0.5))
    assert walls.standing_when_held(0b111, 1).held == 0b001


# -- play -------------------------------------------------------------------------------------------------------


def touching_within(world: ns.Assembly, gap: float) -> ns.Assembly:
    return replace(world, tolerances=Tolerances(touch=gap / world.smallest_extent))


def test_what_drops_by_its_play_rests():
    gap = 0.05
    walls = {"left": box((-2, 0, 0), (-1, 1, 3)), "right": box((1 + gap, 0, 0), (2, 1, 3))}
    for floor, rests in ((True, True), (False, False)):
        parts = {"block": box((-1 + gap, 0, 1 + gap), (1, 1, 2)), **walls}
        if floor:
            parts["floor"] = box((-1, 0, 0), (1, 1, 1))
        world = assembly(parts, tuple(walls) + (("floor",) if floor else ()))
        assert not stands(world)
        assert stands(touching_within(world, 2 * gap)) is rests


def test_a_wedge_sinks_into_its_play():
    slope = 0.2
    beam = prism([(-3.2, 3), (3.2, 3), (3, 2), (-3, 2)])
    for gap in (0.01, 0.05):
        right = [(3.2 + slope + gap, 4), (2.6 + gap, 0), (8, 0), (8, 4)]
        parts = {"beam": beam, "right": prism(right), "left": prism([(-x, z) for x, z in right])}
        for friction in (0.0, 0.5):
            world = assembly(parts, ("left", "right"), friction)
            assert not stands(world)
            assert stands(touching_within(world, 2 * gap))
    assert not stands(touching_within(plug(5, 0.5), 0.1))


# -- evidence, margin, loads ------------------------------------------------------------------------------------


def test_what_moves_says_how():
    drop = spring_stability(ns.Assembly.from_cells({"base": [(0, 0, 0)], "up": [(0, 0, 1)], "top": [(0, 0, 2)]}))
    (movement,) = drop.movements(0b101)
    assert (movement.kind, movement.part, movement.lost) == ("dropping", 2, 0b010)
    np.testing.assert_allclose(movement.direction, DOWN, atol=1e-6)
    assert movement.sentence(("base", "up", "top")) == "top drops along (0, 0, -1), without up."

    ramp = {"ramp": prism([(0, 0), (4, 0), (0, 4)]), "block": prism([(1, 3), (2, 2), (3, 3), (2, 4)])}
    (movement,) = spring_stability(assembly(ramp, ("ramp",))).movements(0b11)
    assert movement.kind == "sliding"
    np.testing.assert_allclose(movement.direction, np.array([1, 0, -1]) / np.sqrt(2), atol=1e-3)

    arm = spring_stability(ns.Assembly.from_cells({"base": [(0, 0, 0)], "arm": [(0, 0, 1), (1, 0, 1), (2, 0, 1)]}))
    (movement,) = arm.movements(0b11)
    assert movement.kind == "tilting"
    np.testing.assert_allclose(movement.direction, [0, 1, 0], atol=1e-3)


def test_contact_forces_carry_the_weight_and_say_how_near_they_are_to_slipping():
    world = card_house(1.05)
    stability = spring_stability(world)
    forces = stability.forces(0b11)
    for part in (0, 1):
        on = forces.forces[forces.a == part].sum(axis=0) - forces.forces[forces.b == part].sum(axis=0)
        np.testing.assert_allclose(on, [0, 0, stability.masses[part]], atol=2e-2 * stability.masses[part])
    table = forces.b == -1
    assert forces.slipping[table].max() > 0.9
    assert forces.slipping.max() <= 1.0
    loose = spring_stability(card_house(2.0)).forces(0b11)
    assert loose.slipping[loose.b == -1].max() < 0.75


HALF = float(np.degrees(np.arctan(0.5)))


@pytest.mark.parametrize(("friction", "high", "angle"), [(0.5, 1, HALF), (2.0, 1, 45.0), (2.0, 2, HALF), (0.0, 1, 0.0)])
def test_margin_is_the_tilt_that_a_block_bears(friction, high, angle):
    world = assembly({"block": box((0, 0, 0), (1, 1, high))}, (), friction)
    assert margin(spring_stability(world), 0b1) == pytest.approx(angle, abs=0.4)
    assert margin(spring_stability(between_walls(0.5)), 0b111) == 0.0


def test_a_pull_drags_what_lies_on_the_part():
    cells = {"low": [(0, 0, 0), (1, 0, 0)], "top": [(0, 0, 1), (1, 0, 1)]}
    loose = spring_stability(ns.Assembly.from_cells(cells))
    assert not standing_while_pulled(loose, 0b11, 0b01, np.array([1.0, 0, 0])).stands
    assert standing_while_pulled(loose, 0b11, 0b10, np.array([1.0, 0, 0])).stands
    loads = drag(loose, 0b11, 0b01, np.array([1.0, 0, 0]))
    np.testing.assert_allclose(loads[1][:3], [1.0, 0, 0], atol=1e-2)  # mu = 0.5 times a weight of 2
    stopped = ns.Assembly.from_cells({**cells, "stop": [(2, 0, 1), (2, 0, 0), (2, 1, 0), (2, 1, 1)]}).with_fixed(
        ["stop"]
    )
    assert standing_while_pulled(spring_stability(stopped), 0b111, 0b001, np.array([0.0, -1, 0])).stands is False
    assert standing_while_pulled(spring_stability(stopped), 0b111, 0b001, np.array([1.0, 0, 0])).stands


def test_a_load_moves_a_block_beyond_its_friction():
    stability = spring_stability(ns.Assembly.from_cells({"block": [(0, 0, 0)]}))
    for push, stays in ((0.49, True), (0.51, False)):
        load = {0: np.array([0, push, 0, 0, 0, 0])}
        low = {0: np.array([0, push, 0, -push / 2, 0, 0])}  # at the foot: nothing tilts
        assert stability.settled(0b1, loads=low).stands is stays
        assert stability.settled(0b1, loads=load).stands is stays
    assert not stability.settled(0b1, loads={0: np.array([0, 0, 0, 0.51, 0, 0])}).stands


# -- light beside heavy -------------------------------------------------------------------------------------------

#: Structures whose last part may weigh anything: what stands, stands, and what falls, falls.
UNEQUAL = {
    "on top": ({"a": box((0, 0, 0), (1, 1, 1)), "b": box((0, 0, 1), (1, 1, 2))}, True),
    "in mid-air": ({"a": box((0, 0, 0), (1, 1, 1)), "b": box((2, 0, 0.3), (2.3, 0.3, 0.6))}, False),
    "at a side": ({"a": box((0, 0, 0), (1, 1, 1)), "b": box((1, 0, 0.25), (2, 1, 0.75))}, False),
    "overhanging": ({"a": box((0, 0, 0), (1, 1, 1)), "b": box((0.6, 0, 1), (1.6, 1, 2))}, False),
    "a bridge": (
        {"a": box((0, 0, 0), (1, 1, 1)), "c": box((3, 0, 0), (4, 1, 1)), "b": box((0, 0, 1), (4, 1, 1.2))},
        True,
    ),
    "between free blocks": (
        {"a": box((0, 0, 0), (1, 1, 1)), "c": box((2, 0, 0), (3, 1, 1)), "b": box((1, 0, 0.4), (2, 1, 0.8))},
        False,
    ),
    "on a plank and its weight": (
        {
            "a": box((0, 0, 0), (1, 1, 1)),
            "plank": box((-0.2, 0, 1), (1.8, 1, 1.2)),
            "c": box((0, 0, 1.2), (0.5, 1, 2.2)),
            "b": box((0.5, 0, 1.2), (0.8, 1, 1.5)),
        },
        True,
    ),
}


@pytest.mark.parametrize("rule", ["springs", "limit"])
@pytest.mark.parametrize("name", UNEQUAL)
def test_what_stands_does_not_depend_on_the_lightest_part(name, rule):
    parts, stands = UNEQUAL[name]
    world = assembly(parts)
    if rule == "limit" and name == "between free blocks":
        stands = True  # forces that nothing presses could hold it
    for exponent in range(-14, 15, 2):
        last = replace(world.parts[-1], density=10.0**exponent)
        geometry = AssemblyGeometry(ns.Assembly((*world.parts[:-1], last)), rule=rule)
        verdict = geometry.stability.standing(everything(world)).stands
        if name == "between free blocks" and rule == "limit" and exponent > 0:
            continue  # what could hold a light block tips over beside a heavy one
        assert verdict is stands, f"{name}, {rule}: density 1e{exponent}"


def test_a_weight_holds_a_plank_from_one_ratio_on():
    parts = {
        "a": box((0, 0, 0), (1, 1, 1)),
        "plank": box((-0.2, 0, 1), (2.6, 1, 1.2)),
        "weight": box((0.1, 0, 1.2), (0.4, 1, 1.7)),
    }
    # The plank weighs .56, .2 beyond the edge; the weight .15 of its density, .75 on this side of it.
    for rule in ("springs", "limit"):
        for density in (1e-12, 1e-6, 0.1, 10.0, 1e6, 1e12):
            world = assembly(parts)
            heavier = ns.Assembly((*world.parts[:-1], replace(world.parts[-1], density=density)))
            for factor in (1e-12, 1.0, 1e12):
                geometry = AssemblyGeometry(rebuilt(heavier, density=factor), rule=rule)
                assert geometry.stability.standing(0b111).stands is (density > 1), (rule, density, factor)


@pytest.mark.parametrize("size", [0.1, 1e-2, 2e-4, 1e-4, 1e-6])
@pytest.mark.parametrize("stability", ["springs", "limit"])
def test_a_speck_does_not_float(size, stability):
    world = assembly(
        {"big": box((-0.5, -0.5, 0), (0.5, 0.5, 1)), "small": box((2, 0, 0.3), (2 + size, size, 0.3 + size))}
    )
    result = ns.solve(ns.load_domain("assembly").problem(world, stability=stability))
    assert result.status is ns.Status.UNSOLVABLE


# -- against simulation -------------------------------------------------------------------------------------------


def test_simulation_agrees():
    rng = np.random.default_rng(11)
    alike = 0
    for _ in range(16):
        world = soma(int(rng.integers(240)))
        subset = everything(world) & ~sum(1 << int(k) for k in rng.choice(7, int(rng.integers(1, 6)), replace=False))
        alike += stands_in(spring_stability(world), subset) is (not simulated(world, present=world.in_mask(subset)))
    assert alike >= 15


def test_a_second_simulation_agrees():
    rng, alike = np.random.default_rng(12), 0
    for _ in range(12):
        world = soma(int(rng.integers(240)))
        subset = everything(world) & ~sum(1 << int(k) for k in rng.choice(7, int(rng.integers(1, 6)), replace=False))
        moved = max(settled(world, world.in_mask(subset)).values())
        alike += stands_in(spring_stability(world), subset) is (moved < 0.2)
    assert alike >= 11


def stands_in(stability: SpringStability, subset: int) -> bool:
    return stability.standing(subset).stands


def test_settling_nothing_is_no_fault():
    springs = spring_stability(between_walls(0.5)).springs
    none = np.zeros(0, dtype=np.int64)
    assert settle(springs, none, none, springs.gravity(DOWN)).stands


def test_convex_hulls_of_tests_are_closed():
    points, faces = hull(np.random.default_rng(0).normal(size=(12, 3)))
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert len(points) == 12
