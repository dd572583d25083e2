"""Any assembly: one part at a time, in groups, along paths, under gravity, held; and why there is no plan."""

from __future__ import annotations

import dataclasses
import itertools
import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import neurosym as ns
from neurosym.geometry.shapes import Body, Mesh, Part
from neurosym.geometry.step_motion import StepMotion
from neurosym.testing.domains import check_problem

family = ns.load_domain("assembly")
Assembly = ns.Assembly
SOLVED, UNSOLVABLE, GAVE_UP = ns.Status.SOLVED, ns.Status.UNSOLVABLE, ns.Status.GAVE_UP
SHARED = Path(__file__).parents[1] / ".." / "shared" / "data"
slow_geometry = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])


def box(x, y, z):
    return list(itertools.product(range(*x), range(*y), range(*z)))


def without(cells, *gone):
    return [c for c in cells if c not in gone]


def straight_line_burr():
    """A rail in a dovetail groove, and a pin through both: the pin up or down, then the rail along x, no other way."""
    groove = {(y, z) for y in (1, 2, 3) for z in (1,)} | {(2, 2)}
    pin = box((2, 3), (2, 3), (0, 3))
    slide = [c for c in box((0, 5), (0, 5), (0, 3)) if c[1:] not in groove and c not in pin]
    rail = [c for c in box((0, 5), (0, 5), (0, 3)) if c[1:] in groove and c not in pin]
    return {"slide": slide, "rail": rail, "pin": pin}


STRAIGHT = straight_line_burr()


def tee(z0):
    """Two halves joined by a dovetail along y: nothing but a slide along y takes them apart."""
    tail = {(2, z) for z in (1, 2, 3)} | {(3, 2)}
    first = [(x, y, z + z0) for x, y, z in box((0, 4), (0, 3), (0, 5)) if (x, z) not in tail]
    return first, [(x, y, z + z0) for x, y, z in box((2, 7), (0, 3), (0, 5)) if x >= 4 or (x, z) in tail]


def pairs():
    """Two dovetailed pairs, pegged one on the other along z: no part is free, a pair is."""
    (a, b), (c, d) = tee(0), tee(5)
    return {
        "a": [*a, (1, 1, 5)],
        "b": [*b, (5, 1, 5)],
        "c": without(c, (1, 1, 5)),
        "d": without(d, (5, 1, 5)),
    }


PAIRS = pairs()

#: Two links of a chain.
LINKS = {
    "ring": [c for c in box((0, 5), (0, 5), (2, 3)) if c[0] in (0, 4) or c[1] in (0, 4)],
    "link": [c for c in box((2, 3), (2, 7), (0, 5)) if c[1] in (2, 6) or c[2] in (0, 4)],
}

#: A ball in a bent tunnel: along x, then up. Two moves.
BENT = {"frame": without(box((0, 5), (0, 3), (0, 4)), (1, 1, 1), (2, 1, 1), (3, 1, 1), (3, 1, 2), (3, 1, 3)),
        "ball": [(1, 1, 1)]}  # fmt: skip

GATE = {
    "post 0": box((0, 1), (0, 1), (0, 2)),
    "post 1": box((4, 5), (0, 1), (0, 2)),
    "beam": box((0, 5), (0, 1), (2, 3)),
}


def made(cells, **options):
    return family.problem(Assembly.from_cells(cells), **options)


def solved(cells, **options):
    result = ns.solve(made(cells, **options))
    assert result.status is SOLVED, (result.status, result.why_not)
    return result


def as_meshes(assembly):
    """The same parts, each one triangle mesh, so that no box is left."""
    parts = []
    for i, part in enumerate(assembly.parts):
        mesh = outer(assembly, i)
        parts.append(Part(part.name, (Body(Mesh(mesh.vertices.copy(), mesh.faces.copy()), np.eye(4)),), np.eye(4)))
    return dataclasses.replace(assembly, parts=tuple(parts))


