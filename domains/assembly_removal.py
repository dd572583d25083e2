"""Taking an assembly apart one part at a time."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from domains.assembly_paths import NoWay, check_motion, way_out
from domains.assembly_pull import drawn_out
from domains.assembly_scope import covering
from domains.assembly_targets import Relaxation
from domains.assembly_twins import twins
from domains.assembly_why import explain_building, explain_removal, falls_at_first, refute_removal, together
from neurosym.geometry.assembly import Assembly
from neurosym.geometry.grouping import need_not_part
from neurosym.geometry.queries import AssemblyGeometry
from neurosym.geometry.step_motion import StepMotion
from neurosym.language import Action, Derived, Domain, Fluent, Problem, Simulation, State, Type, formulas, predicates
from neurosym.language.explanation import WhyNot
from neurosym.language.search_problem import RelaxedPlan, Verdict
from neurosym.language.semantics import Semantics
from neurosym.language.state import BitState
from neurosym.language.terms import Literal
from neurosym.language.travel import remade
from neurosym.support.words import listed

if TYPE_CHECKING:
    from domains.assembly import Setting

part = Type("part")
present = Fluent("present", part)
fixed = Fluent("fixed", part)
_p = part("p")


def removal_domain(setting: Setting) -> Domain:
    """The symbols of removals, one a part."""
    possible = [can_leave(setting)(_p)]
    if setting.pull:
        possible = [stands_at_first(setting)(), drawn_out(setting, can_leave(setting), present)(_p)]
    elif setting.gravity:
        possible += [stands_at_first(setting)(), predicates.stable_without(present, held=setting.held)(_p)]
    remove = Action("remove", _p, pre=[present(_p), ~fixed(_p), *possible], eff=[~present(_p)], label="{p}", once=True)
    return Domain("assembly", fluents=[present, fixed], actions=[remove])


def apart_one_by_one(
    world: AssemblyGeometry,
    setting: Setting,
    *,
    before: Iterable[tuple[str, str]],
    name: str,
    family: str,
    details: Mapping[str, Any],
) -> Problem:
    """The problem in which an action, named by a part, removes that part."""
    assembly, pairs = world.assembly, tuple(before)
    loose = [n for n in assembly.names if n not in assembly.fixed]
    goal = [~present(n) for n in setting.targets or loose]
    if assembly.piece_groups and not setting.targets:
        goal = [Literal(need_not_separate(assembly)())]
    judged_alike = setting.gravity and not setting.held and not assembly.fixed and setting.paths == "straight"
    return removal_domain(setting).problem(
        world=world,
        objects={part: assembly.names},
        init=[*(present(n) for n in assembly.names), *(fixed(n) for n in assembly.fixed)],
        goal=goal,
        before=pairs,
        name=name,
        family=family,
        simulation=Simulation("rigid", {n: n for n in loose}) if judged_alike else None,
        details=details,
        semantics=RemovalSemantics(setting, Relaxation(world, setting, assembly.mask(setting.targets), pairs)),
    )


@dataclass(frozen=True)
class RemovalSemantics(Semantics):
    """Why an assembly does not come apart part by part."""

    setting: Setting
    relaxation: Relaxation

    @property
    def planner(self) -> str:
        return "fewest" if self.setting.targets else "backtracking"

    def relaxed_plan(self, problem: Problem, state: int) -> RelaxedPlan | None:
        if not self.setting.targets:
            return None
        ground, names = problem.symbols, self.relaxation.geometry.names
        count, order = self.relaxation.smallest(BitState(ground, state).mask(present, names))
        number = {name: action for action, name in enumerate(ground.actions)}
        return RelaxedPlan(count, tuple(number[names[part]] for part in order))

    def interchangeable(self, problem: Problem) -> Sequence[Sequence[str]]:
        return twins(self.relaxation.geometry, self.setting, self.relaxation)

    def side(self, problem: Problem) -> str:
        """What cannot be taken apart cannot be built either, and where little is there that is often seen sooner."""
        return "both"

    def refute(self, problem: Problem) -> WhyNot | None:
        assert problem.geometry is not None
        if problem.symbols.is_goal(problem.symbols.initial):
            return None
        at_first = falls_at_first(problem.geometry, self.setting)
        return covering(problem, self.setting, together(at_first, refute_removal(problem.geometry, self.setting)))

    def explain(self, problem: Problem, done: Sequence[str]) -> WhyNot | None:
        assert problem.geometry is not None
        why = explain_removal(problem.geometry, self.setting, problem.before, tuple(done))
        return covering(problem, self.setting, why)

    def explain_from_goal(self, problem: Problem, undone: Sequence[str]) -> WhyNot | None:
        assert problem.geometry is not None
        why = explain_building(problem.geometry, self.setting, problem.before, tuple(undone))
        return covering(problem, self.setting, why)


@remade
def can_leave(setting: Setting) -> Derived:
    """``free(p)``: part p can leave, along a straight line or else, if paths are asked for, along a path."""
    straight = predicates.free(present, directions=setting.directions)

    def ask(world: AssemblyGeometry, state: State, p: str) -> Verdict:
        verdict = straight.function(world, state, p)
        if verdict.holds or setting.paths == "straight":
            return verdict
        there = state.mask(present, world.names)
        found = way_out(world, 1 << world.index[p], there, shifting=not setting.gravity)
        if isinstance(found, NoWay):
            return Verdict(False, found.because, found.reason, proved=found.proved)
        return Verdict(True, (), f"{p} is free by a path.", motion=found)

    def check(world: AssemblyGeometry, state: State, motion: StepMotion, p: str) -> Verdict:
        if motion.parts != (p,) or not (motion.direction or motion.tracks):
            return ask(world, state, p)
        return check_motion(world, setting, motion, state.mask(present, world.names), standing=True)

    return Derived("free", [part], ask, check=check, formula=straight.formula if setting.paths == "straight" else None)


@remade
def need_not_separate(assembly: Assembly) -> Derived:
    """``need_not_separate()``: nothing but fixed parts is left, or all that is left is within one piece group."""

    def ask(world: AssemblyGeometry, state: State) -> Verdict:
        left = state.objects(present)
        if set(left) <= set(assembly.fixed) or need_not_part([left], assembly.piece_groups):
            return Verdict(True)
        return Verdict(False, left, f"{listed(left)} are left, which are not within one piece group.")

    return Derived("need_not_separate", [], ask)


@remade
def stands_at_first(setting: Setting) -> Derived:
    """``stands()``: the whole stands before anything is taken out. Afterwards each removal has seen to it."""

    def ask(world: AssemblyGeometry, state: State) -> Verdict:
        there = state.mask(present, world.names)
        if there != (1 << len(world)) - 1:
            return Verdict(True)
        answer = world.stability.standing_when_held(there, setting.held)
        if answer.stands:
            return Verdict(True)
        falling = world.in_mask(answer.falling)
        sentence = f"The assembly does not stand as it is: {listed(falling)} would fall."
        return Verdict(False, falling, sentence, ())

    def formula(world: AssemblyGeometry) -> formulas.AnyOf:
        if world.stability.standing_when_held((1 << len(world)) - 1, setting.held).stands:
            return formulas.AnyOf((formulas.Way("", ()),))
        return formulas.AnyOf(tuple(formulas.Way(f"after {n}", (~present(n),)) for n in world.names))

    return Derived("stands", [], ask, formula=formula)
