"""By name in unified-planning."""

from typing import Any

from neurosym.errors import MissingDependencyError

NAME = "neurosym"


def register_engine(environment: Any = None) -> None:
    """Make ``OneshotPlanner(name="neurosym")`` and ``PlanValidator(name="neurosym")`` of unified-planning work.

    `environment`: of unified-planning; None: the global one. Raises MissingDependencyError: it is not installed.
    """
    try:
        from unified_planning.environment import get_environment
    except ImportError:
        raise MissingDependencyError(
            "Expected unified-planning, to be an engine of it; it is not installed. "
            "pip install 'neurosym-assembly[pddl]'."
        ) from None
    factory = get_environment(environment).factory
    if NAME not in factory.engines:
        factory.add_engine(NAME, "neurosym.interop.engine", "NeurosymEngine")
