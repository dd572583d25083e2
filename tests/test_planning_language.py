"""Actions that repeat, formulas, conditional effects and costs: planners agree with a search of the test's own."""

from __future__ import annotations

import heapq
import re
from functools import reduce
from operator import and_, or_

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import neurosym as ns
from planners import Backtracking, BestFirst, Exhaustive, Fewest

block, room = ns.Type("block"), ns.Type("room")
on, clear, table = ns.Fluent("on", block, block), ns.Fluent("clear", block), ns.Fluent("table", block)
x, y, z = block("x"), block("y"), block("z")
hot = ns.Fluent("hot", block)


# -- random tasks against a search of our own -----------------------------------------------------------------
literals = st.dictionaries(st.integers(0, 7), st.booleans(), max_size=3)
rules = st.tuples(literals, literals.filter(bool), st.integers(0, 3), literals, literals, st.booleans())
tasks = st.tuples(st.lists(rules, min_size=1, max_size=7), st.sets(st.integers(0, 7)), literals.filter(bool))


def made(task, *, costly):
    """The task in our language: each rule has a precondition, an effect, a cost, and an effect under a condition."""
    rules, init, goal = task
    facts = [ns.Fluent(f"f{i}") for i in range(8)]

    def of(conditions):
        return [facts[i]() if sign else ~facts[i]() for i, sign in conditions.items()]

    actions = []
    for number, (pre, eff, cost, given_, then, either) in enumerate(rules):
        extra = [ns.when(reduce(and_, of(given_)), *of(then))] if given_ and then else []
        needs = [reduce(or_, of(pre))] if either and pre else of(pre)
        actions.append(ns.Action(f"a{number}", pre=needs, eff=of(eff) + extra, cost=cost if costly else None))
    domain = ns.Domain("random", fluents=facts, actions=actions)
    return domain.problem(objects={}, init=[facts[i]() for i in init], goal=of(goal), reachable=False)


def least_cost(task, *, costly):
    """Dijkstra over sets of facts; None: no plan."""
    rules, init, goal = task

    def holds(state, conditions):
        return all((i in state) is sign for i, sign in conditions.items())

    queue, seen = [(0, 0, frozenset(init))], set()
    while queue:
        cost, _, state = heapq.heappop(queue)
        if holds(state, goal):
            return cost
        if state in seen:
            continue
        seen.add(state)
        for pre, eff, price, condition, then, either in rules:
            ends = [*pre.items()] if either and pre else []
            if not (any((i in state) is sign for i, sign in ends) if ends else holds(state, pre)):
                continue
            ends = [*condition.items()] if condition and then else []
            more = then if ends and holds(state, condition) else {}
            adds = {i for e in (eff, more) for i, sign in e.items() if sign}
            gone = {i for e in (eff, more) for i, sign in e.items() if not sign}
            heapq.heappush(queue, (cost + (price if costly else 1), len(seen) * 99 + len(queue), (state - gone) | adds))
    return None


@settings(max_examples=250, deadline=None)
@given(tasks)
def test_random_tasks_are_solved_exactly_when_they_can_be_and_at_the_least_cost(task):
    for costly in (False, True):
        problem, expected = made(task, costly=costly), least_cost(task, costly=costly)
        planners = [BestFirst(), BestFirst(heuristic="none"), BestFirst(priority="greedy"), Backtracking()]
        for planner in [*planners, BestFirst(heuristic="ff", priority="weighted"), Fewest(), Exhaustive()]:
            result = ns.solve(problem, planner=planner)
            status = ns.Status.UNSOLVABLE if expected is None else ns.Status.SOLVED
            assert result.status is status, planner
            if expected is not None:
                assert ns.validate(problem, result.plan), planner
                price = result.total_cost if costly else len(result.plan)
                assert price >= expected
                if planner in planners[:2] and (costly or problem.symbols.repeating):
                    assert price == pytest.approx(expected)
                    assert (result.cheapest if costly else result.fewest) is True


