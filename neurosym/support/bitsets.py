"""Sets of small numbers as Python integers, a bit a number."""

import itertools

import numpy as np

from neurosym.support.arrays import Numbers, Truths

#: Up to so many bodies a table of all pairs is filled at once (16 MB).
_DENSE = 4_000

#: From so many bits on, arrays unpack them sooner than integers do.
_MANY = 32


def bitsets(pairs: Numbers, count: int) -> list[int]:
    """For pairs (i, j), int64 (k, 2), of numbers below `count`: per i, a bitset of its j."""
    if count <= _DENSE:
        table = np.zeros((count, count), dtype=bool)
        table[pairs[:, 0], pairs[:, 1]] = True
        rows = np.packbits(table, axis=1, bitorder="little")
        width, packed = rows.shape[1], rows.tobytes()
        return [int.from_bytes(packed[width * i : width * (i + 1)], "little") for i in range(count)]
    found = []
    order = np.argsort(pairs[:, 0], kind="stable")
    ends = np.searchsorted(pairs[order, 0], np.arange(count + 1))
    for start, stop in itertools.pairwise(ends):
        row = np.zeros(count, dtype=bool)
        row[pairs[order[start:stop], 1]] = True
        found.append(int.from_bytes(np.packbits(row, bitorder="little").tobytes(), "little"))
    return found


def bits(mask: int) -> list[int]:
    """Numbers of the bits that are set."""
    if mask.bit_count() > _MANY:
        return np.flatnonzero(members(mask, mask.bit_length())).tolist()
    found = []
    while mask:
        low = mask & -mask
        found.append(low.bit_length() - 1)
        mask ^= low
    return found


def members(mask: int, count: int) -> Truths:
    """bool (count,): which of the first bits are set."""
    packed = (mask & (1 << count) - 1).to_bytes(-(-count // 8), "little")
    return np.unpackbits(np.frombuffer(packed, dtype=np.uint8), count=count, bitorder="little").astype(bool)
