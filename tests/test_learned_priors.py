"""Network priors: reading, loading, choosing bundled weights, and the conformance suite, which must be able to fail."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
import torch

from learned_priors.checkpoints import load_network, read_tensors, write_tensors
from learned_priors.encoders import SmallEncoder, build_encoder, encoder_names, register_encoder
from learned_priors.heads import TemporalDecoder, dilations
from learned_priors.network_prior import NetworkPrior
from learned_priors.networks import NetworkConfig, OrderNetwork
from learned_priors.recipes import RECIPES
from learned_priors.weight_files import FOLDER
from neurosym.errors import CheckpointError, ContractError, InputError, UnknownNameError
from neurosym.language.demonstrations import Demonstrations
from neurosym.planning.order_scores import OrderScores
from neurosym.planning.prior import Prior, RandomPrior, UniformPrior
from neurosym.planning.weights_header import read_header
from neurosym.registry import load_prior
from neurosym.testing.priors import check_prior

ACTIONS = ("red", "green", "blue", "yellow")


@dataclass(frozen=True, eq=False)
class Shown:
    """As much of a problem as a picture prior may read."""

    observation: np.ndarray | None
    actions: tuple[str, ...] = ACTIONS
    classes: tuple[int, ...] = (0, 1, 2, 3)
    name: str = "shown"
    family: str | None = None


def random_demonstrations(m: int = 24, *, n: int = 4, side: int = 8, domain: str = "toys") -> Demonstrations:
    rng = np.random.default_rng(0)
    pictures = rng.integers(0, 256, (m, 2, side, side, 3), dtype=np.uint8)
    orders = np.stack([rng.permutation(n) for _ in range(m)])
    return Demonstrations(pictures, orders, ACTIONS[:n], np.eye(n, dtype=np.float32)[orders], domain=domain)


DEMOS = random_demonstrations()


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    """Two threads on a busy machine can be tens of times slower than one."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def prior() -> NetworkPrior:
    return NetworkPrior("sinkhorn").fit(DEMOS, epochs=30)


