"""The weights that come with the package: which file answers for a problem, or for pictures alone.

Files are named ``{domain}-{prior}.safetensors``, or ``{domain}-{kind}-{prior}`` where one network does not serve all of
a domain's problems; their headers say the rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from neurosym.errors import InputError
from neurosym.planning.weights_header import read_header

FOLDER = Path(__file__).parent / "weights"


def files(prior: str, folder: Path | None = None) -> dict[str, Path]:
    """Name -> bundled weights file, for a prior: the name of a domain, or of one kind of its problems."""
    ending = f"-{prior}.safetensors"
    found = {path.name.removesuffix(ending): path for path in sorted((folder or FOLDER).glob(f"*{ending}"))}
    # A prior's name may end in another's: the header says which it is.
    return {name: path for name, path in found.items() if read_header(path).get("prior") == prior}


def for_domain(prior: str, domain: str, folder: Path | None = None) -> Path:
    """The file of that name, for instance ``soma`` or ``tower-unique``."""
    known = files(prior, folder)
    if domain not in known:
        raise InputError(_none_fits(prior, known, f"the domain {domain!r}"))
    return known[domain]


def for_actions(prior: str, family: str | None, actions: Sequence[str], folder: Path | None = None) -> Path:
    """The file that knows all of these actions: of the problem's family if that has any, otherwise of any."""
    known = files(prior, folder)
    of_family = [path for path in known.values() if read_header(path).get("domain") == family]
    fit = [path for path in known.values() if set(actions) <= set(read_header(path).get("actions", ()))]
    own = [path for path in fit if path in of_family]
    # The family's only file answers even where it does not know the actions: it then says which it knows.
    chosen = own or (of_family if len(of_family) == 1 else fit)
    return _only(chosen, prior, known, f"a problem of the family {family!r} with the actions {', '.join(actions)}")


def for_pictures(prior: str, shape: Sequence[int], folder: Path | None = None) -> Path:
    """The only file for pictures of that shape (V, H, W, 3)."""
    known = files(prior, folder)
    fit = [path for path in known.values() if _picture_shape(read_header(path)) == tuple(shape)]
    return _only(fit, prior, known, f"pictures of shape {tuple(shape)}")


def _picture_shape(header: dict[str, Any]) -> tuple[int, ...]:
    network = header.get("network")
    return tuple(network.get("picture_shape", ())) if isinstance(network, dict) else ()


def _only(fit: list[Path], prior: str, known: dict[str, Path], what: str) -> Path:
    if len(fit) > 1:
        names = ", ".join(sorted(domain for domain, path in known.items() if path in fit))
        raise InputError(f"Expected one set of bundled weights for {what}; got several: {names}. Say domain=NAME.")
    if not fit:
        raise InputError(_none_fits(prior, known, what))
    return fit[0]


def _none_fits(prior: str, known: dict[str, Path], what: str) -> str:
    return (
        f"Expected bundled weights of the prior {prior!r} for {what}; there are some for: "
        f"{', '.join(sorted(known)) or 'nothing'}. Train your own (`neurosym train`, or fit), and give weights=FILE."
    )