def outer(assembly, part):
    """The surface of a part of unit cells as a closed mesh."""
    corners = [X[:3, 3] - 0.5 for X, o in zip(assembly.X_WB, assembly.owners) if o == part]
    cells = {tuple(int(v) for v in np.round(c)) for c in corners}
    quads = []
    for cell in cells:
        for axis, side in itertools.product(range(3), (0, 1)):
            step = np.eye(3, dtype=int)[axis] * (1 if side else -1)
            if tuple(int(v) for v in np.array(cell) + step) in cells:
                continue
            u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
            start = np.array(cell) + side * np.eye(3)[axis]
            quad = [start, start + u, start + u + v, start + v]
            quads.append(quad if side else quad[::-1])
    vertices = np.array(quads, dtype=float).reshape(-1, 3)
    faces = np.array([[4 * k + i for i in f] for k in range(len(quads)) for f in ((0, 1, 2), (0, 2, 3))])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices()
    return mesh


# -- samples, planners, priors ----------------------------------------------------------------------------------


@pytest.mark.parametrize("number", family.numbers("all"))
@pytest.mark.parametrize("options", [{}, {"groups": True}, {"gravity": False}, {"held": 1}], ids=str)
def test_samples_come_apart_and_keep_their_promises(number, options):
    problem = family.problem(number, **options)
    if number in (1, 4) or options.get("gravity") is False:  # those with fewest parts: each walk replays from the start
        check_problem(problem, walks=2, rng=np.random.default_rng(number))
    result = ns.solve(problem)
    assert result.solved
    parts = len(problem.world)
    assert len(result.plan) == (parts - 1 if options.get("groups") else parts)


@pytest.mark.parametrize("planner", ns.planner_names())
@pytest.mark.parametrize("prior", [None, "uniform", "random", "outermost-first"])
def test_every_planner_and_every_prior_works(planner, prior):
    for groups in (False, True):
        problem = family.problem(1, groups=groups)
        result = ns.solve(problem, planner=planner, prior=prior)
        assert result.solved or planner == "swap-repair"
        if result.solved:
            assert ns.validate(problem, result.plan)
            assert ns.validate(problem, result.plan, result.motions)


def test_outermost_first_makes_no_mistake_on_a_wall():
    cells = {
        f"{row} {k}": box((2 * k + row % 2, 2 * k + row % 2 + 2), (0, 2), (row, row + 1))
        for row in range(5)
        for k in range(6 - row % 2)
    }
    result = ns.solve(made(cells), prior="outermost-first")
    assert (result.solved, result.iterations) == (True, 0)
    with pytest.raises(ns.InputError, match="outermost-first"):
        ns.solve(ns.load_domain("scrabble").problem(0), prior="outermost-first")


def test_a_plan_backwards_puts_together():
    result = solved(STRAIGHT, gravity=False, fixed=["slide"])
    assert result.plan == ("pin", "rail")
    back = result.reversed()
    assert back == result.plan.reversed() == ("rail", "pin")
    assert [motion.arrives for motion in back.motions] == [True, True]
    out, back_in = result.motions[0], back.motions[1]
    assert np.allclose(back_in.direction, np.negative(out.direction))
    assert back.reversed() == result.plan
    assert back.reversed().motions == result.motions
    with pytest.raises(ns.InputError, match="with a plan"):
        ns.solve(made(LINKS, gravity=False)).reversed()


# -- burrs with known answers -----------------------------------------------------------------------------------


def test_a_straight_line_burr_has_one_order():
    problem = made(STRAIGHT, gravity=False, fixed=["slide"])
    assert list(ns.load_planner("exhaustive").all_plans(problem.ground())) == [("pin", "rail")]
    first, second = ns.solve(problem).motions
    assert abs(first.direction[2]) == 1
    assert abs(second.direction[0]) == 1


@pytest.mark.parametrize("gravity", [False, True])
def test_two_pairs_come_apart_in_groups_only(gravity):
    alone = ns.solve(made(PAIRS, gravity=gravity))
    assert alone.status is UNSOLVABLE
    assert len(alone.why_not.cycle.parts) == 2
    together = solved(PAIRS, gravity=gravity, groups=True)
    assert len(together.plan) == len(PAIRS) - 1
    assert set(together.motions[0].parts) in ({"a", "b"}, {"c", "d"})
    assert ns.validate(made(PAIRS, gravity=gravity, groups=True), together.plan)
    fixed = solved(PAIRS, gravity=gravity, groups=True, fixed=["a"])
    assert len(fixed.plan) == 3
    assert set(fixed.motions[0].parts) == {"c", "d"}


