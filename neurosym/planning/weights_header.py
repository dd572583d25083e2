"""The JSON header of a weights file, read without the network library that wrote it.

A safetensors file starts with the header's length (8 bytes, little-endian) and the header, JSON; under
``__metadata__`` it carries strings. Ours holds one, ``neurosym``: a JSON object that says prior, domain,
actions, network and training figures.
"""

import json
from pathlib import Path
from typing import Any

from neurosym.errors import CheckpointError

#: Bytes that a header may have; ours have a few thousand.
MAX_HEADER = 1 << 22


def read_header(path: Path) -> dict[str, Any]:
    """What a weights file says of itself. Raises `CheckpointError` for anything but a file of ours."""
    try:
        with open(path, "rb") as file:
            length = int.from_bytes(file.read(8), "little")
            if length > MAX_HEADER:
                raise ValueError("its header's length is out of range")
            header = json.loads(file.read(length))
        ours = json.loads(header["__metadata__"]["neurosym"])
        if not isinstance(ours, dict):
            raise ValueError("its header is not an object")
    except FileNotFoundError:
        raise CheckpointError(f"Expected a weights file at {path}; none is there: `neurosym train` makes it.") from None
    except OSError as error:
        raise CheckpointError(f"Expected to read the weights file {path}; got: {error}.") from None
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise CheckpointError(
            f"Expected {path} to be a safetensors file written by `neurosym train`; it is not ({error})."
        ) from None
    return ours
