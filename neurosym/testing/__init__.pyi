from .domains import check_domain as check_domain
from .planners import check_planner as check_planner
from .priors import check_prior as check_prior
