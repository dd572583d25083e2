"""Runs that are killed (SIGKILL, the whole process group) go on, do nothing twice, and end as if nothing had been."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter

import pytest

from neurosym.experiments.journal import Journal

#: Small enough for seconds, slow enough (it waits after each trial) to be killed in between.
STUDY = """
import sys, time
from dataclasses import replace
from pathlib import Path
from neurosym.experiments.imitation import reproduce_study
from neurosym.experiments.studies import study

given = replace(study("variable"), methods=("bc", "sinkhorn"), sizes=(12, 16), seeds=2)
given = replace(given, test=lambda n: {"variant": "heights", "count": 20}, figures=())
reproduce_study(given, Path(sys.argv[1]), epochs=2, workers=int(sys.argv[2]), say=lambda line: time.sleep(0.1))
"""

SOMA = """
import sys
from pathlib import Path
from neurosym.experiments.reproduce import Experiment, reproduce

what = {"splits": 1, "styles": ("clean",), "methods": ("sinkhorn-paper", "tcn-paper"), "planners": ("swap-repair",)}
given = Experiment("soma", **what, repeats=1, epochs=20, tests=8)
reproduce(given, Path(sys.argv[1]), workers=int(sys.argv[2]))
"""


def start(script, out, workers):
    """In a process group of its own, with one thread a process."""
    arguments = [sys.executable, "-c", script, str(out), str(workers)]
    return subprocess.Popen(
        arguments, stderr=subprocess.PIPE, start_new_session=True, env={**os.environ, "OMP_NUM_THREADS": "1"}
    )


def finish(run):
    _, said = run.communicate(timeout=120)
    assert run.returncode == 0, said.decode()


def kill_when(run, ready):
    """As soon as `ready()`; it must still be running then."""
    deadline = time.monotonic() + 120
    while not ready():
        assert run.poll() is None, run.communicate()[1].decode()
        assert time.monotonic() < deadline
        time.sleep(0.002)
    os.killpg(run.pid, signal.SIGKILL)
    run.communicate()
    assert run.returncode == -signal.SIGKILL


def lines(journal):
    return journal.read_bytes().count(b"\n") if journal.exists() else 0


def keys(journal):
    """Of the whole lines."""
    found = []
    for line in journal.read_bytes().split(b"\n"):
        try:
            found.append(json.loads(line)["key"])
        except ValueError:
            continue
    return found


def table(out):
    """results.csv, with and without what a clock measured."""
    with open(out / "results.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    return rows, [row for row in rows if "seconds" not in row["metric"]]


def test_a_study_killed_twice_ends_as_if_it_had_not_been(tmp_path):
    out, journal = tmp_path / "killed", tmp_path / "killed" / "trials.jsonl"
    undisturbed = start(STUDY, tmp_path / "whole", 1)
    try:
        kill_when(start(STUDY, out, 2), lambda: lines(journal) >= 3)
        content = journal.read_bytes()
        journal.write_bytes(content[:-20])  # the kill came while the last line was written
        early = keys(journal)
        assert 2 <= len(early) < 16

        kill_when(start(STUDY, out, 1), lambda: lines(journal) >= len(early) + 4)
        journal.write_bytes(journal.read_bytes()[:-1])  # all of the line but its end
        late = keys(journal)
        kept = Journal(journal)
        assert len(early) + 2 <= len(late) < 16

        finish(start(STUDY, out, 1))
        finish(undisturbed)
    finally:
        undisturbed.kill()
    ended = keys(journal)
    assert ended[: len(late)] == late
    assert len(ended) == 16
    assert set(Counter(ended).values()) == {1}, "no finished trial was run again"
    whole, again = table(tmp_path / "whole"), table(out)
    assert again[1] == whole[1]
    assert len(again[0]) == len(whole[0])
    # Times are noise, but what was finished keeps its own.
    after = Journal(journal)
    assert all(after[key] == kept[key] for key in late)


def test_an_experiment_killed_while_it_trains_and_while_it_plans_ends_as_if_it_had_not_been(tmp_path):
    out = tmp_path / "killed"
    first, last = (out / "weights" / f"clean-{m}-split0.safetensors" for m in ("sinkhorn-paper", "tcn-paper"))
    undisturbed = start(SOMA, tmp_path / "whole", 1)
    try:
        kill_when(start(SOMA, out, 1), first.exists)
        assert not last.exists()
        trained = first.stat().st_mtime_ns
        kill_when(start(SOMA, out, 1), lambda: lines(out / "runs-clean-0.jsonl") > 3)
        planned = keys(out / "runs-clean-0.jsonl")
        finish(start(SOMA, out, 1))
        finish(undisturbed)
    finally:
        undisturbed.kill()
    assert first.stat().st_mtime_ns == trained
    ended = keys(out / "runs-clean-0.jsonl")
    assert ended[: len(planned)] == planned
    assert len(ended) == len(set(ended)) == 32
    assert table(out)[1] == table(tmp_path / "whole")[1]


@pytest.mark.parametrize("cut", range(1, 35, 3))
def test_a_journal_torn_anywhere_in_its_last_line_loses_that_at_most(tmp_path, cut):
    path = tmp_path / "journal.jsonl"
    Journal(path).add({"a": {"x": 1.5}, "b": {"x": 2.5}})
    path.write_bytes(path.read_bytes()[:-cut])
    Journal(path).add({"c": {"x": 3.5}})
    read = Journal(path)
    assert read["a"] == {"x": 1.5}
    assert read["c"] == {"x": 3.5}
    assert ("b" in read) == (cut == 1), "only the end of the line is missing"


def test_a_journal_gives_now_what_it_gives_after_a_kill(tmp_path):
    kept = Journal(tmp_path / "journal.jsonl")
    kept.add({"a": {"pair": (1, 2), "by number": {1: 0.1}}})
    assert kept["a"] == Journal(tmp_path / "journal.jsonl")["a"] == {"pair": [1, 2], "by number": {"1": 0.1}}
