"""The arm: motions of joints, inverse kinematics, and towers that stand where the plan wants them."""

from __future__ import annotations

import importlib.util
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import neurosym as ns
from learned_priors import NetworkPrior
from neurosym.errors import InputError
from neurosym.geometry.paths.joint_motion import plan_joint_motion
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.staging import building
from neurosym.planning.staging import stage
from neurosym.simulation.client import Client
from neurosym.simulation.panda import BuildSettings, CellFilm, build_with_panda, starting_places
from neurosym.simulation.panda.arm import HOME, PandaArm, from_above
from neurosym.simulation.panda.cell import Cell


def tower(number, variant="heights", **options):
    problem = ns.load_domain("tower").problem(number, variant=variant, **options)
    result = ns.solve(problem)
    assert result.plan is not None
    return list(result.plan), stage(problem, result.plan, result.motions)


def round_the_wall(q):
    # A wall at 0.5 with a gap above 0.7.
    return bool(abs(q[0] - 0.5) > 0.05 or q[1] > 0.7)


def test_a_joint_motion_goes_round_what_is_in_the_way_the_same_way_for_the_same_seed():
    def plan(seed):
        rng = np.random.default_rng(seed)
        return plan_joint_motion([0, 0], [1, 1], [0.1, 0.1], [0.9, 0.1], round_the_wall, rng=rng, resolution=1e-3)

    path = plan(3)
    assert np.allclose(path[[0, -1]], [[0.1, 0.1], [0.9, 0.1]])
    for a, b in pairwise(path):
        assert all(round_the_wall(a + (b - a) * s) for s in np.linspace(0, 1, 200))
    assert np.array_equal(path, plan(3))


def test_a_joint_motion_that_cannot_be_is_none():
    def closed(q):
        return bool(abs(q[0] - 0.5) > 0.05)

    rng = np.random.default_rng(0)
    assert plan_joint_motion([0, 0], [1, 1], [0.1, 0.1], [0.9, 0.1], closed, rng=rng, max_checks=2000) is None
    assert plan_joint_motion([0, 0], [1, 1], [0.5, 0.1], [0.9, 0.1], closed, rng=rng) is None, "the start is not free"
    with pytest.raises(InputError, match="within the joints' limits"):
        plan_joint_motion([0, 0], [1, 1], [0.1, 1.1], [0.9, 0.1], closed, rng=rng)
    with pytest.raises(InputError, match="one shape"):
        plan_joint_motion([0, 0], [1, 1], [0.1], [0.9, 0.1], closed, rng=rng)


def test_inverse_kinematics_brings_the_tool_there_within_the_limits():
    rng = np.random.default_rng(0)
    with Client() as client:
        arm = PandaArm(client)
        for _ in range(20):
            X = from_above(rng.uniform([0.35, -0.3, 0.03], [0.6, 0.3, 0.4]), rng.uniform())
            q = arm.inverse(X, HOME)
            assert q is not None
            assert ((arm.lower <= q) & (q <= arm.upper)).all()
            arm.put(q)
            assert np.allclose(arm.X_WT[:3, 3], X[:3, 3], atol=1e-3)
            assert np.allclose(arm.X_WT[:3, 2], [0, 0, -1], atol=1e-2), "it points down"
        assert arm.inverse(from_above(np.array([1.5, 0, 0.1]), 0.0), HOME) is None, "out of reach"


def test_the_arm_knows_what_it_would_touch():
    size, X = np.full(3, 0.05), np.eye(4)
    X[:3, 3] = 0.5, 0.0, 0.025
    with Cell({"block": size}, {"block": X}) as cell:
        q = cell.arm.inverse(from_above(np.array([0.5, 0.0, 0.03]), 0.0), HOME)
        assert cell.is_free(HOME)
        beside = from_above(np.array([0.5, 0.03, 0.03]), 0.0)
        assert not cell.is_free(cell.arm.inverse(beside, q))
        assert cell.is_free(cell.arm.inverse(beside, q), ignored=("block",))
        into_table = cell.arm.inverse(from_above(np.array([0.5, 0.2, -0.03]), 0.0), HOME)
        assert not cell.is_free(into_table)


