"""Units of length: what files state and callers ask for."""

from __future__ import annotations

from neurosym.errors import UnknownNameError

#: Metres in one of each.
METRES = {"um": 1e-6, "mm": 1e-3, "cm": 1e-2, "dm": 1e-1, "m": 1.0, "in": 0.0254, "ft": 0.3048}

_ALSO = {
    "micron": "um", "micrometer": "um", "micrometre": "um", "millimeter": "mm", "millimetre": "mm",
    "centimeter": "cm", "centimetre": "cm", "decimeter": "dm", "decimetre": "dm", "meter": "m", "metre": "m",
    "inch": "in", "foot": "ft",
}  # fmt: skip


def unit(name: str) -> str:
    """The short name of a unit, one of `METRES`, given by it or in words ("inches"); `UnknownNameError` for none."""
    word = str(name).strip().lower()
    for form in (word, word.removesuffix("s"), "inch" if word == "inches" else "foot" if word == "feet" else word):
        known = _ALSO.get(form, form)
        if known in METRES:
            return known
    raise UnknownNameError("unit", name, METRES)


def factor(given: str, wanted: str) -> float:
    """What lengths in one unit are multiplied by to be in another."""
    return 1.0 if given == wanted else METRES[given] / METRES[wanted]