@pytest.mark.parametrize("gravity", [False, True])
def test_the_anchor_may_leave_what_stays(gravity):
    """A hood over a block: the hood goes up, though it is the anchor and the block is what the action names."""
    hood = {"hood": without(box((0, 3), (0, 3), (0, 3)), (1, 1, 0), (1, 1, 1)), "core": [(1, 1, 0), (1, 1, 1)]}
    problem = made(hood, groups=True, directions="+z", gravity=gravity)
    assert problem.details["anchor"] == ["hood"]
    result = ns.solve(problem)
    assert (result.plan, result.motions[0].parts) == (("core",), ("hood",))
    assert ns.validate(problem, result.plan)
    assert ns.solve(made(hood, groups=True, directions="+z", gravity=gravity, fixed=["hood"])).status is UNSOLVABLE


def test_a_group_takes_along_what_would_fall():
    """Without a post the beam would fall, so it goes with the post."""
    problem = made(GATE, groups=True, before=[("post 0", "beam")], fixed=["post 1"])
    result = ns.solve(problem)
    assert result.solved
    assert set(result.motions[0].parts) == {"post 0", "beam"}
    assert ns.validate(problem, result.plan, result.motions)


def test_a_ball_in_a_bent_tunnel_takes_two_moves():
    for options in ({}, {"groups": True}):
        assert ns.solve(made(BENT, gravity=False, **options)).status is UNSOLVABLE
        problem = made(BENT, gravity=False, paths="any", **options)
        result = ns.solve(problem)
        assert result.solved
        assert (result.motions[0].moves, result.motions[0].kind) == (2, "moves")
        assert ns.validate(problem, result.plan, result.motions)
        check_problem(problem, walks=1)
        again = StepMotion.from_json(json.loads(json.dumps(result.motions[0].to_json())))
        assert ns.validate(problem, result.plan, (again, *result.motions[1:]))
    standing = solved(BENT, paths="any")
    assert standing.motions[0].kind == "lattice"
    assert np.shape(standing.motions[0].to_json()["how"])[1:] == (4, 4)


@pytest.mark.parametrize("options", [{}, {"groups": True}, {"paths": "any"}, {"paths": "any", "groups": True}], ids=str)
def test_a_chain_never_comes_apart_and_its_cycle_is_named(options):
    result = ns.solve(made(LINKS, gravity=False, **options))
    assert result.status is UNSOLVABLE
    assert set(result.why_not.cycle.parts) == {"ring", "link"}
    assert {b.by for b in result.why_not.blocked if b.part == "link"} == {("ring",)}
    assert any("smallest interlocked cycle" in said for said in result.why_not.sentences)
    assert json.loads(json.dumps(result.why_not.as_json()))["left"] == ["ring", "link"]


def test_loose_parts_beside_a_chain_do_not_make_the_proof_long():
    cells = LINKS | {f"stone {k}": [(10 + 2 * k, 0, 0)] for k in range(60)}
    for options in ({"gravity": False}, {"gravity": False, "groups": True}, {"groups": True}, {}):
        result = ns.solve(made(cells, **options), budget=ns.Budget(seconds=20))
        assert result.status is UNSOLVABLE, options
        assert set(result.why_not.cycle.parts) == {"ring", "link"}


def test_a_search_that_proves_nothing_gives_up(monkeypatch):
    monkeypatch.setattr("domains.assembly_paths.MAX_CHECKS", 300)
    torus = trimesh.creation.torus(2.0, 0.4, major_sections=12, minor_sections=6)
    other = torus.copy()
    other.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, (1, 0, 0)))
    other.apply_translation((2.0, 0, 0))
    links = Assembly.from_meshes({"one": torus, "two": other})
    assert ns.solve(family.problem(links, gravity=False)).status is UNSOLVABLE
    for groups in (False, True):
        result = ns.solve(family.problem(links, gravity=False, paths="any", groups=groups))
        assert result.status is GAVE_UP
        assert "proves nothing" in " ".join(result.why_not.sentences)


# -- against brute force ----------------------------------------------------------------------------------------


