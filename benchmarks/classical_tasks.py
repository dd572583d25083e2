"""Generators of classical planning tasks in the standard shapes, as PDDL texts."""

from itertools import pairwise

import numpy as np

DOMAINS = {
    "blocks": """(define (domain blocks) (:requirements :strips)
 (:predicates (on ?x ?y) (ontable ?x) (clear ?x) (handempty) (holding ?x))
 (:action pick-up :parameters (?x) :precondition (and (clear ?x) (ontable ?x) (handempty))
  :effect (and (not (ontable ?x)) (not (clear ?x)) (not (handempty)) (holding ?x)))
 (:action put-down :parameters (?x) :precondition (holding ?x)
  :effect (and (not (holding ?x)) (clear ?x) (handempty) (ontable ?x)))
 (:action stack :parameters (?x ?y) :precondition (and (holding ?x) (clear ?y))
  :effect (and (not (holding ?x)) (not (clear ?y)) (clear ?x) (handempty) (on ?x ?y)))
 (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (handempty))
  :effect (and (holding ?x) (clear ?y) (not (clear ?x)) (not (handempty)) (not (on ?x ?y)))))""",
    "gripper": """(define (domain gripper) (:requirements :strips :typing) (:types room ball hand)
 (:predicates (at-robby ?r - room) (at ?b - ball ?r - room) (free ?g - hand) (carry ?b - ball ?g - hand))
 (:action move :parameters (?a ?b - room) :precondition (at-robby ?a) :effect (and (at-robby ?b) (not (at-robby ?a))))
 (:action pick :parameters (?b - ball ?r - room ?g - hand)
  :precondition (and (at ?b ?r) (at-robby ?r) (free ?g))
  :effect (and (carry ?b ?g) (not (at ?b ?r)) (not (free ?g))))
 (:action drop :parameters (?b - ball ?r - room ?g - hand) :precondition (and (carry ?b ?g) (at-robby ?r))
  :effect (and (at ?b ?r) (free ?g) (not (carry ?b ?g)))))""",
    "logistics": """(define (domain logistics) (:requirements :strips :typing)
 (:types city place thing - object airport - place vehicle package - thing truck airplane - vehicle)
 (:predicates (in-city ?p - place ?c - city) (at ?o - thing ?p - place) (in ?k - package ?v - vehicle))
 (:action load :parameters (?k - package ?v - vehicle ?p - place) :precondition (and (at ?v ?p) (at ?k ?p))
  :effect (and (not (at ?k ?p)) (in ?k ?v)))
 (:action unload :parameters (?k - package ?v - vehicle ?p - place) :precondition (and (at ?v ?p) (in ?k ?v))
  :effect (and (not (in ?k ?v)) (at ?k ?p)))
 (:action drive :parameters (?t - truck ?a ?b - place ?c - city)
  :precondition (and (at ?t ?a) (in-city ?a ?c) (in-city ?b ?c)) :effect (and (not (at ?t ?a)) (at ?t ?b)))
 (:action fly :parameters (?f - airplane ?a ?b - airport) :precondition (at ?f ?a)
  :effect (and (not (at ?f ?a)) (at ?f ?b))))""",
    "miconic": """(define (domain miconic) (:requirements :strips :typing) (:types passenger floor)
 (:predicates (origin ?p - passenger ?f - floor) (destin ?p - passenger ?f - floor) (above ?a ?b - floor)
  (boarded ?p - passenger) (served ?p - passenger) (lift-at ?f - floor))
 (:action board :parameters (?f - floor ?p - passenger) :precondition (and (lift-at ?f) (origin ?p ?f))
  :effect (boarded ?p))
 (:action depart :parameters (?f - floor ?p - passenger)
  :precondition (and (lift-at ?f) (destin ?p ?f) (boarded ?p)) :effect (and (not (boarded ?p)) (served ?p)))
 (:action up :parameters (?a ?b - floor) :precondition (and (lift-at ?a) (above ?a ?b))
  :effect (and (lift-at ?b) (not (lift-at ?a))))
 (:action down :parameters (?a ?b - floor) :precondition (and (lift-at ?a) (above ?b ?a))
  :effect (and (lift-at ?b) (not (lift-at ?a)))))""",
    "depot": """(define (domain depot) (:requirements :strips :typing)
 (:types place locatable - object truck hoist surface - locatable pallet crate - surface)
 (:predicates (at ?x - locatable ?y - place) (on ?x - crate ?y - surface) (in ?x - crate ?y - truck)
  (lifting ?x - hoist ?y - crate) (available ?x - hoist) (clear ?x - surface))
 (:action drive :parameters (?x - truck ?y ?z - place) :precondition (at ?x ?y)
  :effect (and (not (at ?x ?y)) (at ?x ?z)))
 (:action lift :parameters (?x - hoist ?y - crate ?z - surface ?p - place)
  :precondition (and (at ?x ?p) (available ?x) (at ?y ?p) (on ?y ?z) (clear ?y))
  :effect (and (not (at ?y ?p)) (lifting ?x ?y) (not (clear ?y)) (not (available ?x)) (clear ?z)
   (not (on ?y ?z))))
 (:action drop :parameters (?x - hoist ?y - crate ?z - surface ?p - place)
  :precondition (and (at ?x ?p) (at ?z ?p) (clear ?z) (lifting ?x ?y))
  :effect (and (available ?x) (not (lifting ?x ?y)) (at ?y ?p) (not (clear ?z)) (clear ?y) (on ?y ?z)))
 (:action load :parameters (?x - hoist ?y - crate ?z - truck ?p - place)
  :precondition (and (at ?x ?p) (at ?z ?p) (lifting ?x ?y))
  :effect (and (not (lifting ?x ?y)) (in ?y ?z) (available ?x)))
 (:action unload :parameters (?x - hoist ?y - crate ?z - truck ?p - place)
  :precondition (and (at ?x ?p) (at ?z ?p) (available ?x) (in ?y ?z))
  :effect (and (not (in ?y ?z)) (not (available ?x)) (lifting ?x ?y))))""",
    "satellite": """(define (domain satellite) (:requirements :strips :typing)
 (:types satellite direction instrument mode)
 (:predicates (on-board ?i - instrument ?s - satellite) (supports ?i - instrument ?m - mode)
  (pointing ?s - satellite ?d - direction) (power-avail ?s - satellite) (power-on ?i - instrument)
  (calibrated ?i - instrument) (have-image ?d - direction ?m - mode)
  (calibration-target ?i - instrument ?d - direction))
 (:action turn-to :parameters (?s - satellite ?new ?old - direction) :precondition (pointing ?s ?old)
  :effect (and (pointing ?s ?new) (not (pointing ?s ?old))))
 (:action switch-on :parameters (?i - instrument ?s - satellite)
  :precondition (and (on-board ?i ?s) (power-avail ?s))
  :effect (and (power-on ?i) (not (calibrated ?i)) (not (power-avail ?s))))
 (:action switch-off :parameters (?i - instrument ?s - satellite) :precondition (and (on-board ?i ?s) (power-on ?i))
  :effect (and (not (power-on ?i)) (power-avail ?s)))
 (:action calibrate :parameters (?s - satellite ?i - instrument ?d - direction)
  :precondition (and (on-board ?i ?s) (calibration-target ?i ?d) (pointing ?s ?d) (power-on ?i))
  :effect (calibrated ?i))
 (:action take-image :parameters (?s - satellite ?d - direction ?i - instrument ?m - mode)
  :precondition (and (calibrated ?i) (on-board ?i ?s) (supports ?i ?m) (power-on ?i) (pointing ?s ?d))
  :effect (have-image ?d ?m)))""",
    "zenotravel": """(define (domain zenotravel) (:requirements :strips :typing)
 (:types aircraft person - thing thing city flevel - object)
 (:predicates (at ?x - thing ?c - city) (in ?p - person ?a - aircraft) (fuel-level ?a - aircraft ?l - flevel)
  (next ?a ?b - flevel))
 (:action board :parameters (?p - person ?a - aircraft ?c - city) :precondition (and (at ?p ?c) (at ?a ?c))
  :effect (and (not (at ?p ?c)) (in ?p ?a)))
 (:action debark :parameters (?p - person ?a - aircraft ?c - city) :precondition (and (in ?p ?a) (at ?a ?c))
  :effect (and (not (in ?p ?a)) (at ?p ?c)))
 (:action fly :parameters (?a - aircraft ?c ?d - city ?k ?l - flevel)
  :precondition (and (at ?a ?c) (fuel-level ?a ?k) (next ?l ?k))
  :effect (and (not (at ?a ?c)) (at ?a ?d) (not (fuel-level ?a ?k)) (fuel-level ?a ?l)))
 (:action refuel :parameters (?a - aircraft ?c - city ?l ?m - flevel)
  :precondition (and (fuel-level ?a ?l) (next ?l ?m) (at ?a ?c))
  :effect (and (fuel-level ?a ?m) (not (fuel-level ?a ?l)))))""",
}


