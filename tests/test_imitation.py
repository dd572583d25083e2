"""Studies without a planner: honest figures, a grid that goes on after a kill, the columns of its table."""

from __future__ import annotations

import csv
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

import neurosym as ns
from neurosym.experiments import imitation
from neurosym.experiments.imitation import reproduce_study, study, study_names
from neurosym.experiments.order_accuracy import compare_orders

TINY = replace(
    study("variable"), methods=("tcn-paper+hungarian", "bc"), baselines=("blind",), sizes=(12,), seeds=1
)


def demonstrations(sequences):
    sequences = np.array(sequences)
    return ns.Demonstrations(np.zeros((len(sequences), 1, 2, 2, 3), np.uint8), sequences, ("a1", "a2", "b", "c"))


def test_figures_count_interchangeable_actions_as_one():
    truth = demonstrations([[0, 2, 1], [0, 2, -1], [3, 0, 1], [2, 3, -1]])
    predicted = [[1, 2, 0], [1, 2, -1], [3, 0, 0], [2, 3, 0]]
    found = compare_orders(predicted, truth, (0, 0, 1, 2))
    np.testing.assert_array_equal(found["whole_sequence"], [1, 1, 1, 0])  # the last goes on after the end
    np.testing.assert_array_equal(found["per_step"], [1, 1, 1, 1])
    np.testing.assert_array_equal(found["re_use"], [0, 0, 1, 0])
    np.testing.assert_array_equal(found["stop_accuracy"], [1, 1, 1, 0])
    strict = compare_orders(predicted, truth, (0, 1, 2, 3))
    np.testing.assert_array_equal(strict["whole_sequence"], [0, 0, 0, 0])
    np.testing.assert_allclose(strict["per_step"], [1 / 3, 1 / 2, 2 / 3, 1])
    with pytest.raises(ns.InputError, match="shape"):
        compare_orders([[0, 1]], truth, (0, 1, 2, 3))


def test_a_killed_study_goes_on(tmp_path, monkeypatch):
    given = replace(TINY, test=lambda _: {"variant": "heights", "count": 20})
    done = []
    really = imitation.run_trial

    def killed_at_the_second(trial, *rest):
        if done:
            raise KeyboardInterrupt
        done.append(trial.method)
        return really(trial, *rest)

    monkeypatch.setattr(imitation, "run_trial", killed_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        reproduce_study(given, tmp_path, epochs=1)
    monkeypatch.setattr(imitation, "run_trial", lambda t, *rest: done.append(t.method) or really(t, *rest))
    reproduce_study(given, tmp_path, epochs=1)
    assert done == ["tcn-paper+hungarian", "bc", "blind"]
    with open(tmp_path / "results.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0]) == ["experiment", "pictures", "method", "n", "seed", "metric", "value"]
    assert {line["method"] for line in lines} == {*TINY.methods, "blind"}
    shares = {line["metric"]: float(line["value"]) for line in lines if line["method"] == "bc"}
    assert shares["seen_share"] + shares["unseen_share"] == pytest.approx(1)
    assert "| 12 | bc |" in (tmp_path / "report.md").read_text()
    assert {"curves-hard.png", "curves-hard.svg"} <= {p.name for p in tmp_path.iterdir()}


def test_every_study_is_made_of_what_is_there():
    for name in study_names():
        given = study(name)
        assert given.domain in ns.domain_names()
        assert set(given.methods) <= set(ns.prior_names())
    with pytest.raises(ns.UnknownNameError, match="study"):
        study("towers")


def test_trials_in_other_processes_run_the_study_that_was_given(tmp_path):
    """Not the registered one of its name: here it trains on 6 towers and is tested on 5."""
    given = replace(
        TINY,
        options=lambda n: {"variant": "colours", "count": 6},
        test=lambda n: {"variant": "colours", "count": 5},
    )
    here = reproduce_study(given, tmp_path / "here", epochs=1)
    there = reproduce_study(given, tmp_path / "there", epochs=1, workers=2)

    def timeless(results):
        return results.records[results.records["metric"] != "training_seconds"]

    pd.testing.assert_frame_equal(timeless(here), timeless(there), check_exact=True)
    # Another test set is another trial: the journal must not answer for it.
    larger = replace(given, test=lambda n: {"variant": "colours", "count": 7})
    other = reproduce_study(larger, tmp_path / "here", epochs=1)
    shares = other.records.loc[other.records["metric"] == "per_step", "value"]
    assert len(shares)
    assert all((7 * 6 * v) == pytest.approx(round(7 * 6 * v)) for v in shares)
