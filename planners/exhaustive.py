"""Exhaustive search of the graph of states: the reference that tests compare the others with."""

import heapq

from neurosym.planning.planner import PlannerTraits
from neurosym.planning.result import PlanResult, Status
from planners import state_graph
from planners.search_context import SearchContext
from planners.search_planner import KBestSearchPlanner
from planners.state_graph import Edge, StateGraph, StateNode


class Exhaustive(KBestSearchPlanner):
    """Looks at everything; complete and optimal, for problems with few actions (2^N states).

    When the budget ends first, the best of what was seen, which need not be the best of all.
    """

    traits = PlannerTraits(complete=True, optimal=True, k_best=True)

    count_orders = staticmethod(state_graph.count_orders)
    count_plans = staticmethod(state_graph.count_plans)
    order_marginals = staticmethod(state_graph.order_marginals)
    all_plans = staticmethod(state_graph.all_plans)

    def search(self, context: SearchContext) -> PlanResult:
        graph = StateGraph(context, shuffled=True)
        for path in _cheapest(graph, 1):
            return _result(context, path)
        return context.log.failed(Status.UNSOLVABLE if graph.complete else Status.OUT_OF_BUDGET)

    def search_k_best(self, context: SearchContext, k: int) -> list[PlanResult]:
        return [_result(context, path) for path in _cheapest(StateGraph(context, shuffled=True), k)]


def _result(context: SearchContext, path: tuple[Edge, ...]) -> PlanResult:
    return context.log.solved([e.action for e in path], [e.motion for e in path], scores=context.scores)


def _cheapest(graph: StateGraph, k: int) -> list[tuple[Edge, ...]]:
    """The k cheapest paths from the root to a goal, cheapest first."""
    # From each node the k cheapest ends, with their costs: an edge's cost depends on its step alone, and all paths to
    # a node have equally many, so they compose.
    ends: dict[StateNode, list[tuple[float, tuple[Edge, ...]]]] = {}
    for step, layer in reversed(list(enumerate(graph.layers))):
        below, ends = ends, {}
        for node in layer:
            if node.is_goal:
                ends[node] = [(graph.context.length_cost(step), ())]
                continue
            options = (
                (cost + graph.context.cost(step, edge.action), (edge, *end))
                for edge in node.edges
                for cost, end in below[edge.node]
            )
            ends[node] = heapq.nsmallest(k, options, key=lambda option: option[0])
    return [path for _, path in ends[graph.root][:k]]