def task(domain: str, size: int, seed: int = 0) -> tuple[str, str]:
    """The texts of a domain and of a random problem of it."""
    rng = np.random.default_rng([seed, size])
    objects, init, goal = globals()[f"_{domain}"](size, rng)
    typed = " ".join(f"{' '.join(names)} - {kind}" if kind else " ".join(names) for kind, names in objects.items())
    text = f"(define (problem p{size}) (:domain {domain}) (:objects {typed})\n"
    facts = "\n  ".join(f"({fact})" for fact in init)
    aims = " ".join(f"({fact})" for fact in goal)
    return DOMAINS[domain], f"{text} (:init {facts})\n (:goal (and {aims})))"


def _names(letter: str, count: int) -> list[str]:
    return [f"{letter}{i}" for i in range(count)]


def _towers(names: list[str], rng: np.random.Generator) -> list[str]:
    """Facts of a random arrangement of blocks."""
    facts, below = [], ""
    for name in rng.permutation(names):
        if below and rng.random() < 0.7:
            facts.append(f"on {name} {below}")
        else:
            facts += [f"ontable {name}", *([f"clear {below}"] if below else [])]
        below = str(name)
    return [*facts, f"clear {below}"]


def _blocks(size, rng):
    names = _names("b", size)
    wanted = [fact for fact in _towers(names, rng) if fact.startswith("on ")]
    return {"": names}, [*_towers(names, rng), "handempty"], wanted or [f"ontable {names[0]}"]


