"""A cover under 4 hex bolts and 2 slotted screws, and one hand: tools are picked up and put down as often as it takes.

It shows actions that may be repeated, conditions with quantifiers, costs, and geometry behind one predicate: a bolt
comes out when nothing is over it, the cover when nothing holds it. Changing tools is dear, so the cheapest plan, proved
to be so, changes them once.

    python examples/tools.py [film.gif]
"""

import sys

import neurosym as ns

# -- the definition -------------------------------------------------------------------------------------------
part, tool = ns.Type("part"), ns.Type("tool")
plate, fastener = ns.Type("plate", part), ns.Type("fastener", part)
present, fits, holding = ns.Fluent("present", part), ns.Fluent("fits", tool, fastener), ns.Fluent("holding", tool)
free = ns.predicates.free(present)

t, f, p = tool("t"), fastener("f"), plate("p")
empty_hand = ~ns.exists(t, holding(t))
UNBOLT = ns.Domain(
    "unbolt",
    fluents=[present, fits, holding],
    actions=[
        ns.Action("pick_tool", t, pre=[empty_hand], eff=[holding(t)], cost=5),
        ns.Action("put_tool", t, pre=[holding(t)], eff=[~holding(t)], cost=5),
        ns.Action("unscrew", f, t, pre=[holding(t), fits(t, f), present(f), free(f)], eff=[~present(f)], cost=1),
        ns.Action("remove", p, pre=[empty_hand, present(p), free(p)], eff=[~present(p)], cost=2),
    ],
)

HOLES = {"hex 1": (1, 1), "hex 2": (1, 5), "hex 3": (9, 1), "hex 4": (9, 5), "slotted 1": (4, 3), "slotted 2": (7, 3)}


def housing():
    """A box, a cover on it with six holes, and in each hole a bolt whose head rests on the cover."""
    area = [(x, y) for x in range(12) for y in range(7)]
    cells = {"box": [(x, y, 0) for x, y in area], "cover": [(x, y, 1) for x, y in area if (x, y) not in HOLES.values()]}
    for name, (x, y) in HOLES.items():
        cells[name] = [(x, y, 1), (x, y, 2), (x + 1, y, 2)]
    return ns.Assembly.from_cells(cells)


def problem():
    """Take the cover off, and leave no tool in the hand."""
    drivers = {"hex": "hex key", "slotted": "screwdriver"}
    return UNBOLT.problem(
        world=housing(),
        objects={plate: ["box", "cover"], fastener: list(HOLES), tool: list(drivers.values())},
        init=[present(n) for n in ("box", "cover", *HOLES)] + [fits(drivers[n.split()[0]], n) for n in HOLES],
        goal=[~present("cover"), present("box")],
    )


# -- what it shows --------------------------------------------------------------------------------------------
def main(film: str | None = None) -> ns.PlanResult:
    task = problem()
    result = ns.solve(task, planner="best-first")
    for number, (step, motion) in enumerate(zip(result.plan, result.motions), 1):
        print(f"{number:2}. {step}{f', {motion.course}' if motion else ''}")
    print(f"It costs {result.total_cost:g}; proved that none costs less: {result.cheapest}.")
    print("Replayed with geometry asked anew:", ns.validate(task, result.plan, result.motions).reason)
    if film:
        from neurosym.planning.staging import stage
        from neurosym.simulation.animation import frames
        from neurosym.simulation.film_files import write_film

        write_film(frames(stage(task, result.plan, result.motions)), film)
    return result


if __name__ == "__main__":
    main(*sys.argv[1:2])
