"""STEP files written by hand: boxes, bolts and nested assemblies of them, as a CAD program would export them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

_FILE = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION((''),'2;1');
FILE_NAME('','2020-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));
ENDSEC;
DATA;
{data}ENDSEC;
END-ISO-10303-21;
"""

_METRES = {"mm": ".MILLI.", "m": "$", "cm": ".CENTI."}

Corner = tuple[float, ...]


@dataclass
class Step:
    """A file as it is written; `unit` is that of its numbers, "in" as one that is defined by millimetres."""

    unit: str = "mm"
    lines: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.application = self.add("APPLICATION_CONTEXT('automotive design')")
        length = self.add(f"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({_METRES.get(self.unit, '.MILLI.')},.METRE.))")
        if self.unit == "in":
            inch = self.add(f"LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),{length})")
            powers = self.add("DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.)")
            length = self.add(f"(CONVERSION_BASED_UNIT('INCH',{inch})LENGTH_UNIT()NAMED_UNIT({powers}))")
        angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        exact = self.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{length},'','')")
        units = f"{angle},{solid}" if self.unit == "none" else f"{length},{angle},{solid}"
        self.space = self.add(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({exact}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({units}))REPRESENTATION_CONTEXT('',''))"
        )
        self.products: dict[str, tuple[str, str]] = {}

    def text(self) -> str:
        return _FILE.format(data="".join(self.lines))

    def add(self, text: str) -> str:
        self.lines.append(f"#{len(self.lines) + 1}={text};\n")
        return f"#{len(self.lines)}"

    def triple(self, kind: str, values: Sequence[float] | np.ndarray) -> str:
        return self.add(f"{kind}('',({','.join(repr(float(v)) for v in values)}))")

    def frame(self, origin: Corner = (0, 0, 0), z: Corner = (0, 0, 1), x: Corner = (1, 0, 0)) -> str:
        axes = (self.triple("CARTESIAN_POINT", origin), self.triple("DIRECTION", z), self.triple("DIRECTION", x))
        return self.add(f"AXIS2_PLACEMENT_3D('',{','.join(axes)})")

    # -- products -------------------------------------------------------------------------------------------------

    def part(self, name: str, solids: Sequence[str]) -> str:
        """A product of solids; its name is what `assembly` knows it by."""
        kind = "ADVANCED_BREP_SHAPE_REPRESENTATION"
        return self._product(name, self.add(f"{kind}('{name}',({','.join([self.frame(), *solids])}),{self.space})"))

    def assembly(self, name: str, members: Sequence[tuple[str, Corner]]) -> str:
        """A product of others, each moved by so much."""
        places = [self.frame(at) for _, at in members]
        whole = self.add(f"SHAPE_REPRESENTATION('{name}',({','.join([self.frame(), *places])}),{self.space})")
        self._product(name, whole)
        for number, ((member, _), place) in enumerate(zip(members, places)):
            definition, shape = self.products[member]
            used = f"'{number}','use {number}','',{self.products[name][0]},{definition},$"
            use = self.add(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE({used})")
            motion = self.add(f"ITEM_DEFINED_TRANSFORMATION('','',{self.frame()},{place})")
            moved = self.add(
                f"(REPRESENTATION_RELATIONSHIP('','',{shape},{whole})"
                f"REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION({motion})SHAPE_REPRESENTATION_RELATIONSHIP())"
            )
            shown = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{use})")
            self.add(f"CONTEXT_DEPENDENT_SHAPE_REPRESENTATION({moved},{shown})")
        return name

    def _product(self, name: str, shape: str) -> str:
        context = self.add(f"PRODUCT_CONTEXT('',{self.application},'mechanical')")
        product = self.add(f"PRODUCT('{name}','{name}','',({context}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        stage = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{self.application},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('design','',{formation},{stage})")
        shown = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION({shown},{shape})")
        self.products[name] = definition, shape
        return name

    # -- solids ---------------------------------------------------------------------------------------------------

    def box(self, low: Corner, high: Corner) -> str:
        """A box from one corner to the other."""
        corner = {s: [(low, high)[s >> k & 1][k] for k in range(3)] for s in range(8)}
        vertex = {s: self.add(f"VERTEX_POINT('',{self.triple('CARTESIAN_POINT', c)})") for s, c in corner.items()}
        edges: dict[tuple[int, int], str] = {}
        faces = []
        for axis in range(3):
            u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
            for side in (0, 1 << axis):
                ring = [side, side + u, side + u + v, side + v][:: 1 if side else -1]
                around = []
                for a, b in zip(ring, ring[1:] + ring[:1]):
                    if (b, a) not in edges:
                        edges[a, b] = self._line(corner[a], corner[b], vertex[a], vertex[b])
                    around.append((edges[b, a], "F") if (b, a) in edges else (edges[a, b], "T"))
                normal, across = np.eye(3)[axis] * (1 if side else -1), np.eye(3)[(axis + 1) % 3]
                frame = self.frame(tuple(corner[ring[0]]), tuple(normal), tuple(across))
                faces.append(self._face("PLANE", frame, around))
        return self._solid(faces)

    def cylinder(self, low: Corner, radius: float, height: float) -> str:
        """An upright cylinder from the middle of its lower face."""
        x, y, z = low
        top = (x, y, z + height)
        ends = [(x + radius, y, z), (x + radius, y, z + height)]
        vertex = [self.add(f"VERTEX_POINT('',{self.triple('CARTESIAN_POINT', c)})") for c in ends]
        rims = []
        for corner, place in zip(vertex, (low, top)):
            circle = self.add(f"CIRCLE('',{self.frame(place)},{float(radius)!r})")
            rims.append(self.add(f"EDGE_CURVE('',{corner},{corner},{circle},.T.)"))
        seam = self._line(*ends, *vertex)
        faces = [
            self._face("PLANE", self.frame(low, (0, 0, -1)), [(rims[0], "F")]),
            self._face("PLANE", self.frame(top), [(rims[1], "T")]),
            self._face(
                "CYLINDRICAL_SURFACE",
                self.frame(low),
                [(rims[0], "T"), (seam, "T"), (rims[1], "F"), (seam, "F")],
                f",{float(radius)!r}",
            ),
        ]
        return self._solid(faces)

    def _line(self, a: Sequence[float], b: Sequence[float], start: str, end: str) -> str:
        way = np.subtract(b, a)
        along = self.add(f"VECTOR('',{self.triple('DIRECTION', way / np.linalg.norm(way))},1.)")
        line = self.add(f"LINE('',{self.triple('CARTESIAN_POINT', a)},{along})")
        return self.add(f"EDGE_CURVE('',{start},{end},{line},.T.)")

    def _face(self, kind: str, frame: str, edges: Sequence[tuple[str, str]], more: str = "") -> str:
        around = [self.add(f"ORIENTED_EDGE('',*,*,{edge},.{sense}.)") for edge, sense in edges]
        bound = self.add(f"FACE_OUTER_BOUND('',{self.add(f'''EDGE_LOOP('',({','.join(around)}))''')},.T.)")
        return self.add(f"ADVANCED_FACE('',({bound}),{self.add(f'''{kind}('',{frame}{more})''')},.T.)")

    def _solid(self, faces: Sequence[str]) -> str:
        return self.add(f"MANIFOLD_SOLID_BREP('',{self.add(f'''CLOSED_SHELL('',({','.join(faces)}))''')})")