def _gripper(size, rng):
    balls = _names("ball", size)
    init = ["at-robby rooma", "free left", "free right", *(f"at {b} rooma" for b in balls)]
    objects = {"room": ["rooma", "roomb"], "ball": balls, "hand": ["left", "right"]}
    return objects, init, [f"at {b} roomb" for b in balls]


def _logistics(size, rng):
    cities, packages, planes = _names("c", 3 + size // 6), _names("k", size), _names("f", 1 + size // 8)
    airports = [f"{c}air" for c in cities]
    places = [f"{c}p{i}" for c in cities for i in range(2)]
    everywhere = airports + places
    trucks = [f"{c}t" for c in cities]
    init = [f"in-city {p} {p[:2]}" for p in everywhere] + [f"at {t} {t[:-1]}p0" for t in trucks]
    init += [f"at {f} {rng.choice(airports)}" for f in planes] + [f"at {k} {rng.choice(everywhere)}" for k in packages]
    objects = {"city": cities, "airport": airports, "place": places, "truck": trucks, "airplane": planes}
    return objects | {"package": packages}, init, [f"at {k} {rng.choice(everywhere)}" for k in packages]


def _miconic(size, rng):
    people, floors = _names("p", size), _names("f", 2 * size)
    init = [f"above {a} {b}" for i, a in enumerate(floors) for b in floors[i + 1 :]] + ["lift-at f0"]
    for person in people:
        start, end = rng.choice(floors, 2, replace=False)
        init += [f"origin {person} {start}", f"destin {person} {end}"]
    return {"passenger": people, "floor": floors}, init, [f"served {p}" for p in people]


def _depot(size, rng):
    places, crates = _names("place", 3), _names("crate", size)
    pallets, hoists, trucks = _names("pallet", 3), _names("hoist", 3), _names("truck", 2)
    init = [f"at {t} {rng.choice(places)}" for t in trucks]
    init += [f"at {x} {p}" for kind in (pallets, hoists) for x, p in zip(kind, places)]
    init += [f"available {h}" for h in hoists]
    tops = dict(zip(places, pallets))
    for crate in crates:
        place = str(rng.choice(places))
        init += [f"at {crate} {place}", f"on {crate} {tops[place]}"]
        tops[place] = crate
    init += [f"clear {top}" for top in tops.values()]
    goal, wanted = [], list(pallets)
    for crate in rng.permutation(crates)[: max(1, 2 * size // 3)]:
        under = int(rng.integers(3))
        goal.append(f"on {crate} {wanted[under]}")
        wanted[under] = str(crate)
    objects = {"place": places, "truck": trucks, "hoist": hoists, "pallet": pallets, "crate": crates}
    return objects, init, goal


def _satellite(size, rng):
    satellites, directions, modes = _names("s", 1 + size // 4), _names("d", size + 3), _names("m", 3)
    instruments, init = [], []
    for satellite in satellites:
        init += [f"power-avail {satellite}", f"pointing {satellite} {rng.choice(directions)}"]
        for k in range(2):
            instrument = f"i{satellite}{k}"
            instruments.append(instrument)
            init += [f"on-board {instrument} {satellite}", f"calibration-target {instrument} {rng.choice(directions)}"]
            init += [f"supports {instrument} {m}" for m in modes if k == 0 or rng.random() < 0.5]
    goal = [f"have-image {d} {rng.choice(modes)}" for d in directions[:size]]
    objects = {"satellite": satellites, "direction": directions, "mode": modes, "instrument": instruments}
    return objects, init, goal


def _zenotravel(size, rng):
    cities, people, planes = _names("c", 3 + size // 3), _names("p", size), _names("a", 1 + size // 5)
    levels = _names("fl", 7)
    init = [f"next {a} {b}" for a, b in pairwise(levels)]
    init += [fact for a in planes for fact in (f"at {a} {rng.choice(cities)}", f"fuel-level {a} {rng.choice(levels)}")]
    init += [f"at {p} {rng.choice(cities)}" for p in people]
    goal = [f"at {p} {rng.choice(cities)}" for p in people]
    return {"city": cities, "person": people, "aircraft": planes, "flevel": levels}, init, goal


#: Sizes: blocks, balls, packages, passengers, crates, images, people.
SIZES = {
    "blocks": (8, 11, 14, 17, 20),
    "gripper": (4, 8, 12, 16, 20),
    "logistics": (4, 6, 8, 10, 12),
    "miconic": (5, 10, 15, 20, 25),
    "depot": (2, 4, 6, 8, 10),
    "satellite": (4, 6, 8, 10, 12),
    "zenotravel": (3, 5, 7, 9, 11),
}
