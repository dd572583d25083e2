"""Equal parts that may be swapped are one class for planners; counts say both numbers."""

import json
import math

import numpy as np
import pytest
import shapely
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from trimesh.creation import extrude_polygon, revolve

import neurosym as ns
from neurosym.cli import main
from neurosym.pipeline import count_orders
from neurosym.testing.domains import check_problem
from planners.state_graph import count_orders as count_plainly

assembly = ns.load_domain("assembly")


def flange(turned: float = 0.0, odd: bool = False) -> dict[str, trimesh.Trimesh]:
    """A base, a cover on it, and eight equal bolts through the cover; with `odd` one of them is longer."""
    places = 20 * np.exp(2j * np.pi * (np.arange(8) + 0.3) / 8)
    holes = shapely.union_all([shapely.Point(p.real, p.imag).buffer(2.1) for p in places])
    plate = shapely.Point(0, 0).buffer(30) - holes
    parts = {"base": extrude_polygon(plate, 10), "cover": extrude_polygon(plate, 4).apply_translation((0, 0, 10))}
    for i, place in enumerate(places):
        length = 10 + 2 * (odd and i == 0)
        profile = [(0, 0), (2, 0), (2, length), (4, length), (4, length + 3), (0, length + 3)]
        bolt = revolve(profile, sections=16).apply_translation((0, 0, 4))
        bolt.apply_transform(trimesh.transformations.rotation_matrix(0.7 * i, (0, 0, 1)))
        parts[f"bolt {i}"] = bolt.apply_translation((place.real, place.imag, 0))
    turn = trimesh.transformations.rotation_matrix(turned, (0, 0, 1))
    return {name: mesh.apply_transform(turn) for name, mesh in parts.items()}


def of(parts, **options):
    return assembly.problem(ns.Assembly.from_meshes(parts, units="mm"), **{"fixed": ["base"], **options})


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_eight_equal_bolts_are_one_class_and_their_orders_one(turned):
    problem = of(flange(turned), gravity=False)
    classes = dict(zip(problem.actions, problem.classes))
    assert len({classes[f"bolt {i}"] for i in range(8)}) == 1
    assert classes["cover"] != classes["bolt 0"]
    counted = count_orders(problem)
    assert (counted.orders, counted.told_apart) == (1, math.factorial(8))
    check_problem(problem, walks=2)
    for side in ("full", "empty", "both"):
        result = ns.solve(problem, side=side)
        assert result.plan[-1] == "cover"
        assert ns.validate(problem, result.plan, result.motions)


def test_a_longer_bolt_a_wish_and_gravity_tell_parts_apart():
    assert count_orders(of(flange(odd=True), gravity=False)).orders == 8
    wish = of(flange(), gravity=False, before=[("bolt 0", "bolt 1")])
    assert len(set(wish.classes)) == 4  # two that are named, the six others, the cover
    # Under gravity bolts may carry the cover: only what touches nothing but fixed parts is swapped.
    assert len(set(of(flange()).classes)) == 9
    assert len(set(of(flange(), fixed=["base", "cover"]).classes)) == 1


def test_count_says_both_numbers(tmp_path, capsys):
    for name, mesh in flange().items():
        mesh.export(tmp_path / f"{name}.stl")
    arguments = ["count", str(tmp_path), "--units", "mm", "--no-gravity", "--fixed", "base"]
    for more in ([], ["--json"]):
        with pytest.raises(SystemExit):
            main([*arguments, *more])
    text, _, document = capsys.readouterr().out.partition("{")
    assert text.startswith("1 order (")
    assert "told apart, 40,320 orders." in text
    found = json.loads("{" + document)
    assert (found["orders"], found["told_apart"]) == (1, 40320)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000), st.booleans())
def test_told_apart_there_are_as_many_orders_as_without_classes(seed, gravity):
    places = np.random.default_rng(seed).permutation([(x, y, z) for x in range(3) for y in range(2) for z in range(2)])
    cells = {f"p{k}": [tuple(map(int, place))] for k, place in enumerate(places[:6])}
    problem = assembly.problem(ns.Assembly.from_cells(cells), gravity=gravity, fixed=["p0"])
    ground = problem.ground()

    class Unlike:
        actions, initial, classes = ground.actions, ground.initial, tuple(range(len(ground.actions)))
        is_goal, candidates, attempt = ground.is_goal, ground.candidates, ground.attempt

    counted, plain = count_orders(problem), count_plainly(Unlike())
    assert counted.orders == 0 or counted.told_apart == plain.orders
    assert bool(counted.orders) == bool(plain.orders)