@pytest.mark.parametrize(("number", "seed"), [(100, 0), (640, 1)])
def test_the_tower_stands_in_the_order_of_the_plan(number, seed):
    plan, staging = tower(number)
    assert 3 <= len(plan) <= 6
    report = build_with_panda(staging, rng=np.random.default_rng(seed))
    assert report.ok, report.placements
    assert report.standing == tuple(plan)
    assert sorted(plan, key=lambda name: report.poses[name][2, 3]) == plan, "from the bottom up"
    for level, name in enumerate(plan):
        X = report.poses[name]
        # In edges of a block: 0.1 is 5 mm.
        assert np.allclose(X[:3, 3], [0, 0, level + 0.5], atol=0.1), name
        assert X[2, 2] > 0.999
    built = report.built()
    assert built.names == tuple(plan)
    assert AssemblyGeometry(built).stability.standing((1 << len(plan)) - 1).stands


def test_what_slips_is_reported_and_nothing_is_built_on_it():
    _, staging = tower(100)
    report = build_with_panda(staging, rng=np.random.default_rng(0), settings=BuildSettings(force=0.05))
    assert not report.ok
    assert [p.ok for p in report.placements] == [False]
    assert "slipped" in report.placements[0].reason
    assert report.placements[0].attempts == 2
    assert report.standing == ()


def test_plans_that_the_hand_cannot_do_are_refused():
    rng = np.random.default_rng(0)
    soma = ns.load_domain("soma").problem(17, collapse="rigid")
    with pytest.raises(InputError, match="steps bring one block each"):
        build_with_panda(stage(soma, ns.solve(soma).plan), rng=rng)
    _, staging = tower(100)
    with pytest.raises(InputError, match=r"at most 7\.2 cm across"):
        build_with_panda(staging, rng=rng, settings=BuildSettings(metres=0.08))
    pieces = ns.Assembly.from_cells({"a": [(0, 0, 0), (1, 0, 0)]})
    with pytest.raises(InputError, match="one box each"):
        build_with_panda(building(pieces, (), ["a"]), rng=rng)
    with pytest.raises(InputError, match="at most 12 blocks"):
        starting_places([str(i) for i in range(13)], {}, rng)


def test_the_example_builds_and_keeps_what_stands(tmp_path, capsys):
    path = Path(__file__).parent.parent / "examples" / "panda_builds_a_tower.py"
    spec = importlib.util.spec_from_file_location("example_panda", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    kept = module.main(towers=(3, 100), out=str(tmp_path / "demos.npz"))
    again = ns.Demonstrations.load(tmp_path / "demos.npz")
    assert len(kept) == len(again) == 2
    assert again.pictures.shape == (2, 1, 64, 64, 3)
    assert again.lengths.tolist() == [2, 3]
    family = ns.load_domain("tower")
    for number, picture, row in zip((3, 100), again.pictures, again.sequences):
        problem = family.problem(number, variant="heights")
        assert ns.validate(problem, [again.actions[i] for i in row if i >= 0])
        # What stands differs from the reference by less than a millimetre: by few pixels along edges.
        assert (picture != problem.observation).mean() < 0.02
    assert "It stands in its place." in capsys.readouterr().out
    # What the robot recorded is what training reads: a short fit makes the order that it built likelier.
    likely = []
    for settings in ({"epochs": 1, "least_steps": 1}, {"epochs": 60, "least_steps": 60}):
        prior = NetworkPrior("sinkhorn").fit(again, settings=settings)
        scores = prior.read(again.pictures)
        assert scores[0].log_prob.shape[1] == len(again.actions)
        likely.append(sum(s.cost(0, int(row[0])) for s, row in zip(scores, again.sequences)))
    assert likely[1] < likely[0] - 0.1, "cost is -log P"


def test_those_who_watch_see_every_step_and_a_film_shows_the_arm():
    size, X = np.full(3, 0.05), np.eye(4)
    X[:3, 3] = 0.5, 0.0, 0.025
    film, steps = CellFilm((96, 72), speed=2.0), []
    with Cell({"block": size}, {"block": X}, colours={"block": (0.9, 0.0, 0.0)}) as cell:
        cell.watchers += [film, lambda seen: steps.append(seen)]
        cell.step(64)
    assert len(steps) == 64
    assert len(film.pictures) == 2, "every 32 steps of 1/240 s"
    picture = film.pictures[0].astype(int)
    assert picture.shape == (72, 96, 3)
    assert ((picture[:, :, 0] > 2 * picture[:, :, 1]) & (picture[:, :, 0] > 80)).sum() > 3, "the red block"
    assert (picture.max(axis=2) < 120).sum() > 20, "dark parts of the arm"
