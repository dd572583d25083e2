"""Planners: they ask the oracle in an order that a prior suggests, and learn from every rejection.

`swap_repair` is the paper's. `backtracking` and `best_first` are complete, and so is `fewest`, which wants few actions.
`exhaustive` is the reference the others are tested against, and counts. Each imports only `neurosym`.
"""

from planners.backtracking import Backtracking
from planners.best_first import BestFirst
from planners.exhaustive import Exhaustive
from planners.fewest import Fewest
from planners.state_graph import all_plans, count_plans, order_marginals
from planners.swap_repair import SwapRepair

__all__ = [
    "Backtracking",
    "BestFirst",
    "Exhaustive",
    "Fewest",
    "SwapRepair",
    "all_plans",
    "count_plans",
    "order_marginals",
]
