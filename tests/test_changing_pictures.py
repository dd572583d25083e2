"""Pictures that change: the style `cluttered`, changes while training, parts for choosing, and how sure priors are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

import neurosym as ns
from learned_priors.augment import augmented
from learned_priors.network_prior import NetworkPrior
from neurosym.cli import main
from neurosym.experiments import robustness
from neurosym.experiments.perturbations import PERTURBATIONS, SOMETHING_ELSE
from neurosym.geometry.assembly import Assembly
from neurosym.language.demonstrations import Demonstrations
from neurosym.planning.weights_header import read_header
from neurosym.simulation.clutter import turned_hues
from neurosym.simulation.looks import Camera, Clutter, Style
from neurosym.simulation.render import render_views

SIDE = Camera(0, 12, distance=6.6)
tower, soma = ns.load_domain("tower"), ns.load_domain("soma")


def drawn(style: str | Style, seed: int) -> np.ndarray:
    column = Assembly.from_cells({"column": [(0, 0, z) for z in range(6)]})
    red = {"column": (1.0, 0.0, 0.0)}
    return render_views(column, style=style, rng=np.random.default_rng(seed), colours=red, cameras=[SIDE])[0]


def test_cluttered_pictures_follow_their_seed() -> None:
    assert (drawn("cluttered", 0) == drawn("cluttered", 0)).all()
    assert (drawn("cluttered", 0) != drawn("cluttered", 1)).any()
    assert np.ptp([drawn("cluttered", seed).mean() for seed in range(8)]) > 60, "dark and light"


def test_work_is_whole_and_of_20_to_50_pixels_anywhere_in_the_picture() -> None:
    plain = Style(clutter=Clutter(chance=0.0, gain=(1.0, 1.0), hue=0.0))
    tops, heights = [], []
    for seed in range(20):
        picture = drawn(plain, seed).astype(int)
        rows = np.flatnonzero(((picture[..., 0] > 120) & (picture[..., 1:].max(axis=2) < 12)).sum(axis=1) > 1)
        tops.append(rows[0])
        heights.append(rows[-1] - rows[0] + 1)
    assert 17 <= min(heights) < 30 < 40 < max(heights) <= 52
    assert np.ptp(tops) > 15


def test_hues_turned_all_the_way_are_as_before() -> None:
    pictures = np.random.default_rng(0).integers(0, 256, (2, 1, 8, 8, 3), dtype=np.uint8)
    there_and_back = turned_hues(turned_hues(pictures, 0.3), -0.3).astype(int)
    assert np.abs(there_and_back - pictures).mean() < 2
    assert np.abs(turned_hues(pictures, 0.5).astype(int) - pictures).mean() > 30


@pytest.mark.parametrize("strength", [0.5, 1.0])
def test_what_training_changes_is_drawn_anew_and_keeps_its_shape(strength: float) -> None:
    pictures = torch.from_numpy(drawn("clean", 0)[None, None].repeat(6, axis=0))
    torch.manual_seed(0)
    one, other = augmented(pictures, strength), augmented(pictures, strength)
    torch.manual_seed(0)
    assert (augmented(pictures, strength) == one).all()
    assert one.shape == pictures.shape
    assert one.dtype == torch.uint8
    assert (one != other).any()
    assert (augmented(pictures, 0.0) == pictures).all()


@pytest.mark.parametrize("name", list(PERTURBATIONS | SOMETHING_ELSE))
def test_perturbations_keep_shapes_and_change_something(name: str) -> None:
    pictures = np.stack([drawn("clean", 0)[None]] * 2)
    changed = (PERTURBATIONS | SOMETHING_ELSE)[name](pictures, np.random.default_rng(0))
    assert changed.shape == pictures.shape
    assert changed.dtype == np.uint8
    assert (changed != pictures).any()


def test_shifts_are_of_five_pixels() -> None:
    picture = drawn("clean", 0)
    for way, (axis, step) in {"down": (0, 5), "up": (0, -5), "right": (1, 5), "left": (1, -5)}.items():
        moved = PERTURBATIONS[f"5 pixels {way}"](picture, np.random.default_rng(0))
        assert (moved == np.roll(picture, step, axis=axis))[8:-8, 8:-8].all()


@pytest.mark.parametrize(
    ("domain", "options"),
    [("soma", {}), ("tower", {}), ("tower", {"variant": "heights", "by": "sequence"}), ("scrabble", {})],
)
def test_what_settings_are_chosen_by_is_a_sixth_of_what_is_to_train(domain: str, options: dict) -> None:
    family = ns.load_domain(domain)
    counts = {"train": 10_000, "learn": 8_333, "choose": 1_667, "test": 5_000} if domain == "scrabble" else {}
    learn, choose, train, test = (
        set(family.numbers(part, **options, **({"count": counts[part]} if counts else {})))
        for part in ("learn", "choose", "train", "test")
    )
    assert learn | choose == train
    assert not learn & choose
    assert not train & test
    assert len(choose) == pytest.approx(len(train) / 6, rel=0.15)


def stripes(m: int, noise: float, seed: int) -> Demonstrations:
    """Three stripes of colour from the top down, in noise."""
    rng = np.random.default_rng(seed)
    orders = np.stack([rng.permutation(3) for _ in range(m)])
    colours = np.array([[220, 40, 40], [40, 200, 60], [50, 80, 220]])[orders]
    pictures = colours.repeat(8, axis=1)[:, None, :, None].repeat(24, axis=3)
    noisy = np.clip(pictures + rng.normal(0, noise, pictures.shape), 0, 255).astype(np.uint8)
    return Demonstrations(noisy, orders, ("red", "green", "blue"), np.eye(3, dtype=np.float32)[orders])


def test_training_with_changes_reads_changed_light() -> None:
    torch.set_num_threads(1)
    prior = NetworkPrior("sinkhorn").fit(stripes(120, 5.0, 0), epochs=25, settings={"batch": 32, "augment": 0.6})
    test = stripes(60, 5.0, 1)
    dark = PERTURBATIONS["brightness x 0.5"](test.pictures, np.random.default_rng(0))
    assert (prior.predict(dark) == test.sequences).all(axis=1).mean() > 0.9


def test_training_goes_on_from_weights(tmp_path: Path) -> None:
    torch.set_num_threads(1)
    test = stripes(60, 5.0, 1)
    first = NetworkPrior("sinkhorn").fit(stripes(120, 5.0, 0), epochs=25, settings={"batch": 32})
    path = first.save(tmp_path / "first.safetensors")
    on = NetworkPrior("sinkhorn").fit(stripes(60, 5.0, 2), epochs=1, settings={"rate": 1e-5}, start=path)
    assert (on.predict(test.pictures) == first.predict(test.pictures)).all()
    others = stripes(20, 5.0, 0)
    others = Demonstrations(others.pictures, others.sequences, ("a", "b", "c"), others.marginals)
    with pytest.raises(ns.InputError, match="same network and actions"):
        NetworkPrior("sinkhorn").fit(others, epochs=1, start=path)


def test_a_temperature_set_afterwards_is_in_the_header(tmp_path: Path) -> None:
    torch.set_num_threads(1)
    prior = NetworkPrior("sinkhorn").fit(stripes(60, 250.0, 0), epochs=40)
    doubtful = stripes(200, 250.0, 1)
    shares = list(np.eye(3)[doubtful.sequences])
    before = robustness.calibration_error(prior.read(doubtful.pictures), shares)
    path = prior.calibrate(stripes(200, 250.0, 2)).save(tmp_path / "own.safetensors")
    read = ns.load_prior(str(path))
    assert read.header["network"]["temperature"] != 1.0  # type: ignore[attr-defined]
    assert robustness.calibration_error(read.read(doubtful.pictures), shares) < 0.7 * before  # type: ignore[attr-defined]


def test_the_command_keeps_some_to_choose_by(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NEUROSYM_CACHE", str(tmp_path))
    out = tmp_path / "own.safetensors"
    styles = ["--pictures", "clean", "--pictures", "cluttered", "--part", "learn", "--calibrate", "clean"]
    settings = ["--setting", "augment=1", "--setting", "least_steps=0", "--setting", "epochs=2", "--encoder", "conv"]
    settings += ["--option", "count=12", "--held-out", "0"]
    with pytest.raises(SystemExit) as left:
        main(["train", "tower", "--prior", "sinkhorn", *styles, *settings, "--out", str(out)])
    assert not left.value.code
    header = read_header(out)
    made_of = {"split": 0, "part": "learn", "pictures": "clean+cluttered", "seed": 0, "count": 12}
    assert header["demonstrations"] == {**made_of, "calibrated": "clean"}
    assert header["training"]["demonstrations"] == 24
    assert (header["training"]["config"]["augment"], header["training"]["epochs"]) == (1, 2)
    assert header["network"]["encoder"] == "conv"


def test_robustness_is_a_table(tmp_path: Path) -> None:
    few = robustness.Subject("towers", "tower", "sinkhorn", {"variant": "unique"})
    records = robustness.reproduce(tmp_path, subjects=[few], count=2)
    page = (tmp_path / "report.md").read_text()
    assert page == robustness.report(records)
    for name in (*robustness.STYLES, *PERTURBATIONS, *SOMETHING_ELSE):
        assert f"| {name} |" in page


@pytest.mark.parametrize("domain", ["tower"])
@pytest.mark.parametrize("name", list(SOMETHING_ELSE))
def test_pictures_of_something_else_do_little_harm(domain: str, name: str) -> None:
    family = ns.load_domain(domain)
    problems = family.observed([family.problem(n) for n in family.numbers("test")[:40]])
    pictures = SOMETHING_ELSE[name](np.stack([p.observation for p in problems]), np.random.default_rng(0))
    fooled = ns.load_prior("sinkhorn").scores([p.with_pictures(own) for p, own in zip(problems, pictures)])
    plain = np.mean([ns.solve(p, rng=seed).iterations for p in problems for seed in range(2)])
    assert np.mean([ns.solve(p, prior=s, rng=0).iterations for p, s in zip(problems, fooled)]) <= 1.2 * plain
