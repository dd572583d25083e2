"""Tasks run anywhere and give the same: in this process, in processes beside it, on a Ray cluster that loses a node."""

from __future__ import annotations

import os
import socket
import sys
import time
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import neurosym as ns
from neurosym.experiments import engines
from neurosym.experiments.engines import connection, run_tasks
from neurosym.experiments.imitation import reproduce_study
from neurosym.experiments.studies import study


def drawn(seed: int) -> float:
    return float(np.random.default_rng(seed).normal())


EXPECTED = {seed: drawn(seed) for seed in range(8)}


@pytest.mark.parametrize("workers", [1, 2, None])
def test_every_task_is_answered_once_and_the_same_anywhere(workers):
    given = list(run_tasks(lambda seed: float(np.random.default_rng(seed).normal()), range(8), workers=workers))
    assert len(given) == len(EXPECTED)
    assert dict(given) == EXPECTED


def test_results_come_as_they_finish():
    """So that what is done is kept: neither the order of the tasks nor a batch holds a result back."""
    order = [task for task, _ in run_tasks(lambda s: time.sleep(s), [1.5, 0.0, 0.01, 0.02], workers=2)]
    assert order[-1] == 1.5


def test_tasks_have_one_thread_and_stay_in_their_process():
    def look(_):
        from joblib import Parallel, delayed

        inner = Parallel(n_jobs=2)(delayed(os.getpid)() for _ in range(4))
        return os.getpid(), set(inner), os.environ["OMP_NUM_THREADS"]

    found = [answer for _, answer in run_tasks(look, range(4), workers=2)]
    assert all(inner == {own} and own != os.getpid() for own, inner, _ in found)
    assert {threads for _, _, threads in found} == {"1"}


def test_what_asks_is_not_configured_by_what_runs():
    import joblib

    before = joblib.effective_n_jobs(2)
    for _ in run_tasks(str, range(3), workers=2):
        assert joblib.effective_n_jobs(2) == before
        assert joblib.parallel.get_active_backend()[0].inner_max_num_threads is None


@pytest.mark.parametrize("workers", [1, 2])
def test_what_a_task_raises_is_raised(workers):
    def refuse(task):
        raise ns.InputError(f"Expected no task; got {task}.")

    with pytest.raises(ns.InputError, match="Expected no task"):
        list(run_tasks(refuse, range(3), workers=workers))


def test_a_killed_worker_is_said():
    with pytest.raises(ns.NeurosymError, match="killed"):
        list(run_tasks(lambda _: os._exit(9), range(3), workers=2))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"engine": "rya"}, "Did you mean 'ray'"),
        ({"workers": 0}, "at least one worker"),
        ({"address": "127.0.0.1:6379"}, "engine='ray'"),
    ],
)
def test_wrong_engines_are_refused_before_anything_runs(options, message):
    with pytest.raises(ns.InputError, match=message):
        run_tasks(str, [1], **options)


def test_a_missing_ray_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(ns.MissingDependencyError, match="extra `ray`"):
        list(run_tasks(str, [1], engine="ray"))


def ray_module(monkeypatch):
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    monkeypatch.delenv("RAY_ADDRESS", raising=False)
    return pytest.importorskip("ray", reason="Ray is not installed (extra `ray`)")


def test_an_address_where_nobody_is_is_refused_at_once(monkeypatch):
    ray_module(monkeypatch)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))  # not listening, and nobody else can
        nobody = f"127.0.0.1:{free.getsockname()[1]}"
        started = time.monotonic()
        for address in (nobody, f"ray://{nobody}"):
            with pytest.raises(ns.InputError, match=nobody), connection("ray", address):
                pass
        monkeypatch.setenv("RAY_ADDRESS", nobody)
        with pytest.raises(ns.InputError, match=nobody):
            list(run_tasks(str, [1], engine="ray"))
    with pytest.raises(ns.InputError, match="HOST:PORT"), connection("ray", "somewhere"):
        pass
    assert time.monotonic() - started < engines.REACH_SECONDS
    with connection("local"):
        pass


@pytest.fixture(scope="module")
def cluster():
    """Two nodes on this machine, one processor each."""
    with pytest.MonkeyPatch.context() as patch:
        ray = ray_module(patch)
        from ray.cluster_utils import Cluster

        node = {"num_cpus": 1, "object_store_memory": 80_000_000, "include_dashboard": False}
        made = Cluster(initialize_head=True, head_node_args=node)
        try:
            made.second = made.add_node(**node)
            yield made
        finally:
            ray.shutdown()
            made.shutdown()


def test_what_a_task_raises_on_ray_is_raised_here_and_tried_again_if_the_machine_was_to_blame(
    cluster, tmp_path, monkeypatch
):
    monkeypatch.setattr(engines, "RETRIES", 1)

    def fail(task):
        (tmp_path / f"{task}-{time.monotonic_ns()}").touch()
        raise {"input": ns.InputError, "disk": OSError}[task](f"Expected no {task}.")

    with connection("ray", cluster.address):
        for task, error in (("input", ns.InputError), ("disk", OSError)):
            with pytest.raises(error, match=f"^Expected no {task}.$"):
                list(run_tasks(fail, [task], engine="ray"))
    assert len(list(tmp_path.glob("input-*"))) == 1
    assert len(list(tmp_path.glob("disk-*"))) == 2


def test_a_study_on_ray_loses_a_node_and_gives_the_whole_table(cluster, tmp_path):
    here, second = os.getpid(), cluster.second.node_id

    def training(n):
        if os.getpid() != here:  # in a worker, as its trial begins
            import ray

            (tmp_path / f"begun-{time.monotonic_ns()}").touch()
            if ray.get_runtime_context().get_node_id() == second:
                (tmp_path / "the second node is at work").touch()
                time.sleep(60)  # until the node is lost
        return {"variant": "colours", "count": n}

    given = replace(study("tower"), methods=("bc",), sizes=(6,), pictures=("easy",), seeds=6, baselines=(), controls={})
    given = replace(given, options=training, test=lambda n: {"variant": "colours", "count": 5})
    wanted = reproduce_study(given, tmp_path / "here", epochs=1)
    done = []

    def lose_the_second_node(finished, total):
        done.append(finished)
        if finished == 2:
            for _ in range(9000):
                if (tmp_path / "the second node is at work").exists():
                    break
                time.sleep(0.01)
            cluster.remove_node(cluster.second, allow_graceful=False)

    where = {"engine": "ray", "workers": None, "address": cluster.address, "progress": lose_the_second_node}
    found = reproduce_study(given, tmp_path / "there", epochs=1, **where)
    assert done == list(range(7))
    assert len(list(tmp_path.glob("begun-*"))) == 7, "what the second node was at was begun again, nothing else was"
    timeless = [each.records[each.records["metric"] != "training_seconds"] for each in (found, wanted)]
    pd.testing.assert_frame_equal(*timeless, check_exact=True)