@st.composite
def small_assemblies(draw, most=5):
    """Up to `most` connected parts that fill a 3 x 3 x 2 block, or nearly."""
    count = draw(st.integers(2, most))
    cells = box((0, 3), (0, 3), (0, 2))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    seeds = [cells[i] for i in rng.choice(len(cells), count, replace=False)]
    parts = {f"p{k}": [seed] for k, seed in enumerate(seeds)}
    free = [c for c in cells if c not in seeds]
    while free:
        near = [
            (name, c)
            for c in free
            for name, own in parts.items()
            if any(sum(abs(u - v) for u, v in zip(c, o)) == 1 for o in own)
        ]
        name, cell = near[int(rng.integers(len(near)))]
        if rng.random() < 0.9:
            parts[name].append(cell)
        free.remove(cell)
        if not any(sum(abs(u - v) for u, v in zip(c, o)) == 1 for c in free for own in parts.values() for o in own):
            break
    return parts


def hits(one, others, axis, sign):
    """Whether cells, going along an axis without end, meet others."""
    lines = {}
    for c in others:
        lines.setdefault((*c[:axis], *c[axis + 1 :]), []).append(c[axis])
    return any(
        sign * (other - c[axis]) > 0 for c in one for other in lines.get((*c[:axis], *c[axis + 1 :]), [])
    )


def leaves(parts, group, rest):
    moving = [c for n in group for c in parts[n]]
    staying = [c for n in rest for c in parts[n]]
    return any(not hits(moving, staying, axis, sign) for axis in range(3) for sign in (1, -1))


def comes_apart_alone(parts):
    left = set(parts)
    while len(left) > 1:
        free = next((n for n in sorted(left) if leaves(parts, [n], left - {n})), None)
        if free is None:
            return False
        left.remove(free)
    return True