# -- what the words mean --------------------------------------------------------------------------------------
def test_what_is_needed_twice_is_done_twice_and_a_loop_is_no_endless_search():
    holding, loose, away = ns.Fluent("holding", block), ns.Fluent("loose", block), ns.Fluent("away", block)
    pick = ns.Action("pick", x, pre=[~holding(x), ~ns.exists(y, holding(y))], eff=[holding(x)])
    put = ns.Action("put", x, pre=[holding(x)], eff=[~holding(x)])
    turn = ns.Action("turn", x, y, pre=[holding(x), loose(y), x != y], eff=[away(y), ~loose(y)])
    tools = ns.Domain("tools", fluents=[holding, loose, away], actions=[pick, put, turn])
    problem = tools.problem(objects={block: "abc"}, init=[loose("c")], goal=[away("c"), ns.forall(x, ~holding(x))])
    assert "turn(a, a)" not in problem.actions
    for planner in ("backtracking", "best-first", "exhaustive", "fewest"):
        assert ns.solve(problem, planner=planner).solved
    best = ns.solve(problem, planner="best-first")
    assert len(best.plan) == 3
    assert best.fewest
    never = tools.problem(
        objects={block: "ab"}, init=[loose("a")], goal=[holding("a"), holding("b")], reachable=False
    )
    for planner in ("backtracking", "best-first", "exhaustive"):
        assert ns.solve(never, planner=planner).status is ns.Status.UNSOLVABLE


def test_steps_that_a_plan_does_not_need_are_left_out():
    holding, away = ns.Fluent("holding", block), ns.Fluent("away", block)
    pick = ns.Action("pick", x, pre=[~ns.exists(y, holding(y))], eff=[holding(x)])
    put = ns.Action("put", x, pre=[holding(x)], eff=[~holding(x)])
    turn = ns.Action("turn", x, y, pre=[holding(x), x != y], eff=[away(y)])
    tools = ns.Domain("tools", fluents=[holding, away], actions=[pick, put, turn])
    problem = tools.problem(objects={block: "abc"}, init=[], goal=[away("c"), ~holding("a")])
    order = ["pick(b)", "put(b)", "pick(a)", "put(a)", "pick(a)", "turn(a, b)", "turn(a, c)", "put(a)", "pick(b)"]
    assert ns.validate(problem, order)
    assert ns.without_needless(problem, order) == ("pick(a)", "turn(a, c)", "put(a)")
    with pytest.raises(ns.InputError, match="an order that is none"):
        ns.without_needless(problem, order[1:])


def test_an_action_that_is_once_is_done_once_though_nothing_spends_it():
    lit = ns.Fluent("lit", block)
    strike = ns.Action("strike", x, pre=[~lit(x)], eff=[lit(x)], once=True)
    blow = ns.Action("blow", x, pre=[lit(x)], eff=[~lit(x), hot(x)])
    domain = ns.Domain("match", fluents=[lit, hot], actions=[strike, blow])
    problem = domain.problem(objects={block: ["a"]}, init=[], goal=[hot("a"), lit("a")])
    for planner in ("backtracking", "best-first", "exhaustive"):
        assert ns.solve(problem, planner=planner).status is ns.Status.UNSOLVABLE
    again = ns.validate(problem, ["strike(a)", "blow(a)", "strike(a)"])
    assert (again.ok, again.failed_at) == (False, 2)


def test_conditional_and_universal_effects_and_their_replay_agree():
    heat = ns.Action("heat", x, eff=[hot(x), ns.forall(y, ns.when(on(y, x), hot(y)))], once=True)
    domain = ns.Domain("stove", fluents=[on, hot], actions=[heat])
    problem = domain.problem(
        objects={block: "abc"}, init=[on("b", "a"), on("c", "a")], goal=[ns.forall(x, hot(x))]
    )
    assert ns.solve(problem, planner="fewest").plan == ("heat(a)",)
    assert ns.validate(problem, ["heat(a)"])
    assert not ns.validate(problem, ["heat(b)", "heat(c)"])


@ns.derived(block)
def cold(world, state, name):
    blocked = tuple(n for n in world if n != name and state.holds(hot(n)))
    return ns.Verdict(not blocked, blocked, f"{name} is warmed by {blocked}.", tuple(hot(n) for n in blocked[:1]))


