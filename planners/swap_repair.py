"""Swap repair, the planner of the paper: run the prior's order, swap the action that fails with a random later one.

Burke, Subr, Ramamoorthy, "Action sequencing using visual permutations", RA-L 2021, Sec. V: at most 30 iterations.
"""

from neurosym.errors import InputError
from neurosym.language.search_problem import Step
from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import PlanResult, Status
from planners.node import Node
from planners.search_context import SearchContext
from planners.search_planner import SearchPlanner


class SwapRepair(SearchPlanner):
    """Keeps what worked, and swaps the failing action with one drawn from its own position to the last.

    When the draw is the failing position itself, as in the paper, the same action fails again, and counts again. An
    iteration is a failed rollout, whether the symbols or the oracle refused. Not complete: it never goes back.

    Args:
        cap: iterations after which it gives up; None never does, which may not end on an unsolvable problem.
    """

    traits = PlannerTraits(complete=False)

    def __init__(self, *, cap: int | None = 30) -> None:
        if cap is not None and cap < 1:
            raise InputError(f"Expected a cap of at least 1 iteration, or None; got {cap}.")
        self.cap = cap

    def search(self, context: SearchContext) -> PlanResult:
        problem, log = context.problem, context.log
        order = _first_order(context)
        node = Node(problem.initial)
        applicable: frozenset[int] | None = None
        while not problem.is_goal(node.state):
            if node.depth == len(order):
                return log.failed(Status.GAVE_UP, first_guess_failed=True)
            context.check_budget()
            if applicable is None:
                applicable = frozenset(log.candidates(node.state))
                continue
            prefix, action = node.prefix(), order[node.depth]
            if action in applicable:
                answer = log.attempt(prefix, node.state, action)  # not the context's: what fails again counts again
                if isinstance(answer, Step):
                    node, applicable = node.child(action, answer), None
                    continue
            else:
                log.refuse(prefix, action, f"{problem.actions[action]} is not applicable here.")
            if self.cap is not None and log.iterations >= self.cap:
                return log.failed(Status.GAVE_UP, first_guess_failed=True)
            other = int(context.rng.integers(node.depth, len(order)))
            order[node.depth], order[other] = order[other], order[node.depth]
        return context.solved(node)


def _first_order(context: SearchContext) -> list[int]:
    """The prior's order, then whatever it leaves out, at random."""
    guess = [] if context.scores is None else list(context.scores.order(context.rng))
    rest = [int(a) for a in context.rng.permutation(len(context.classes))]
    placed = set(guess)
    return guess + [a for a in rest if a not in placed]
