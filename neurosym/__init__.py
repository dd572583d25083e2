"""neurosym: plan in which order things go together or come apart.

Symbols say what an action needs and changes; geometry answers whether it is physically possible; a prior,
learned from pictures of finished work, says what to try first::

    import neurosym as ns

    problem = ns.load_domain("soma").problem(17)
    guided = ns.solve(problem, planner="best-first", prior="sinkhorn")
    print(guided.plan, guided.iterations)

Public names are resolved when first used: importing this package loads no heavy dependency.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "neurosym.errors": (
        "AssemblyError",
        "CheckpointError",
        "ContractError",
        "DefinitionError",
        "DemonstrationError",
        "InputError",
        "MissingDependencyError",
        "NeurosymError",
        "UnknownNameError",
    ),
    "neurosym.language.demonstrations": ("Demonstrations",),
    "neurosym.language.problem_family": ("ProblemFamily",),
    "neurosym.geometry.assembly": ("Assembly",),
    "neurosym.geometry.queries": ("AssemblyGeometry",),
    "neurosym.language": (
        "Action",
        "Atom",
        "Derived",
        "Domain",
        "Fluent",
        "GroundProblem",
        "Problem",
        "Semantics",
        "State",
        "Type",
        "derived",
    ),
    "neurosym.pipeline": ("count_plans", "plans", "solve"),
    "neurosym.planning.budget": ("Budget",),
    "neurosym.planning.order_scores": ("OrderScores",),
    "neurosym.planning.planner": ("Planner", "PlannerTraits"),
    "neurosym.planning.prior": ("Prior", "RandomPrior", "UniformPrior"),
    "neurosym.planning.result": ("PlanResult", "Status"),
    "neurosym.planning.search_log": ("SearchLog",),
    "neurosym.language.search_problem": ("Rejection", "SearchProblem", "Step", "Verdict"),
    "neurosym.registry": (
        "domain_names",
        "load_domain",
        "load_planner",
        "load_prior",
        "planner_names",
        "prior_names",
    ),
    "neurosym.planning.validation": ("Validation", "validate"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_MODULES = {"predicates": "neurosym.language.predicates"}

__all__ = sorted([*_HOME_OF, *_MODULES, "__version__"])

if TYPE_CHECKING:
    from neurosym.errors import (
        AssemblyError as AssemblyError,
    )
    from neurosym.errors import (
        CheckpointError as CheckpointError,
    )
    from neurosym.errors import (
        ContractError as ContractError,
    )
    from neurosym.errors import (
        DefinitionError as DefinitionError,
    )
    from neurosym.errors import (
        DemonstrationError as DemonstrationError,
    )
    from neurosym.errors import (
        InputError as InputError,
    )
    from neurosym.errors import (
        MissingDependencyError as MissingDependencyError,
    )
    from neurosym.errors import (
        NeurosymError as NeurosymError,
    )
    from neurosym.errors import (
        UnknownNameError as UnknownNameError,
    )
    from neurosym.geometry.assembly import Assembly as Assembly
    from neurosym.geometry.queries import AssemblyGeometry as AssemblyGeometry
    from neurosym.language import Action as Action
    from neurosym.language import Atom as Atom
    from neurosym.language import Derived as Derived
    from neurosym.language import Domain as Domain
    from neurosym.language import Fluent as Fluent
    from neurosym.language import GroundProblem as GroundProblem
    from neurosym.language import Problem as Problem
    from neurosym.language import Semantics as Semantics
    from neurosym.language import State as State
    from neurosym.language import Type as Type
    from neurosym.language import derived as derived
    from neurosym.language import predicates as predicates
    from neurosym.language.demonstrations import Demonstrations as Demonstrations
    from neurosym.language.problem_family import ProblemFamily as ProblemFamily
    from neurosym.language.search_problem import Rejection as Rejection
    from neurosym.language.search_problem import SearchProblem as SearchProblem
    from neurosym.language.search_problem import Step as Step
    from neurosym.language.search_problem import Verdict as Verdict
    from neurosym.pipeline import count_plans as count_plans
    from neurosym.pipeline import plans as plans
    from neurosym.pipeline import solve as solve
    from neurosym.planning.budget import Budget as Budget
    from neurosym.planning.order_scores import OrderScores as OrderScores
    from neurosym.planning.planner import Planner as Planner
    from neurosym.planning.planner import PlannerTraits as PlannerTraits
    from neurosym.planning.prior import Prior as Prior
    from neurosym.planning.prior import RandomPrior as RandomPrior
    from neurosym.planning.prior import UniformPrior as UniformPrior
    from neurosym.planning.result import PlanResult as PlanResult
    from neurosym.planning.result import Status as Status
    from neurosym.planning.search_log import SearchLog as SearchLog
    from neurosym.planning.validation import Validation as Validation
    from neurosym.planning.validation import validate as validate
    from neurosym.registry import domain_names as domain_names
    from neurosym.registry import load_domain as load_domain
    from neurosym.registry import load_planner as load_planner
    from neurosym.registry import load_prior as load_prior
    from neurosym.registry import planner_names as planner_names
    from neurosym.registry import prior_names as prior_names


def __getattr__(name: str) -> Any:
    """Import what is asked for, when it is asked for (PEP 562)."""
    if name in _HOME_OF:
        return getattr(importlib.import_module(_HOME_OF[name]), name)
    if name in _MODULES:
        return importlib.import_module(_MODULES[name])
    raise AttributeError(f"module 'neurosym' has no attribute {name!r}")


def __dir__() -> list[str]:
    return list(__all__)