def step_boxes(parts: dict[str, tuple[Corner, Corner]], unit: str = "mm") -> str:
    """STEP of boxes from one corner to the other, a product each."""
    step = Step(unit)
    for name, ends in parts.items():
        step.part(name, [step.box(*ends)])
    return step.text()


def step_bolted(unit: str = "mm", size: float = 1.0) -> str:
    """A plate, and on it two pairs (an assembly used twice) of a bolt and a nut; `size` is what a length of 1 is.

    The plate is 100 x 40 x 10, the bolts of radius 4 stand on it, 20 high, with nuts of 12 x 12 x 6 on top.
    """
    step = Step(unit)

    def long(*values: float) -> Corner:
        return tuple(size * v for v in values)

    step.part("PLATE", [step.box(long(0, 0, 0), long(100, 40, 10))])
    step.part("BOLT", [step.cylinder(long(0, 0, 0), 4 * size, 20 * size)])
    step.part("NUT", [step.box(long(-6, -6, 0), long(6, 6, 6))])
    step.assembly("BOLT AND NUT", [("BOLT", (0, 0, 0)), ("NUT", long(0, 0, 20))])
    pairs = [("BOLT AND NUT", long(20, 20, 10)), ("BOLT AND NUT", long(80, 20, 10))]
    step.assembly("WHOLE", [("PLATE", (0, 0, 0)), *pairs])
    return step.text()
