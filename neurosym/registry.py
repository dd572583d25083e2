"""Domains, planners and priors by name, through entry points: ours are declared as a third party's would be.

Wherever a name is taken, an object is too.
"""

import inspect
import re
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any, TypeVar

from neurosym.errors import ContractError, InputError, MissingDependencyError, UnknownNameError
from neurosym.language.problem_family import ProblemFamily
from neurosym.planning.planner import Planner
from neurosym.planning.prior import Prior

T = TypeVar("T")

DOMAINS, PLANNERS, PRIORS = "neurosym.domains", "neurosym.planners", "neurosym.priors"
_REINSTALL = "A new entry point shows only after the package that declares it is installed again."


@cache
def _entry_points(group: str) -> dict[str, EntryPoint]:
    return {e.name: e for e in entry_points(group=group)}


def _extra_with(entry: EntryPoint, module: str) -> str | None:
    """The smallest extra of an entry point's distribution that has a module, going by names of requirements."""
    extras: dict[str, list[str]] = {}
    for requirement in (entry.dist and entry.dist.requires) or ():
        if found := re.match(r"([\w.-]+).*\bextra == ['\"]([^'\"]+)", requirement):
            extras.setdefault(found[2], []).append(re.sub(r"[-_.]+", "_", found[1]).lower())
    wanted = module.partition(".")[0].lower()
    return min((e for e in extras if wanted in extras[e]), key=lambda e: len(extras[e]), default=None)


def domain_names() -> list[str]:
    """Names that `load_domain` takes."""
    return sorted(_entry_points(DOMAINS))


def planner_names() -> list[str]:
    """Names that `load_planner` takes."""
    return sorted(_entry_points(PLANNERS))


def prior_names() -> list[str]:
    """Names that `load_prior` takes (it takes the path of a weights file, too)."""
    return sorted(_entry_points(PRIORS))


def load_domain(domain: str | ProblemFamily, **options: Any) -> ProblemFamily:
    """The problem family of that name, for instance ``"soma"``; a family is passed through."""
    if isinstance(domain, ProblemFamily):
        return domain
    return _make(DOMAINS, "domain", domain, ProblemFamily, options)


def load_planner(planner: str | Planner, **options: Any) -> Planner:
    """The planner of that name, for instance ``"best-first"``; a planner is passed through."""
    if isinstance(planner, Planner):
        return planner
    return _make(PLANNERS, "planner", planner, Planner, options)


def load_prior(prior: str | Path | Prior, **options: Any) -> Prior:
    """The prior of that name, or the one whose weights a ``.safetensors`` file holds; a prior is passed through.

    A weights file names in its header the entry point that can read it, so any registered prior that can be
    saved can be loaded from its file.
    """
    if isinstance(prior, Prior):
        return prior
    if str(prior).endswith(".safetensors"):
        from neurosym.planning.weights_header import read_header

        header = read_header(Path(prior))
        return _make(PRIORS, "prior", header.get("prior"), Prior, {"weights": Path(prior), **options})
    return _make(PRIORS, "prior", str(prior), Prior, options, hint="A weights file ends in .safetensors.")


def _make(group: str, kind: str, name: object, base: Callable[..., T], options: dict[str, Any], hint: str = "") -> T:
    known = _entry_points(group)
    if not isinstance(name, str) or name not in known:
        raise UnknownNameError(kind, name, known, hint=f"{hint} {_REINSTALL}".strip())
    try:
        factory = known[name].load()
    except ModuleNotFoundError as error:
        if extra := _extra_with(known[name], error.name or ""):
            purpose = f"the {kind} {name!r} needs"
            distribution = getattr(known[name].dist, "name", "")
            raise MissingDependencyError.of(error.name or "", purpose, extra, distribution) from error
        raise
    try:
        inspect.signature(factory).bind(**options)
    except TypeError as error:
        raise InputError(f"Expected options that the {kind} {name!r} takes; got {options}: {error}.") from None
    made: T = factory(**options)
    if not isinstance(made, base):  # type: ignore[arg-type]
        raise ContractError(
            f"Expected the entry point {name!r} of {group} to give a {base.__name__}; got {type(made).__name__}."
        )
    return made
