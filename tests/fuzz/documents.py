"""Documents of every kind, whole and broken: what reads them answers, or refuses in a sentence."""

from __future__ import annotations

import copy
import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from typer.testing import CliRunner

import neurosym as ns
from neurosym import cli
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.plan_files.reading import read_search

#: A message is no longer than this.
LONGEST = 1_000

#: What takes the place of a value.
ODD: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    3,
    1 << 70,
    0.5,
    1e-300,
    1e12,
    1e300,
    float("nan"),
    float("inf"),
    "",
    "a",
    "\ud800",
    "\u4e2d\U0001f600\n",
    "x" * 5_000,
    [],
    [[]],
    [0, 0, 0],
    {},
    {"a": 1},
    [[[[[[1]]]]]],
)


def mutated(document: Any, rng: np.random.Generator) -> Any:
    """The document with one to three of its values replaced, left out, doubled or moved."""
    document = copy.deepcopy(document)
    for _ in range(int(rng.integers(1, 4))):
        places = list(_places(document))
        if not places:
            return document
        holder, key = places[int(rng.integers(len(places)))]
        match int(rng.integers(6)):
            case 0:
                del holder[key]
            case 1:
                other_holder, other = places[int(rng.integers(len(places)))]
                holder[key] = copy.deepcopy(other_holder[other])
            case 2 if isinstance(holder, list):
                holder.append(copy.deepcopy(holder[key]))
            case _:
                holder[key] = copy.deepcopy(ODD[int(rng.integers(len(ODD)))])
    return document


def _places(value: Any) -> Any:
    pairs = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in list(pairs):
        yield value, key
        yield from _places(inner)


def damaged(data: bytes, rng: np.random.Generator) -> bytes:
    """Bytes, some of them changed, cut out, repeated, or the end cut off."""
    found = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        if not found:
            break
        at, size = int(rng.integers(len(found))), int(rng.integers(1, 64))
        match int(rng.integers(5)):
            case 0:
                found[at : at + size] = rng.bytes(size)
            case 1:
                del found[at : at + size]
            case 2:
                found[at:at] = found[at : at + size]
            case 3:
                found[at] ^= 1 << int(rng.integers(8))
            case _:
                del found[at:]
    return bytes(found)


def read_plan(path: Path) -> None:
    saved = read_search(path)
    saved.account()
    ns.validate(saved.problem, saved.plan, saved.motions)


def read_assembly(path: Path) -> None:
    geometry = AssemblyGeometry(ns.Assembly.load(path))
    geometry.blocking  # noqa: B018
    geometry.stability.standing((1 << len(geometry)) - 1)


def read_weights(path: Path) -> None:
    ns.load_prior(str(path))


READERS: dict[str, Callable[[Path], object]] = {
    "plan": read_plan,
    "assembly": read_assembly,
    "demonstrations": ns.Demonstrations.load,
    "weights": read_weights,
}


def sound(folder: Path) -> dict[str, list[Any]]:
    """Sound documents by kind: JSON as values, others as bytes."""
    cells = {"a": [(0, 0, 0), (1, 0, 0)], "b": [(0, 0, 1), (1, 0, 1)], "c": [(0, 1, 0)]}
    assembly = ns.Assembly.from_cells(cells)
    assembly.save(folder / "own.json")
    boxes = {
        "format": "neurosym-assembly",
        "schema": 1,
        "fixed": ["a"],
        "table": 0.0,
        "parts": [
            {"name": "a", "cells": [[0, 0, 0]], "pose": np.eye(4).tolist()},
            {"name": "b", "boxes": [{"size": [1, 1, 1], "centre": [0.5, 0.5, 1.5]}]},
            {"name": "c", "density": 2.0, "boxes": [{"size": [1, 1, 1], "centre": [2.5, 0.5, 0.5]}]},
        ],
    }
    plans = []
    for words in (
        ["soma", "--problem", "7"],
        [str(folder / "own.json")],
        ["assembly", "--problem", "1", "--paths", "any"],
    ):
        done = CliRunner().invoke(cli.app, ["plan", *words, "--out", str(folder / "plan.json")])
        assert done.exit_code == 0, done.output
        plans.append(json.loads((folder / "plan.json").read_text()))
    ns.load_domain("tower").demonstrations(count=3).save(folder / "demos.npz")
    weights = Path(str(ns.__file__)).parents[1] / "learned_priors" / "weights"
    return {
        "plan": plans,
        "assembly": [json.loads((folder / "own.json").read_text()), boxes],
        "demonstrations": [(folder / "demos.npz").read_bytes()],
        "weights": [min(weights.glob("*.safetensors"), key=lambda p: p.stat().st_size).read_bytes()],
    }


def trial(kind: str, whole: Any, rng: np.random.Generator, folder: Path) -> str | None:
    """Break a document and read it: None where it was read or refused well, else what went wrong."""
    if isinstance(whole, bytes):
        path = folder / {"demonstrations": "x.npz", "weights": "x.safetensors"}[kind]
        path.write_bytes(damaged(whole, rng))
    else:
        path = folder / "x.json"
        text = json.dumps(mutated(whole, rng))
        path.write_bytes(text.encode() if rng.random() < 0.8 else damaged(text.encode(), rng))
    try:
        READERS[kind](path)
    except ns.NeurosymError as error:
        return (
            None if len(str(error)) <= LONGEST else f"a message of {len(str(error)):,} characters: {str(error)[:200]}"
        )
    except Exception as error:
        return f"{type(error).__name__}: {error}"[:300]
    return None


def run(count: int, seed: int = 0) -> list[tuple[str, int, str]]:
    """So many broken documents: those that were not refused well, by kind and number of the trial."""
    failures = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        documents = [(kind, whole) for kind, own in sound(folder).items() for whole in own]
        for number in range(count):
            rng = np.random.default_rng([seed, number])
            kind, whole = documents[number % len(documents)]
            wrong = trial(kind, whole, rng, folder)
            if wrong is not None:
                failures.append((kind, number, wrong))
    return failures