@pytest.fixture(scope="module")
def file(prior: NetworkPrior, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return prior.save(tmp_path_factory.mktemp("weights") / "toys-sinkhorn.safetensors")


def problems(count: int = 6) -> list[Shown]:
    return [Shown(DEMOS.pictures[k], name=f"toy {k}") for k in range(count)]


# Reading


def test_reading_one_set_of_pictures_or_a_batch(prior: NetworkPrior) -> None:
    one = prior.read(DEMOS.pictures[0])
    assert isinstance(one, OrderScores)
    assert one.actions == ACTIONS
    assert one.log_prob.shape == (4, 4)
    assert one.log_prob.dtype == np.float64
    batch = prior.read(DEMOS.pictures[:5])
    assert isinstance(batch, list)
    assert len(batch) == 5
    assert prior.read(DEMOS.pictures[:0]) == []
    assert sorted(one.names()) == sorted(ACTIONS)


@pytest.mark.parametrize("name", ["sinkhorn", "tcn"])
def test_a_picture_alone_or_in_a_batch_gets_the_same_scores(name: str) -> None:
    prior = NetworkPrior(name).fit(random_demonstrations(300), epochs=4)
    pictures = random_demonstrations(300).pictures
    batch = prior.read(pictures)
    for k in range(0, 300, 37):
        assert np.abs(prior.read(pictures[k]).log_prob - batch[k].log_prob).max() < 1e-5


def test_scores_of_the_sinkhorn_prior_are_doubly_stochastic(prior: NetworkPrior) -> None:
    for scores in prior.read(DEMOS.pictures):
        p = np.exp(scores.log_prob)
        assert np.allclose(p.sum(axis=1), 1, atol=1e-9)
        assert np.allclose(p.sum(axis=0), 1, atol=2e-3)


def test_scores_follow_the_problem_and_its_pictures(prior: NetworkPrior) -> None:
    found = prior.scores(problems())
    for scores, expected in zip(found, prior.read(DEMOS.pictures[:6])):
        assert np.allclose(scores.log_prob, expected.log_prob, atol=1e-5)
    order = ("blue", "yellow", "red", "green")
    (moved,) = prior.scores([replace(problems()[0], actions=order, classes=(0, 1, 0, 2))])
    assert moved.actions == order
    assert moved.classes == (0, 1, 0, 2)
    assert np.allclose(moved.log_prob[:, order.index("red")], found[0].log_prob[:, 0], atol=1e-5)


def test_a_partial_start_gets_the_last_steps(prior: NetworkPrior) -> None:
    (scores,) = prior.scores([replace(problems()[0], actions=("yellow", "red"), classes=(0, 1))])
    assert scores.actions == ("yellow", "red")
    assert scores.log_prob.shape == (2, 2)
    whole = prior.read(DEMOS.pictures[0]).restricted(("yellow", "red"))
    assert np.allclose(scores.log_prob, whole.log_prob, atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"observation": None}, "with_pictures"),
        ({"observation": DEMOS.pictures[0][:1]}, r"\(2, 8, 8, 3\).*\(1, 8, 8, 3\)"),
        ({"observation": DEMOS.pictures[0].astype(np.float32)}, "uint8.*float32"),
        ({"actions": ("red", "green", "blue", "pink")}, "pink"),
    ],
)
def test_what_a_problem_lacks_is_named(prior: NetworkPrior, change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        prior.scores([problems()[0], replace(problems()[1], **change)])


def test_pictures_of_another_shape_are_refused(prior: NetworkPrior) -> None:
    with pytest.raises(InputError, match=r"\(2, 8, 8, 3\).*\(2, 9, 8, 3\)"):
        prior.read(np.zeros((2, 9, 8, 3), np.uint8))
    with pytest.raises(InputError, match="uint8"):
        prior.read(np.zeros((2, 8, 8, 3)))


def test_a_device_that_is_not_there_is_named() -> None:
    with pytest.raises(InputError, match="'cpu' or 'cuda'"):
        NetworkPrior("sinkhorn", device="abacus")
    if not torch.cuda.is_available():
        with pytest.raises(InputError, match="CUDA"):
            NetworkPrior("sinkhorn", device="cuda")


# Files


def test_saved_and_loaded_scores_are_equal(prior: NetworkPrior, file: Path) -> None:
    loaded = load_prior(file)
    assert isinstance(loaded, NetworkPrior)
    for a, b in zip(prior.read(DEMOS.pictures), loaded.read(DEMOS.pictures)):
        assert np.array_equal(a.log_prob, b.log_prob)
    assert loaded.header["actions"] == list(ACTIONS)
    assert loaded.header["domain"] == "toys"
    assert loaded.header["network"]["picture_shape"] == [2, 8, 8, 3]
    assert loaded.header["training"]["seed"] == 0
    assert loaded.save(file.with_name("again.safetensors")).read_bytes() == file.read_bytes()


def test_the_same_seed_gives_the_same_scores_in_another_process(file: Path, tmp_path: Path) -> None:
    code = f"""
import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})
import numpy as np, torch
torch.set_num_threads(1)
from test_learned_priors import DEMOS, NetworkPrior
trained = NetworkPrior("sinkhorn").fit(DEMOS, epochs=30).read(DEMOS.pictures)
loaded = NetworkPrior("sinkhorn", weights={str(file)!r}).read(DEMOS.pictures)
np.save({str(tmp_path / "scores.npy")!r}, [[s.log_prob for s in found] for found in (trained, loaded)])
"""
    subprocess.run([sys.executable, "-c", code], check=True)
    here = [s.log_prob for s in NetworkPrior("sinkhorn", weights=file).read(DEMOS.pictures)]
    trained, loaded = np.load(tmp_path / "scores.npy")
    assert np.array_equal(here, loaded)
    assert np.array_equal(here, trained)


def test_a_damaged_file_is_refused(file: Path, tmp_path: Path) -> None:
    data = file.read_bytes()
    at = tmp_path / "damaged.safetensors"
    for damaged in (data[:-10], data[:100], b"", b"PK\x03\x04" + data, data[:8] + b"\xff" * 50 + data[58:]):
        at.write_bytes(damaged)
        with pytest.raises(CheckpointError, match=r"damaged\.safetensors"):
            NetworkPrior("sinkhorn", weights=at)
    with pytest.raises(CheckpointError, match=r"absent\.safetensors"):
        NetworkPrior("sinkhorn", weights=tmp_path / "absent.safetensors")


def test_a_pickle_is_never_loaded(tmp_path: Path) -> None:
    class Trap:
        def __reduce__(self) -> tuple[Callable[..., object], tuple[str]]:
            return exec, ("raise SystemExit('a pickle was loaded')",)

    at = tmp_path / "trap.safetensors"
    at.write_bytes(pickle.dumps(Trap()))
    with pytest.raises(CheckpointError):
        load_prior(at)
    torch.save({"w": torch.zeros(1)}, at)
    with pytest.raises(CheckpointError):
        load_prior(at)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": 99}, "schema 1"),
        ({"actions": ["red", "green", "blue"]}, "4 action names"),
        ({"actions": None}, "say in its header"),
        ({"network": {"encoder": "small"}}, "header whose network"),
        ({"n_steps": 3}, "should be of shape"),
        ({"n_steps": 10**9}, "more steps than actions"),
        ({"width": 10**9}, "should be of shape"),
        ({"width": -1}, "positive integers"),
        ({"decoding": "magic"}, "decoding 'magic'"),
        ({"encoder": "none"}, "picture encoder"),
        ({"prior": "tcn"}, "those of 'tcn'"),
    ],
)
def test_a_header_that_does_not_fit_is_refused(file: Path, tmp_path: Path, change: dict, message: str) -> None:
    tensors, header = read_tensors(file)
    network = header["network"]
    for key, value in change.items():
        if key in network:
            network[key] = value
        else:
            header[key] = value
    at = tmp_path / "other.safetensors"
    write_tensors(at, tensors, header)
    if change == {"schema": 99}:
        text = at.read_bytes()
        assert b"99" in text
    with pytest.raises(InputError, match=message):
        NetworkPrior("sinkhorn", weights=at)


