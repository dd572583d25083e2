"""`neurosym reproduce`: every table is written, a killed run goes on, another experiment's folder is refused."""

from __future__ import annotations

import csv

import pandas as pd
import pytest

import neurosym as ns
from neurosym.experiments import reproduce as experiments
from neurosym.experiments.reproduce import Experiment, reproduce

TINY = Experiment(
    "soma", splits=1, styles=("clean",), methods=("sinkhorn-paper", "tcn-paper"), repeats=1, epochs=1, tests=12
)


def test_a_killed_experiment_goes_on_and_ends_the_same(tmp_path, monkeypatch):
    whole = reproduce(TINY, tmp_path / "whole")

    trained = []
    really = experiments.train_cell

    def killed_at_the_second(experiment, cell, out):
        if len(trained) == 1:
            raise KeyboardInterrupt
        trained.append(cell.method)
        return really(experiment, cell, out)

    monkeypatch.setattr(experiments, "train_cell", killed_at_the_second)
    with pytest.raises(KeyboardInterrupt):
        reproduce(TINY, tmp_path / "killed")
    assert trained == ["sinkhorn-paper"]
    monkeypatch.setattr(experiments, "train_cell", lambda e, c, o: trained.append(c.method) or really(e, c, o))
    again = reproduce(TINY, tmp_path / "killed")
    assert trained == ["sinkhorn-paper", "tcn-paper"]

    def timeless(records):
        return records[records["metric"] != "training_seconds"]

    pd.testing.assert_frame_equal(timeless(again), timeless(whole), check_exact=True)

    folder = tmp_path / "killed"
    with open(folder / "results.csv", newline="") as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0]) == ["experiment", "pictures", "method", "n", "seed", "metric", "value"]
    methods = {line["method"] for line in lines}
    assert methods == {"random", "outermost-first", "sinkhorn-paper", "tcn-paper", "blind"}
    blind = [float(x["value"]) for x in lines if x["method"] == "blind"]
    assert 0.3 < blind[0] <= 1
    page = (folder / "report.md").read_text()
    assert "5.35 ± 4.12" in page
    assert "51.55 ± 6.19" in page
    for name in ("iterations-clean", "methods-clean"):
        assert (folder / f"{name}.png").stat().st_size > 10_000
        assert (folder / f"{name}.svg").read_text().startswith("<?xml")
        assert f"({name}.png)" in page


def test_a_folder_belongs_to_one_experiment(tmp_path):
    (tmp_path / "experiment.json").write_text('{"domain": "another"}')
    with pytest.raises(ns.InputError, match="another"):
        reproduce(TINY, tmp_path)


def test_an_empty_experiment_is_refused():
    with pytest.raises(ns.InputError, match="at least one"):
        Experiment("soma", methods=())
