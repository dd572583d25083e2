"""Small assemblies of cells, with what is to be learned from each: the numbered problems of the domain "assembly"."""

from itertools import product

from neurosym.errors import InputError
from neurosym.geometry.assembly import Assembly

Cells = dict[str, list[tuple[int, int, int]]]


def _block(x: tuple[int, int], y: tuple[int, int], z: tuple[int, int]) -> list[tuple[int, int, int]]:
    """The cells of a box: from the first (included) to the second (excluded) along each axis."""
    return list(product(range(*x), range(*y), range(*z)))


#: A seat on four legs: under gravity at most one leg leaves before the seat.
STOOL: Cells = {
    "seat": _block((0, 5), (0, 5), (3, 4)),
    **{f"leg {k}": _block((x, x + 1), (y, y + 1), (0, 3)) for k, (x, y) in enumerate(product((0, 4), repeat=2))},
}

#: A ball in a box under a lid: the lid first, then the ball.
BOX: Cells = {
    "box": [c for c in _block((0, 3), (0, 3), (0, 2)) if c != (1, 1, 1)],
    "ball": [(1, 1, 1)],
    "lid": _block((0, 3), (0, 3), (2, 3)),
}

#: Two courses of three bricks in a running bond.
WALL: Cells = {
    **{f"low {k}": _block((2 * k, 2 * k + 2), (0, 1), (0, 1)) for k in range(3)},
    **{f"high {k}": _block((2 * k + 1, 2 * k + 3), (0, 1), (1, 2)) for k in range(2)},
}

#: A beam on two posts with a weight on each end: the beam cannot leave before the weights.
GATE: Cells = {
    "post 0": _block((0, 1), (0, 1), (0, 2)),
    "post 1": _block((4, 5), (0, 1), (0, 2)),
    "beam": _block((0, 5), (0, 1), (2, 3)),
    "weight 0": [(0, 0, 3)],
    "weight 1": [(4, 0, 3)],
}

#: A lever that balances while both weights lie on it: the weights leave it one by one only where the fulcrum is wide.
LEVER: Cells = {
    "fulcrum": _block((1, 4), (0, 1), (0, 1)),
    "lever": _block((0, 5), (0, 1), (1, 2)),
    "left": [(0, 0, 2)],
    "right": [(4, 0, 2)],
}

#: A drawer in a case behind a bolt: out sideways, one after the other.
DRAWER: Cells = {
    "case": [c for c in _block((0, 4), (0, 3), (0, 3)) if not (c[1] == 1 and c[2] == 1 and c[0] > 0)],
    "drawer": _block((1, 3), (1, 2), (1, 2)),
    "bolt": [(3, 1, 1)],
}

#: The samples in order: name -> cells. The first `TRAINING` are the training part.
SAMPLES: dict[str, Cells] = {
    "stool": STOOL,
    "box": BOX,
    "wall": WALL,
    "gate": GATE,
    "lever": LEVER,
    "drawer": DRAWER,
}
TRAINING = 3


def sample(number: int) -> tuple[Assembly, str]:
    """A sample by its number, and its name."""
    if not 0 <= number < len(SAMPLES):
        raise InputError(f"Expected the number of a sample, 0 to {len(SAMPLES) - 1}; got {number!r}.")
    name = list(SAMPLES)[number]
    return Assembly.from_cells(SAMPLES[name]), name