def test_weights_that_are_not_finite_are_refused(file: Path, tmp_path: Path) -> None:
    tensors, header = read_tensors(file)
    next(iter(tensors.values())).fill_(torch.nan)
    write_tensors(tmp_path / "nan.safetensors", tensors, header)
    with pytest.raises(CheckpointError, match="finite"):
        load_network(tmp_path / "nan.safetensors")


def test_saving_leaves_no_half_file(prior: NetworkPrior, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    at = prior.save(tmp_path / "w.safetensors")
    before = at.read_bytes()

    def fail(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr("os.replace", fail)
    with pytest.raises(OSError, match="no space"):
        prior.save(at)
    assert [p.name for p in tmp_path.iterdir()] == ["w.safetensors"]
    assert at.read_bytes() == before


def test_saving_needs_weights_and_a_name(prior: NetworkPrior, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="Call fit"):
        NetworkPrior("sinkhorn").save(tmp_path / "w.safetensors")
    with pytest.raises(CheckpointError, match=r"\.safetensors"):
        prior.save(tmp_path / "w.pt")


# Bundled weights


@pytest.fixture
def folder(file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "toys-sinkhorn.safetensors").write_bytes(file.read_bytes())
    larger = replace(random_demonstrations(side=16, domain="big"), actions=("one", "two", "three", "four"))
    NetworkPrior("sinkhorn").fit(larger, epochs=1).save(tmp_path / "big-sinkhorn.safetensors")
    monkeypatch.setattr("learned_priors.weight_files.FOLDER", tmp_path)
    return tmp_path


def test_bundled_weights_answer_for_family_actions_or_pictures(folder: Path) -> None:
    prior = load_prior("sinkhorn")
    assert isinstance(prior, NetworkPrior)
    by_family, by_actions = prior.scores([replace(problems()[0], family="toys"), problems()[0]])
    assert np.array_equal(by_family.log_prob, by_actions.log_prob)
    assert prior.read(DEMOS.pictures[0]).actions == ACTIONS
    big = random_demonstrations(side=16).pictures
    assert prior.read(big[0]).actions == ("one", "two", "three", "four")
    both = prior.scores([problems()[0], Shown(big[0], actions=("four", "two", "one", "three")), problems()[1]])
    assert [s.actions[0] for s in both] == ["red", "four", "red"]
    with pytest.raises(InputError, match=r"\(2, 16, 16, 3\)"):
        load_prior("sinkhorn", domain="big").read(DEMOS.pictures[0])


def test_none_or_several_bundled_weights_are_named(folder: Path) -> None:
    prior = load_prior("sinkhorn")
    with pytest.raises(InputError, match=r"big, toys.*neurosym train"):
        prior.read(np.zeros((1, 8, 8, 3), np.uint8))
    with pytest.raises(InputError, match=r"pink.*big, toys"):
        prior.scores([replace(problems()[0], actions=("pink",), classes=(0,))])
    with pytest.raises(InputError, match=r"'cars'.*big, toys"):
        load_prior("sinkhorn", domain="cars").read(DEMOS.pictures[0])
    with pytest.raises(InputError, match="nothing"):
        load_prior("tcn").read(DEMOS.pictures[0])
    NetworkPrior("sinkhorn").fit(random_demonstrations(domain="toys2"), epochs=1).save(
        folder / "toys2-sinkhorn.safetensors"
    )
    with pytest.raises(InputError, match=r"several: toys, toys2.*domain=NAME"):
        load_prior("sinkhorn").read(DEMOS.pictures[0])


def test_bundled_weights_are_small_and_say_what_they_are() -> None:
    for path in FOLDER.glob("*.safetensors"):
        header = read_header(path)
        assert path.name.startswith(f"{header['domain']}-")
        assert path.name.endswith(f"-{header['prior']}.safetensors")
        assert path.stat().st_size < 2**20
        assert {"seed", "epochs", "demonstrations", "seconds", "train_loss"} <= header["training"].keys()
        if "actions" in header:  # a network that reads pictures
            assert load_network(path)[0].config.encoder == "small"


# Networks


@pytest.mark.parametrize("name", sorted(RECIPES))
@pytest.mark.parametrize("encoder", ["small", "paper"])
def test_every_recipe_trains_with_every_encoder(name: str, encoder: str, tmp_path: Path) -> None:
    learn = random_demonstrations(6, side=40)
    prior = load_prior(name, encoder=encoder)
    assert isinstance(prior, NetworkPrior)
    prior.fit(learn, epochs=1)
    loaded = load_prior(prior.save(tmp_path / "w.safetensors"))
    assert isinstance(loaded, NetworkPrior)
    assert loaded.recipe.name == name
    assert loaded.header["network"]["encoder"] == encoder
    other = "paper" if encoder == "small" else "small"
    with pytest.raises(CheckpointError, match="encoder=None"):
        load_prior(name, weights=tmp_path / "w.safetensors", encoder=other)


@pytest.mark.parametrize("size", [(64, 64), (16, 16), (48, 32), (320, 256), (8, 8), (30, 50)])
def test_the_small_encoder_pools_means(size: tuple[int, int]) -> None:
    views = np.random.default_rng(0).integers(0, 256, (2, 3, *size, 3), dtype=np.uint8)
    prepared = SmallEncoder((3, *size, 3)).prepare(torch.from_numpy(views)).reshape(6, 16, 16, 3)
    channels_first = torch.from_numpy(views).flatten(0, 1).permute(0, 3, 1, 2).double()
    expected = torch.nn.functional.adaptive_avg_pool2d(channels_first, 16).permute(0, 2, 3, 1)
    torch.testing.assert_close(prepared.double() * 127.5 + 127.5, expected, atol=1e-4, rtol=0)


@pytest.mark.parametrize("size", [(8, 24), (32, 192), (30, 65)])
def test_the_small_encoder_cuts_long_pictures_into_squares(size: tuple[int, int]) -> None:
    """A tile is prepared alike wherever it lies in its row; an upright picture is cut from the top."""
    count = size[1] // size[0]
    wide = np.random.default_rng(0).integers(0, 256, (2, 3, *size, 3), dtype=np.uint8)
    expected = torch.nn.functional.adaptive_avg_pool2d(
        torch.from_numpy(wide).flatten(0, 1).permute(0, 3, 1, 2).double(), (16, 16 * count)
    )
    squares = torch.stack(expected.chunk(count, dim=3), dim=1).permute(0, 1, 3, 4, 2).reshape(2, 3 * count, -1)
    encoder = SmallEncoder((3, *size, 3)).eval()
    prepared = encoder.prepare(torch.from_numpy(wide))
    torch.testing.assert_close(prepared.double() * 127.5 + 127.5, squares, atol=1e-4, rtol=0)
    assert encoder(prepared).shape == (2, encoder.out_features)
    tall = np.ascontiguousarray(wide.swapaxes(2, 3))
    turned = SmallEncoder((3, *size[::-1], 3)).prepare(torch.from_numpy(tall)).reshape(2, 3 * count, 16, 16, 3)
    across = prepared.reshape(2, 3 * count, 16, 16, 3).transpose(2, 3)
    torch.testing.assert_close(turned, across, atol=1e-5, rtol=0)


def test_the_papers_encoder_has_the_papers_layers() -> None:
    encoder = build_encoder("paper", (4, 64, 64, 3))
    shapes = [tuple(p.shape) for p in encoder.parameters() if p.ndim > 1]
    assert shapes == [(32, 12, 5, 5), (64, 32, 5, 5), (128, 64, 5, 5), (256, 128, 5, 5), (128, 256 * 4 * 4)]
    with pytest.raises(InputError, match="40 x 40"):
        build_encoder("paper", (4, 32, 64, 3))


def test_encoders_can_be_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("learned_priors.encoders._ENCODERS", {"small": SmallEncoder})
    register_encoder("thin", lambda shape: SmallEncoder(shape, hidden=8, view=4, out_features=8))
    assert encoder_names() == ["small", "thin"]
    NetworkPrior("sinkhorn", encoder="thin").fit(DEMOS, epochs=1)
    with pytest.raises(InputError, match="no encoder has yet"):
        register_encoder("small", lambda shape: SmallEncoder(shape))
    with pytest.raises(UnknownNameError, match="Did you mean 'thin'"):
        build_encoder("thinn", (1, 8, 8, 3))


def test_the_temporal_decoder_has_a_layer_a_step_and_looks_back_only() -> None:
    assert dilations(1) == (1,)
    assert dilations(7) == (1, 2, 4, 1, 2, 4, 1)
    decoder = TemporalDecoder(8, 7, 5, width=4).eval()
    assert len(decoder.layers) == 7
    states = torch.randn(1, 4, 7, requires_grad=True)
    decoder.states = torch.nn.Flatten()  # type: ignore[assignment]
    logits = decoder(states)
    assert logits.shape == (1, 7, 5)
    logits[0, 3].sum().backward()
    assert states.grad is not None
    reached = states.grad.abs().sum(dim=(0, 1)) > 0
    assert reached.tolist() == [True] * 4 + [False] * 3


def test_a_network_config_survives_json() -> None:
    config = NetworkConfig("small", "tcn", "rows", (2, 8, 8, 3), 3, 4, 16)
    assert NetworkConfig.from_json(json.loads(json.dumps(config.to_json()))) == config
    assert OrderNetwork(config)(torch.zeros(5, 2, 768)).order.shape == (5, 3, 4)


def test_importing_the_package_does_not_import_torch() -> None:
    code = "import sys, learned_priors as p; dir(p); assert 'torch' not in sys.modules; p.NetworkPrior"
    subprocess.run([sys.executable, "-c", code], check=True)
    import learned_priors

    for name in learned_priors.__all__:
        assert getattr(learned_priors, name) is not None


def test_one_problem_is_read_in_milliseconds() -> None:
    learn = replace(random_demonstrations(4, side=64), domain="")
    prior = NetworkPrior("sinkhorn").fit(learn, epochs=1)
    prior.read(learn.pictures[0])
    times = []
    for _ in range(10):
        start = time.perf_counter()
        prior.read(learn.pictures[0])
        times.append(time.perf_counter() - start)
    assert min(times) < 0.01, "a guard against slowness by a factor; benchmarks/ has the figure"


# The conformance suite


def test_ours_pass_the_conformance_suite(prior: NetworkPrior) -> None:
    shown = [*problems(), replace(problems()[0], actions=("blue", "red"), classes=(0, 0), name="half done")]
    check_prior(prior, shown, pictures_only=True)
    check_prior(UniformPrior(), shown)
    check_prior(RandomPrior(), shown)


class Broken(Prior):
    """A prior that keeps every promise but the one that a test breaks."""

    def __init__(self, scores: Callable[[Sequence[Shown]], object]) -> None:
        self._scores = scores

    def scores(self, problems):  # type: ignore[no-untyped-def]
        return self._scores(problems)


def uniform(problem: Shown) -> OrderScores:
    return OrderScores.uniform(len(problem.actions), problem.actions)


def sharpened(problem: Shown, amount: float) -> OrderScores:
    return OrderScores(np.eye(len(problem.actions)) * amount, problem.actions)


def changes_pictures(shown: Sequence[Shown]) -> list[OrderScores]:
    for problem in shown:
        assert problem.observation is not None
        np.add(problem.observation, 1, out=problem.observation)
    return [uniform(p) for p in shown]


def seeds_the_global_generator(shown: Sequence[Shown]) -> list[OrderScores]:
    np.random.seed(0)  # noqa: NPY002
    return [uniform(p) for p in shown]


CALLS = iter(range(1000))

BROKEN: dict[str, tuple[Callable[[Sequence[Shown]], object], str]] = {
    "a tuple": (lambda ps: tuple(uniform(p) for p in ps), "list of OrderScores"),
    "arrays": (lambda ps: [uniform(p).log_prob for p in ps], "list of OrderScores"),
    "one too few": (lambda ps: [uniform(p) for p in ps[1:]], "One OrderScores"),
    "too many columns": (lambda ps: [OrderScores(np.zeros((2, 5))) for _ in ps], "columns"),
    "columns in another order": (lambda ps: [OrderScores.uniform(4, p.actions[::-1]) for p in ps], "order of its"),
    "classes made up": (lambda ps: [replace(uniform(p), classes=(0,) * 4) for p in ps], "interchangeable"),
    "something for nothing": (lambda ps: [uniform(p) for p in ps] or [uniform(problems()[0])], "One OrderScores"),
    "another answer each time": (lambda ps: [sharpened(p, next(CALLS)) for p in ps], "asked again"),
    "depends on the batch": (lambda ps: [sharpened(p, len(ps)) for p in ps], "asked alone"),
    "depends on the place": (lambda ps: [sharpened(p, k) for k, p in enumerate(ps)], "another order"),
    "changes pictures": (changes_pictures, "not to change pictures"),
    "seeds the global generator": (seeds_the_global_generator, "global generator"),
    "reads the world": (lambda ps: [sharpened(p, len(p.world)) for p in ps], "reads more.*world"),  # type: ignore[attr-defined]
}


@dataclass(frozen=True, eq=False)
class WithWorld(Shown):
    world: str = "geometry"


@pytest.mark.parametrize("slip", BROKEN)
def test_the_conformance_suite_catches(slip: str) -> None:
    scores, message = BROKEN[slip]
    shown = [WithWorld(DEMOS.pictures[k].copy(), name=f"toy {k}") for k in range(3)]
    with pytest.raises(ContractError, match=f"(?i){message}"):
        check_prior(Broken(scores), shown, pictures_only=True)