def test_a_refused_formula_promises_what_all_its_parts_promise():
    cool = ns.Action("cool", x, pre=[hot(x)], eff=[~hot(x)], once=True)
    seal = ns.Action("seal", pre=[(cold("a") & ~hot("a")) | (cold("b") & ~hot("b"))], eff=[clear("a")], once=True)
    domain = ns.Domain("cellar", fluents=[hot, clear], actions=[cool, seal])
    problem = domain.problem(
        world=["a", "b", "c"], objects={block: "abc"}, init=[hot(n) for n in "abc"], goal=[clear("a"), hot("c")],
        reachable=False,
    )
    ground = problem.ground()
    number = {name: i for i, name in enumerate(ground.actions)}
    state = ground.apply(ground.apply(ground.initial, number["cool(a)"]), number["cool(b)"])
    refused = ground.attempt(state, number["seal()"])
    assert {ground.actions[a] for a in refused.until} == {"cool(c)"}
    assert refused.because == ("c",)
    for planner in ("backtracking", "best-first", "exhaustive"):
        assert ns.solve(problem, planner=planner).status is ns.Status.UNSOLVABLE
    assert not ns.validate(problem, ["cool(a)", "seal()"])
    free = domain.problem(world=["a", "b", "c"], objects={block: "abc"}, init=[hot("a"), hot("b")], goal=[clear("a")])
    assert ns.solve(free, planner="best-first").solved


def test_costs_are_functions_of_objects_and_decide_the_plan():
    at = ns.Fluent("at", room)
    distance = ns.Function("distance", room, room)
    p, q = room("p"), room("q")
    drive = ns.Action("drive", p, q, pre=[at(p), p != q], eff=[at(q), ~at(p)], cost=distance(p, q))
    domain = ns.Domain("roads", fluents=[at], actions=[drive])
    far = {("a", "b"): 9, ("a", "c"): 2, ("c", "b"): 3}
    values = {distance(i, j): far.get((i, j), far.get((j, i), 0)) for i in "abc" for j in "abc"}
    problem = domain.problem(objects={room: "abc"}, init=[at("a")], goal=[at("b")], values=values)
    best = ns.solve(problem, planner="best-first")
    assert (best.plan, best.total_cost, best.cheapest) == (("drive(a, c)", "drive(c, b)"), 5.0, True)
    with pytest.raises(ns.DefinitionError, match=re.escape("a value of distance(a, b)")):
        domain.problem(objects={room: "ab"}, init=[at("a")], goal=[at("b")])


def test_a_prior_is_refused_where_actions_repeat():
    flip = ns.Action("flip", x, pre=[hot(x)], eff=[~hot(x)])
    flop = ns.Action("flop", x, pre=[~hot(x)], eff=[hot(x)])
    domain = ns.Domain("d", fluents=[hot], actions=[flip, flop])
    problem = domain.problem(objects={block: "a"}, init=[], goal=[hot("a")])
    with pytest.raises(ns.InputError, match="done once each"):
        ns.solve(problem, prior="uniform")
    with pytest.raises(ns.InputError, match="no end of orders"):
        ns.count_plans(problem)


cost = ns.Function("cost", block)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ns.Action("a", x, pre=[on(x, x) or clear(x)], eff=[hot(x)]), "Expected a & b, a | b or ~a"),
        (lambda: ns.Action("a", x, pre=[clear(x) | hot], eff=[hot(x)]), "In |: expected a condition"),
        (lambda: ns.Action("a", x, pre=[ns.forall(y, clear(z))], eff=[hot(x)]), "pre[0]: forall(y: clear(z)) uses z"),
        (lambda: ns.Action("a", x, eff=[hot(x) | clear(x)]), "eff[0]: expected a fluent, its negation"),
        (lambda: ns.Action("a", x, eff=[ns.when(clear(x), cold(x))]), "is derived"),
        (lambda: ns.Action("a", x, eff=[hot(x)], cost=-1), "a cost of 0 or more"),
        (lambda: ns.Action("a", x, eff=[hot(x)], cost=cost(y)), "no parameter of the action"),
        (lambda: ns.Action("a", x, eff=[hot(x)], cost=cost(x) + 1), "numeric fluents, durations"),
        (lambda: ns.Action("a", x, pre=[cost(x) >= 1], eff=[hot(x)]), "numeric fluents, durations"),
        (lambda: ns.Action("a", x, eff=[hot(x)], duration=3), "expected no duration"),
        (lambda: ns.Domain("d", fluents=[hot], actions=[ns.Action("a", x, pre=[x != "zz"], eff=[hot(x)])]).problem(
            objects={block: "a"}, init=[], goal=[]), "unknown object"),
        (lambda: ns.forall(clear(x)), "expected variables, then a condition"),
        (lambda: ns.when(clear(x)), "at least one effect"),
    ],
)
def test_misuse_is_named(make, says):
    with pytest.raises(ns.DefinitionError, match=re.escape(says)):
        make()
