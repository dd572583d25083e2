"""STEP files of boxes, written by hand: what a CAD program would export, in a few dozen lines."""

from __future__ import annotations

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


def step_boxes(parts: dict[str, tuple[tuple[float, ...], tuple[float, ...]]]) -> str:
    """STEP, in millimetres, of boxes from one corner to the other, a product each."""
    lines: list[str] = []

    def add(text: str) -> str:
        lines.append(f"#{len(lines) + 1}={text};\n")
        return f"#{len(lines)}"

    def triple(kind: str, values: object) -> str:
        return add(f"{kind}('',({','.join(repr(float(v)) for v in values)}))")  # type: ignore[attr-defined]

    context = add("APPLICATION_CONTEXT('automotive design')")
    length = add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))")
    angle = add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
    solid = add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
    exact = add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-07),{length},'','')")
    space = add(
        f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({exact}))"
        f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
    )
    for name, ends in parts.items():
        product = add(f"PRODUCT('{name}','{name}','',({add(f'''PRODUCT_CONTEXT('',{context},'mechanical')''')}))")
        formation = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        stage = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{context},'design')")
        definition = add(f"PRODUCT_DEFINITION('design','',{formation},{stage})")
        corner = {s: [ends[s >> k & 1][k] for k in range(3)] for s in range(8)}
        vertex = {s: add(f"VERTEX_POINT('',{triple('CARTESIAN_POINT', c)})") for s, c in corner.items()}
        edges: dict[tuple[int, int], str] = {}
        faces = []
        for axis in range(3):
            u, v = 1 << (axis + 1) % 3, 1 << (axis + 2) % 3
            for side in (0, 1 << axis):
                ring = [side, side + u, side + u + v, side + v][:: 1 if side else -1]
                around = []
                for a, b in zip(ring, ring[1:] + ring[:1]):
                    if (b, a) not in edges:
                        way = np.subtract(corner[b], corner[a])
                        along = add(f"VECTOR('',{triple('DIRECTION', way / np.linalg.norm(way))},1.)")
                        line = add(f"LINE('',{triple('CARTESIAN_POINT', corner[a])},{along})")
                        edges[a, b] = add(f"EDGE_CURVE('',{vertex[a]},{vertex[b]},{line},.T.)")
                    known, sense = (edges[b, a], "F") if (b, a) in edges else (edges[a, b], "T")
                    around.append(add(f"ORIENTED_EDGE('',*,*,{known},.{sense}.)"))
                bound = add(f"FACE_OUTER_BOUND('',{add(f'''EDGE_LOOP('',({','.join(around)}))''')},.T.)")
                normal, across = np.eye(3)[axis] * (1 if side else -1), np.eye(3)[(axis + 1) % 3]
                place = f"{triple('CARTESIAN_POINT', corner[ring[0]])},{triple('DIRECTION', normal)}"
                axes = add(f"AXIS2_PLACEMENT_3D('',{place},{triple('DIRECTION', across)})")
                faces.append(add(f"ADVANCED_FACE('',({bound}),{add(f'''PLANE('',{axes})''')},.T.)"))
        brep = add(f"MANIFOLD_SOLID_BREP('{name}',{add(f'''CLOSED_SHELL('',({','.join(faces)}))''')})")
        origin = f"{triple('CARTESIAN_POINT', (0, 0, 0))},{triple('DIRECTION', (0, 0, 1))}"
        frame = add(f"AXIS2_PLACEMENT_3D('',{origin},{triple('DIRECTION', (1, 0, 0))})")
        shape = add(f"ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',({frame},{brep}),{space})")
        add(f"SHAPE_DEFINITION_REPRESENTATION({add(f'''PRODUCT_DEFINITION_SHAPE('','',{definition})''')},{shape})")
    return _FILE.format(data="".join(lines))
