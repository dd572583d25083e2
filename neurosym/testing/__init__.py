"""Conformance suites, for the authors of domains, planners and priors to run on their own plug-ins.

Each raises `ContractError` with what was expected and what came; nothing is returned.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from neurosym.testing.domains import check_domain
    from neurosym.testing.planners import check_planner
    from neurosym.testing.priors import check_prior

__all__ = ["check_domain", "check_planner", "check_prior"]

_HOMES = {
    "check_domain": "neurosym.testing.domains",
    "check_planner": "neurosym.testing.planners",
    "check_prior": "neurosym.testing.priors",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