def comes_apart_in_groups(parts, block=None):
    block = sorted(parts) if block is None else sorted(block)
    if len(block) < 2:
        return True
    for size in range(1, len(block) // 2 + 1):
        for group in itertools.combinations(block, size):
            rest = set(block) - set(group)
            if leaves(parts, group, rest):
                return comes_apart_in_groups(parts, group) and comes_apart_in_groups(parts, rest)
    return False


@given(small_assemblies())
@settings(max_examples=60, deadline=None)
def test_verdicts_agree_with_brute_force_over_orders_and_groups(parts):
    alone = ns.solve(made(parts, gravity=False))
    assert alone.solved is comes_apart_alone(parts)
    problem = made(parts, gravity=False, groups=True)
    grouped = ns.solve(problem)
    assert grouped.solved is comes_apart_in_groups(parts)
    assert grouped.status is (SOLVED if grouped.solved else UNSOLVABLE)
    if grouped.solved:
        assert len(grouped.plan) == len(parts) - 1
        assert grouped.iterations == 0 or ns.validate(problem, grouped.plan)


@given(small_assemblies(most=4), st.booleans())
@slow_geometry
def test_no_split_is_a_mistake_without_gravity(parts, fixed):
    """Whatever is split first, a planner that never goes back succeeds wherever there is a plan."""
    problem = made(parts, gravity=False, groups=True, fixed=["p0"] if fixed else [])
    search = problem.ground()
    rng = np.random.default_rng(0)
    ends = set()
    for _ in range(4):
        state = search.initial
        while not search.is_goal(state):
            steps = [s for a in search.candidates(state) if isinstance(s := search.attempt(state, a), ns.Step)]
            if not steps:
                break
            state = steps[int(rng.integers(len(steps)))].state
        ends.add(search.is_goal(state))
    assert len(ends) == 1
    assert ends == {ns.solve(problem).solved}


@given(small_assemblies(most=4), st.integers(0, 1))
@slow_geometry
def test_orders_under_gravity_agree_with_all_permutations(parts, held):
    problem = made(parts, held=held)
    world = problem.world
    graph, stability = problem.geometry.blocking(), problem.geometry.stability

    def works(order):
        there = (1 << len(world)) - 1
        if not stability.standing_when_held(there, held).stands:
            return False
        for name in order:
            number = world.index[name]
            if not graph.free_directions(number, there):
                return False
            there &= ~(1 << number)
            if not stability.standing_when_held(there, held).stands:
                return False
        return True

    assert ns.count_plans(problem) == sum(map(works, itertools.permutations(parts)))


# -- invariance -------------------------------------------------------------------------------------------------


def verdicts(assembly, **options):
    """What is said of an assembly: the outcome, the number of orders, and what can be done first, part by part."""
    problem = family.problem(assembly, **options)
    search = problem.ground()
    answers = {search.actions[a]: search.attempt(search.initial, a) for a in search.candidates(search.initial)}
    first = {name: isinstance(answer, ns.Step) for name, answer in answers.items()}
    return ns.solve(problem).status, ns.count_plans(problem), first


def turned(assembly, rotation, shift, scale=1.0):
    parts = []
    for part in assembly.parts:
        X = part.X_WP.copy()
        X[:3, 3] *= scale
        bodies = []
        for body in part.bodies:
            B = body.X_PB.copy()
            B[:3, 3] *= scale
            bodies.append(Body(type(body.shape)(body.shape.size * scale), B))
        parts.append(Part(part.name, tuple(bodies), X))
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = rotation, shift
    return dataclasses.replace(assembly, parts=tuple(parts)).transformed(motion)


ROTATIONS = [
    np.array(m) for m in (np.eye(3)[list(p)] * np.array(s)[:, None]
                          for p in itertools.permutations(range(3)) for s in itertools.product((1, -1), repeat=3))
    if np.linalg.det(m) > 0
]  # fmt: skip
UPRIGHT = [m for m in ROTATIONS if m[2, 2] == 1]


@given(
    parts=small_assemblies(most=4),
    rotation=st.sampled_from([*ROTATIONS, *5 * UPRIGHT]),
    shift=st.tuples(*[st.floats(-50, 50)] * 3),
    scale=st.floats(0.01, 300),
)
@slow_geometry
def test_verdicts_do_not_depend_on_place_turn_and_scale(parts, rotation, shift, scale):
    assembly = Assembly.from_cells(parts)
    there = turned(assembly, rotation, np.array(shift), scale)
    assert verdicts(there, gravity=False) == verdicts(assembly, gravity=False)
    assert verdicts(there, gravity=False, groups=True)[0] == verdicts(assembly, gravity=False, groups=True)[0]
    if rotation[2, 2] == 1:  # gravity turns with nothing but the vertical
        assert verdicts(there) == verdicts(assembly)


@given(small_assemblies(most=4), st.permutations(range(4)))
@slow_geometry
def test_renaming_and_reordering_parts_relabels_the_verdicts(parts, order):
    names = {n: f"part {order[k % 4]}{k // 4}" for k, n in enumerate(parts)}
    renamed = {names[n]: parts[n] for n in sorted(parts, key=names.get)}
    for options in ({"gravity": False}, {}):
        status, orders, first = verdicts(Assembly.from_cells(parts), **options)
        relabelled = {names[n]: answer for n, answer in first.items()}
        assert verdicts(Assembly.from_cells(renamed), **options) == (status, orders, relabelled)
    grouped = [ns.solve(made(p, gravity=False, groups=True)).status for p in (parts, renamed)]
    assert grouped[0] is grouped[1]


@pytest.mark.parametrize("number", [0, 17, 101])
def test_soma_through_meshes_is_soma_through_cells(number):
    cells = Assembly.from_cells(ns.load_domain("soma").solutions()[number])
    meshes = as_meshes(cells)
    assert not meshes.bodies.all_boxes
    for options in ({"gravity": False}, {}):
        assert verdicts(meshes, **options) == verdicts(cells, **options)
    for options in ({"gravity": False}, {}):
        both = [ns.solve(family.problem(a, groups=True, **options)) for a in (cells, meshes)]
        assert both[0].plan == both[1].plan
        assert [m.parts for m in both[0].motions] == [m.parts for m in both[1].motions]


# -- options ----------------------------------------------------------------------------------------------------


def test_fixed_parts_stay():
    result = solved(GATE, fixed=["post 0"])
    assert set(result.plan) == {"post 1", "beam"}
    own = Assembly.from_cells(GATE).with_fixed(["post 0"])
    assert set(ns.solve(family.problem(own, fixed=["post 1"])).plan) == {"beam"}
    with pytest.raises(ns.InputError, match="not fixed"):
        made(GATE, fixed=list(GATE))


def test_the_ground_is_there_with_gravity_and_where_it_is_asked_for():
    flat = {"a": [(0, 0, 0)], "b": [(1, 0, 0)]}
    assert made(flat).world.has_table
    assert not made(flat, gravity=False).world.has_table
    assert made(flat, gravity=False, ground=True).world.ground == 0
    assert not made(flat, ground=False, fixed=["a"]).world.has_table
    assert made(flat, ground=-2).world.ground == -2
    assert ns.solve(made(flat, directions="-z", gravity=False)).solved
    assert ns.solve(made(flat, directions="-z", gravity=False, ground=-1.0)).status is UNSOLVABLE
    assert "the ground" in " ".join(ns.solve(made(flat, directions="-z")).why_not.sentences)
    with pytest.raises(ns.AssemblyError, match="on or above the ground"):
        made(flat, ground=0.5)


def test_what_does_not_stand_has_no_plan_and_says_so():
    hovering = {"base": [(0, 0, 0)], "cloud": [(0, 0, 3)]}
    for options in ({}, {"groups": True}):
        result = ns.solve(made(hovering, **options))
        assert result.status is UNSOLVABLE
        assert result.why_not.reasons[0].startswith("It does not stand as it is: cloud would fall.")
        assert ns.solve(made(hovering, held=1, **options)).solved
        assert not ns.validate(made(hovering, **options), ["cloud"])


def test_precedence_holds_and_is_named_where_it_is_the_reason():
    result = solved(GATE, before=[("beam", "post 0")])
    assert result.plan.index("beam") < result.plan.index("post 0")
    impossible = ns.solve(made(GATE, before=[("post 0", "beam"), ("post 1", "beam")]))
    assert impossible.status is UNSOLVABLE
    assert ("beam", "post 0") in impossible.why_not.waiting
    fall = next(f for f in impossible.why_not.falls if f.without == ("post 0",))
    assert (fall.parts, fall.lost) == (("beam",), (("beam", "post 0"),))
    assert "beam loses post 0" in " ".join(impossible.why_not.sentences)
    assert ns.solve(made(GATE, before=[("post 0", "beam"), ("post 1", "beam")], held=1)).solved
    with pytest.raises(ns.DefinitionError, match="one of beam"):
        made(GATE, before=[("post 7", "beam")])


def test_held_parts_are_named_and_their_number_is_kept():
    problem = made(GATE, before=[("post 0", "beam"), ("post 1", "beam")], held=1)
    result = ns.solve(problem)
    assert result.plan == ("post 0", "post 1", "beam") or result.plan == ("post 1", "post 0", "beam")
    assert result.motions[0].held == ("beam",)
    assert "while beam is held" in str(result.motions[0])
    assert ns.validate(problem, result.plan, result.motions)
    greedy = dataclasses.replace(result.motions[0], held=("beam", result.plan[1]))
    assert not ns.validate(problem, result.plan, (greedy, *result.motions[1:]))
    idle = dataclasses.replace(result.motions[0], held=())
    assert ns.validate(problem, result.plan, (idle, *result.motions[1:])).failed_at in (None, 0)


def test_a_replay_refuses_ways_that_are_wrong():
    problem = made(GATE)
    result = ns.solve(problem)
    down = StepMotion.along((result.plan[0],), (0, 0, -1))
    assert not ns.validate(problem, result.plan, (down, *result.motions[1:]))
    slanted = StepMotion.along((result.plan[0],), (0.6, 0, 0.8))
    refused = ns.validate(problem, result.plan, (slanted, *result.motions[1:]))
    assert "none of the problem's directions" in refused.reason
    grouped = made(PAIRS, gravity=False, groups=True)
    plan = ns.solve(grouped)
    wrong = dataclasses.replace(plan.motions[0], parts=("a",))
    assert not ns.validate(grouped, plan.plan, (wrong, *plan.motions[1:]))
    sideways = dataclasses.replace(plan.motions[0], direction=(1.0, 0.0, 0.0))
    assert "would be hit" in ns.validate(grouped, plan.plan, (sideways, *plan.motions[1:])).reason
    assert not ns.validate(grouped, plan.plan[:-1])
    assert not ns.validate(grouped, [plan.plan[0], plan.plan[0]])
    with pytest.raises(ns.InputError, match="one motion a step"):
        ns.validate(grouped, plan.plan, plan.motions[:1])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"paths": "bent"}, "kind of paths"),
        ({"held": -1}, "held"),
        ({"held": True}, "held"),
        ({"groups": "yes"}, "groups"),
        ({"gravity": 1}, "gravity"),
        ({"ground": "floor"}, "ground"),
        ({"directions": "up"}, "directions"),
        ({"directions": [(0, 0, 0)]}, "non-zero"),
        ({"fixed": ["nobody"]}, "fixed part"),
        ({"fixed": "beam"}, "list of names"),
        ({"groups": True, "before": [("beam", "post 0"), ("post 0", "post 1")]}, "anchor"),
    ],
    ids=str,
)
def test_wrong_options_are_refused_by_name(options, said):
    with pytest.raises(ns.InputError, match=said):
        made(GATE, **options)


