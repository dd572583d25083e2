"""The engine that unified-planning loads once `register_engine` has named it. It needs unified-planning."""

from typing import Any

from unified_planning.engines import (
    Credits,
    Engine,
    PlanGenerationResult,
    PlanGenerationResultStatus,
    ValidationResult,
    ValidationResultStatus,
)
from unified_planning.engines.mixins import OneshotPlannerMixin, PlanValidatorMixin
from unified_planning.model import ProblemKind
from unified_planning.plans import ActionInstance, PlanKind, SequentialPlan

from neurosym.language.problem import Problem
from neurosym.pddl.reading import from_unified_planning
from neurosym.pipeline import solve
from neurosym.planning.budget import Budget
from neurosym.planning.planner import Planner
from neurosym.planning.result import PlanResult, Status
from neurosym.planning.validation import validate
from neurosym.registry import load_planner

_KIND = {
    "set_problem_class": ["ACTION_BASED"],
    "set_typing": ["FLAT_TYPING", "HIERARCHICAL_TYPING"],
    "set_conditions_kind": [
        *("NEGATIVE_CONDITIONS", "DISJUNCTIVE_CONDITIONS", "EQUALITIES"),
        *("EXISTENTIAL_CONDITIONS", "UNIVERSAL_CONDITIONS"),
    ],
    "set_effects_kind": ["CONDITIONAL_EFFECTS", "FORALL_EFFECTS"],
    "set_quality_metrics": ["ACTIONS_COST", "PLAN_LENGTH"],
    "set_actions_cost_kind": [
        *("STATIC_FLUENTS_IN_ACTIONS_COST", "INT_NUMBERS_IN_ACTIONS_COST", "REAL_NUMBERS_IN_ACTIONS_COST"),
    ],
}
_STATUS = {
    Status.SOLVED: PlanGenerationResultStatus.SOLVED_SATISFICING,
    Status.UNSOLVABLE: PlanGenerationResultStatus.UNSOLVABLE_PROVEN,
    Status.GAVE_UP: PlanGenerationResultStatus.UNSOLVABLE_INCOMPLETELY,
    Status.OUT_OF_BUDGET: PlanGenerationResultStatus.TIMEOUT,
}


class NeurosymEngine(Engine, OneshotPlannerMixin, PlanValidatorMixin):  # type: ignore[misc]
    """Plans with a planner of this library, and validates plans.

    Args:
        planner: a name or a planner; None: "best-first", which is optimal, where that is asked for, else "greedy".
        options: of the planner, for instance ``heuristic="add"``.
    """

    def __init__(self, planner: str | Planner | None = None, **options: Any) -> None:
        Engine.__init__(self)
        OneshotPlannerMixin.__init__(self)
        self._planner, self._options = planner, options

    @property
    def name(self) -> str:
        return "neurosym"

    @staticmethod
    def supported_kind() -> Any:
        kind = ProblemKind(version=2)
        for setter, features in _KIND.items():
            for feature in features:
                getattr(kind, setter)(feature)
        return kind

    @staticmethod
    def supports(problem_kind: Any) -> bool:
        return bool(problem_kind <= NeurosymEngine.supported_kind())

    @staticmethod
    def supports_plan(plan_kind: Any) -> bool:
        return bool(plan_kind == PlanKind.SEQUENTIAL_PLAN)

    @staticmethod
    def satisfies(optimality_guarantee: Any) -> bool:
        return True

    @staticmethod
    def get_credits(**_: Any) -> Any:
        short = "Heuristic search beside geometry and learned priors."
        return Credits("neurosym", "The neurosym authors", "", "", "MIT", short, short)

    def _solve(
        self, problem: Any, heuristic: Any = None, timeout: float | None = None, output_stream: Any = None, **_: Any
    ) -> Any:
        ours = from_unified_planning(problem)
        optimal = self.optimality_metric_required
        planner = load_planner(self._planner or ("best-first" if optimal else "greedy"), **self._options)
        result = solve(ours, planner=planner, budget=Budget(seconds=timeout))
        status = _STATUS[result.status]
        if result.solved and (result.cheapest or (result.cheapest is None and result.fewest)):
            status = PlanGenerationResultStatus.SOLVED_OPTIMALLY
        return PlanGenerationResult(status, _plan(problem, ours, result), self.name)

    def _validate(self, problem: Any, plan: Any) -> Any:
        ours = from_unified_planning(problem)
        names = {action.name: action for action in ours.domain.actions}
        order = []
        for step in plan.actions:
            action = names[step.action.name]
            objects = [str(p) for p in step.actual_parameters]
            order.append(action.ground_name({p.name: o for p, o in zip(action.params, objects)}))
        valid = validate(ours, order).ok
        status = ValidationResultStatus.VALID if valid else ValidationResultStatus.INVALID
        return ValidationResult(status, self.name, [])


def _plan(problem: Any, ours: Problem, result: PlanResult) -> Any:
    if result.plan is None:
        return None
    steps = []
    for name in result.plan:
        meant = ours.meant_by(name)
        assert meant is not None
        action, binding = meant
        objects = [problem.object(binding[p.name]) for p in action.params]
        of = problem.environment.expression_manager.ObjectExp
        steps.append(ActionInstance(problem.action(action.name), tuple(map(of, objects))))
    return SequentialPlan(steps, problem.environment)
