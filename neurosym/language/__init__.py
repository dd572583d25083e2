"""The symbolic language: types, objects, fluents, derived predicates, actions, domains and problems."""

from neurosym.language import predicates
from neurosym.language.actions import Action
from neurosym.language.conditions import Condition, exists, forall, implies, when
from neurosym.language.costs import Function
from neurosym.language.domain import Domain
from neurosym.language.grounding import GroundProblem
from neurosym.language.problem import Problem, Simulation
from neurosym.language.semantics import Semantics
from neurosym.language.state import State
from neurosym.language.terms import Atom, Derived, Fluent, Literal, Type, Variable, derived

__all__ = [
    "Action",
    "Atom",
    "Condition",
    "Derived",
    "Domain",
    "Fluent",
    "Function",
    "GroundProblem",
    "Literal",
    "Problem",
    "Semantics",
    "Simulation",
    "State",
    "Type",
    "Variable",
    "derived",
    "exists",
    "forall",
    "implies",
    "predicates",
    "when",
]