@pytest.mark.parametrize("wrong", [99, -1, True, None, 3.5, object()])
def test_what_is_no_assembly_is_refused(wrong):
    with pytest.raises(ns.InputError, match=r"sample|Assembly"):
        family.problem(wrong)


def test_one_part_alone_is_soon_apart():
    assert solved({"a": [(0, 0, 0)]}).plan == ("a",)
    assert solved({"a": [(0, 0, 0)]}, groups=True).plan == ()


# -- assemblies by others ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def shared():
    if not SHARED.is_dir():
        pytest.skip("the assemblies in ../shared/data are not here")
    return SHARED


def test_bricks_leave_upwards_in_as_many_orders_as_there_are(shared):
    problem = family.problem(Assembly.load(shared / "bricks", units="mm"), directions="+z")
    assert ns.count_plans(problem) == 7_484_400  # 12! / 2^6: each brick of the lower course after the one on it


def test_the_arch_stands_by_itself_and_loses_no_block_unheld(shared):
    arch = Assembly.load(shared / "arch", units="m")
    assert arch.fixed == ("000", "029")
    result = ns.solve(family.problem(arch))
    assert result.status is UNSOLVABLE
    assert {f.without[0] for f in result.why_not.falls} == set(arch.names) - {"000", "029"}
    assert all(f.parts for f in result.why_not.falls)
    assert ns.solve(family.problem(arch, held=1)).solved
    assert ns.solve(family.problem(arch, gravity=False)).solved


