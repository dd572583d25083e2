from .errors import (
    AssemblyError as AssemblyError,
    CheckpointError as CheckpointError,
    ContractError as ContractError,
    DefinitionError as DefinitionError,
    DemonstrationError as DemonstrationError,
    InputError as InputError,
    MissingDependencyError as MissingDependencyError,
    NeurosymError as NeurosymError,
    UnknownNameError as UnknownNameError,
)
from .geometry.assembly import Assembly as Assembly
from .geometry.queries import AssemblyGeometry as AssemblyGeometry
from .language import (
    Action as Action,
    Atom as Atom,
    Derived as Derived,
    Domain as Domain,
    Fluent as Fluent,
    Function as Function,
    GroundProblem as GroundProblem,
    Problem as Problem,
    Semantics as Semantics,
    State as State,
    Type as Type,
    derived as derived,
    exists as exists,
    forall as forall,
    implies as implies,
    predicates as predicates,
    when as when,
)
from .language.demonstrations import Demonstrations as Demonstrations
from .language.problem_family import ProblemFamily as ProblemFamily
from .language.search_problem import (
    Rejection as Rejection,
    SearchProblem as SearchProblem,
    Step as Step,
    Verdict as Verdict,
)
from .interop import register_engine as register_engine
from .pddl.lifted import to_pddl as to_pddl
from .pddl.reading import (
    from_pddl as from_pddl,
    from_unified_planning as from_unified_planning,
    to_unified_planning as to_unified_planning,
)
from .pipeline import (
    count_plans as count_plans,
    order_marginals as order_marginals,
    plans as plans,
    solve as solve,
)
from .planning.action_elimination import without_needless as without_needless
from .planning.budget import Budget as Budget
from .planning.order_scores import OrderScores as OrderScores
from .planning.planner import Planner as Planner, PlannerTraits as PlannerTraits
from .planning.prior import Prior as Prior, RandomPrior as RandomPrior, UniformPrior as UniformPrior
from .planning.result import PlanResult as PlanResult, Status as Status
from .planning.search_log import SearchLog as SearchLog
from .planning.validation import Validation as Validation, validate as validate
from .registry import (
    domain_names as domain_names,
    load_domain as load_domain,
    load_planner as load_planner,
    load_prior as load_prior,
    planner_names as planner_names,
    prior_names as prior_names,
)

__version__: str
