"""Weights and training state on disk: safetensors with a JSON header. No pickle is written or read.

A file is complete or absent: it is written beside its place and renamed.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import safetensors.torch
import torch
from safetensors import SafetensorError
from torch import Tensor

from learned_priors.networks import NetworkConfig, OrderNetwork
from neurosym.errors import CheckpointError
from neurosym.planning.weights_header import read_header
from neurosym.support.documents import MAX_BYTES, read_bytes
from neurosym.support.files import written_whole

#: Of the header; raised when an older reader would misread a file.
SCHEMA = 1


def write_tensors(path: Path, tensors: Mapping[str, Tensor], header: Mapping[str, Any]) -> None:
    """Write tensors and a header; equal input gives equal bytes."""
    # One metadata key holding sorted JSON: safetensors keeps no order among several.
    plain = {name: tensor.detach().cpu().contiguous() for name, tensor in tensors.items()}
    text = json.dumps({"schema": SCHEMA, **header, "digest": _digest(plain)}, sort_keys=True)
    data = safetensors.torch.save(plain, metadata={"neurosym": text})
    with written_whole(path) as file:
        file.write(data)


def read_tensors(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """What `write_tensors` wrote. Raises `CheckpointError` for a damaged file or one of another schema."""
    header = read_header(path)
    if header.get("schema") != SCHEMA:
        raise CheckpointError(
            f"Expected schema {SCHEMA} in {path}; got {header.get('schema')!r}. "
            "It was written by another version: train again, or install that version."
        )
    data = read_bytes(path, MAX_BYTES, CheckpointError)
    advice = "Make it again; a training starts over without it (resume=False; --no-resume on the command line)."
    try:
        tensors = safetensors.torch.load(data)
    except (SafetensorError, ValueError) as error:
        raise CheckpointError(f"Expected {path} to be whole; it is damaged ({error}). {advice}") from None
    # Files of 0.1 have no digest.
    if header.get("digest", (own := _digest(tensors))) != own:
        raise CheckpointError(f"Expected {path} to be whole; its numbers are not those that were written. {advice}")
    return tensors, header


def _digest(tensors: Mapping[str, Tensor]) -> str:
    """Of names, types, shapes and bytes."""
    hashed = hashlib.sha256()
    for name, tensor in sorted(tensors.items()):
        hashed.update(f"{name} {tensor.dtype} {tuple(tensor.shape)}".encode())
        hashed.update(tensor.reshape(-1).view(torch.uint8).numpy().tobytes())
    return hashed.hexdigest()


def save_network(path: Path, network: OrderNetwork, header: Mapping[str, Any]) -> None:
    """Write a network's weights in float16 (`fit` rounds them to it, so nothing is lost) and its header."""
    if path.suffix != ".safetensors":
        raise CheckpointError(f"Expected a file name that ends in .safetensors; got {path.name!r}.")
    tensors = in_precision(network.state_dict(), torch.float16)
    write_tensors(path, tensors, {**header, "network": network.config.to_json()})


def load_network(path: Path) -> tuple[OrderNetwork, dict[str, Any]]:
    """A network in float32 on the CPU, ready to read, and its header."""
    tensors, header = read_tensors(path)
    actions, given = header.get("actions"), header.get("network")
    if not isinstance(given, dict) or not isinstance(actions, list) or not all(isinstance(a, str) for a in actions):
        raise CheckpointError(f"Expected {path} to say in its header: prior, domain, actions, network; it does not.")
    config = NetworkConfig.from_json(given)
    if len(actions) != config.n_actions:
        raise CheckpointError(f"Expected {config.n_actions} action names in {path}; got {len(actions)}.")
    # On the meta device nothing is allocated or drawn: shapes are compared before memory is asked for.
    with torch.device("meta"):
        network = OrderNetwork(config)
    expected, got = ({n: tuple(t.shape) for n, t in d.items()} for d in (network.state_dict(), tensors))
    if expected != got:
        name = min(n for n in expected.keys() | got.keys() if expected.get(n) != got.get(n))
        raise CheckpointError(
            f"Expected in {path} the weights of the network that its header describes; {name} should be of shape "
            f"{expected.get(name, 'absent')}, got {got.get(name, 'absent')}."
        )
    if not all(bool(torch.isfinite(tensor).all()) for tensor in tensors.values()):
        raise CheckpointError(f"Expected finite weights in {path}; some are not. Train again.")
    network.load_state_dict(in_precision(tensors, torch.float32), assign=True)
    network.requires_grad_(False)
    return network.eval(), header


def in_precision(tensors: Mapping[str, Tensor], dtype: torch.dtype) -> dict[str, Tensor]:
    """The same tensors in another precision; counters stay integers."""
    return {name: tensor.to(dtype) if tensor.is_floating_point() else tensor for name, tensor in tensors.items()}