def test_the_wall_comes_down_in_seconds(shared):
    problem = family.problem(Assembly.load(shared / "wall", units="m"))
    result = ns.solve(problem, prior="outermost-first", budget=ns.Budget(seconds=60))
    assert result.solved
    assert len(result.plan) == 42


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000))
def test_what_a_split_is_named_after_moves(seed):
    """In the hand either half may be moved: the part that is named does, and of all halves the smallest with it."""
    cells = box((0, 3), (0, 3), (0, 2))
    owners = np.random.default_rng(seed).integers(0, 6, len(cells))
    parts = {f"p{k}": [c for c, own in zip(cells, owners) if own == k] for k in set(owners.tolist())}
    problem = made(parts, gravity=False, groups=True)
    result = ns.solve(problem, rng=seed)
    for name, motion in zip(result.plan or (), result.motions):
        assert name in motion.parts


def test_an_action_named_after_a_screw_leaves_the_machine_where_it_is():
    """A screw through a lid into a box with a load: it goes by itself, whatever it is asked before."""
    walls = without(box((0, 5), (0, 5), (0, 3)), *box((1, 4), (1, 4), (1, 3)))
    lid, screw = without(box((0, 5), (0, 5), (3, 4)), (2, 2, 3)), [(2, 2, 3), (2, 2, 4), (1, 2, 4), (3, 2, 4)]
    machine = {"box": walls, "load": box((1, 4), (1, 4), (1, 3)), "lid": lid, "screw": screw}
    for gravity in (True, False):
        search = made(machine, gravity=gravity, groups=True).ground()
        step = search.attempt(search.initial, search.actions.index("screw"))
        assert step.motion.parts == ("screw",)
        lid = search.attempt(search.initial, search.actions.index("lid"))
        assert set(lid.motion.parts) <= {"lid", "screw"}
