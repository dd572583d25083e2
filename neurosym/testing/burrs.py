"""Small burr puzzles with known answers, for tests, documents and trials.

Each is written as layers from the bottom up, side by side: rows go along +y downwards, columns along +x, a letter is a
part and a dot is nothing. Their levels are confirmed in the tests by a search over all subsets of parts.
"""

from dataclasses import dataclass

from neurosym.errors import InputError, UnknownNameError

Cells = dict[str, list[tuple[int, int, int]]]


@dataclass(frozen=True)
class Burr:
    """A puzzle of unit cells.

    `name`: what it is called here. `layers`: the cells, as text. `levels`: the moves of each separation until all parts
    are single (BurrTools' 4.1); None: it cannot be done. `groups`: whether no single part can leave by one straight
    line, but parts together can. `note`: what it shows, in a sentence.
    """

    name: str
    layers: str
    levels: tuple[int, ...] | None
    groups: bool
    note: str

    @property
    def cells(self) -> Cells:
        """Part -> cells (x, y, z), as `Assembly.from_cells` takes them."""
        return read_layers(self.layers)


def read_layers(text: str) -> Cells:
    """Cells (x, y, z) of each letter in layers that stand side by side, the lowest first.

    Raises InputError: rows with different numbers of layers, or no letter at all.
    """
    found: Cells = {}
    rows = [line.split() for line in text.strip().splitlines()]
    if len({len(row) for row in rows}) != 1:
        raise InputError("Expected layers side by side, as many in each row; their numbers differ.")
    for y, row in enumerate(rows):
        for z, layer in enumerate(row):
            for x, letter in enumerate(layer):
                if letter != ".":
                    found.setdefault(letter, []).append((x, y, z))
    if not found:
        raise InputError("Expected layers with a letter for each cell of a part; got none.")
    return dict(sorted(found.items()))


STRAIGHT = Burr(
    "straight",
    """
    .ba  daa  ddc
    bba  aaa  dcc
    bee  .ae  ..c
    """,
    (1, 1, 1, 1),
    False,
    "Five parts that leave one by one, each along a straight line.",
)

PAIRS = Burr(
    "pairs",
    """
    dcc.  dcbb  dddb
    daaa  .cba  ccd.
    dab.  aab.  c.dd
    """,
    (1, 1, 1),
    True,
    "No single part can leave along a straight line; a and b leave together, and then come apart.",
)

LEVEL_4 = Burr(
    "level-4",
    """
    aaa  ..a  bba
    a.b  bcb  bca
    bbb  bc.  aaa
    """,
    (4, 1),
    False,
    "Three parts of which none, and no group, leaves before three of them have been moved by one cell.",
)

BOLTS = Burr(
    "bolts",
    """
    ffffff  ffffff  ffffff  fff...
    ffffff  fffssf  f.aasf  fff...
    ffffff  fffssf  f.bbsf  fff...
    ffffff  ffffff  ffffff  fff...
    """,
    (2, 2, 1),
    False,
    "Two bolts, a and b, hold the lid s; drawn back together they are one move, one after the other they are two.",
)

RINGS = Burr(
    "rings",
    """
    ......  aaaa..  ......  ......
    ..bbbb  a.ba.b  ..b..b  ..bbbb
    ......  a..a..  ......  ......
    ......  aaaa..  ......  ......
    """,
    None,
    False,
    "Two links of a chain, with play: a and b hold one another, whatever is done.",
)

#: All of them by name.
BURRS = {burr.name: burr for burr in (STRAIGHT, PAIRS, LEVEL_4, BOLTS, RINGS)}


def burr(name: str) -> Burr:
    """One of them by its name. Raises UnknownNameError: there is none of that name."""
    if name not in BURRS:
        raise UnknownNameError("burr puzzle", name, BURRS)
    return BURRS[name]
