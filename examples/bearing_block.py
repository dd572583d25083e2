"""A mechanism as CAD exports it: a bearing block of 24 parts with play, press fits, round surfaces, in three formats.

It shows that a folder of STL files, a GLB scene and a STEP file (faceted) give the same plan without gravity, and what
gravity says of parts that are drawn with play. Bolts go through holes 0.1 mm wider, pins and the bearing are pressed
in by 0.01 mm, threads are plain cylinders, clips sit in grooves.

    python examples/bearing_block.py FOLDER
    neurosym view FOLDER/block.glb --no-gravity --fixed base
"""

import sys
from pathlib import Path

import numpy as np
import shapely
import trimesh
from trimesh.creation import annulus, cylinder, extrude_polygon, icosphere, revolve

import neurosym as ns

BOLTS, PINS = [(x, y) for x in (-33, 33) for y in (-33, 33)], [(-33, 0), (33, 0)]
FINE = {"sections": 32}


def up(mesh: trimesh.Trimesh, z: float, at: tuple[float, float] = (0, 0)) -> trimesh.Trimesh:
    """The mesh moved so that its lowest point is at height z, from above the origin to above a place."""
    return mesh.apply_translation((*at, z - mesh.bounds[0, 2]))


def plate(z: float, height: float, bore: float, bolts: float, pins: float) -> trimesh.Trimesh:
    """A square plate with a bore, and holes for bolts and pins, of these radii; without a radius no hole."""
    holes = [((0, 0), bore), *((p, bolts) for p in BOLTS), *((p, pins) for p in PINS)]
    plan = shapely.box(-40, -40, 40, 40) - shapely.union_all([shapely.Point(p).buffer(r, 8) for p, r in holes])
    return up(extrude_polygon(plan, height), z)


def mechanism() -> dict[str, trimesh.Trimesh]:
    """Name -> mesh, in millimetres, z up."""
    parts = {
        "base": plate(0, 10, 10.1, 3, 2),
        "housing": plate(10, 30, 25, 3.1, 2),
        "cap": plate(40, 6, 10.1, 3.1, 0),
        "outer ring": up(annulus(20, 25.01, 10, **FINE), 10),
        "inner ring": up(annulus(9.99, 14, 10, **FINE), 10),
        "shaft": revolve([(0, 0), (10, 0), (10, 50), (9, 50), (9, 52), (10, 52), (10, 56), (9, 56), (9, 58), (10, 58),
                          (10, 70), (0, 70)], **FINE),
    }  # fmt: skip
    parts |= {f"bolt {k}": up(revolve([(0, 0), (3, 0), (3, 46), (5, 46), (5, 50), (0, 50)], **FINE), 0, p)
              for k, p in enumerate(BOLTS)}  # fmt: skip
    parts |= {f"pin {k}": up(cylinder(2.01, 35, **FINE), 2, p) for k, p in enumerate(PINS)}
    ring = 17 * np.exp(2j * np.pi * np.arange(8) / 8)
    parts |= {f"ball {k}": up(icosphere(1, 3), 12, (p.real, p.imag)) for k, p in enumerate(ring)}
    clip = shapely.Point(0, 0).buffer(14, 8) - shapely.Point(0, 0).buffer(9.1, 8) - shapely.box(0, -9.1, 20, 9.1)
    parts |= {f"clip {k}": up(extrude_polygon(clip, 2), z) for k, z in enumerate((50, 56))}
    parts |= {f"collar {k}": up(annulus(10.1, 14, 4, **FINE), z) for k, z in enumerate((46, 52))}
    return parts


def step(parts: dict[str, trimesh.Trimesh]) -> str:
    """STEP (AP214) of faceted solids, a product each."""
    lines: list[str] = []

    def add(text: str) -> str:
        lines.append(f"#{len(lines) + 1}={text};")
        return f"#{len(lines)}"

    def triple(kind: str, values: np.ndarray) -> str:
        return add(f"{kind}('',({','.join(repr(float(v)) for v in values)}))")

    use = add("APPLICATION_CONTEXT('automotive design')")
    units = [add("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"),
             add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")]  # fmt: skip
    space = add(f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNIT_ASSIGNED_CONTEXT(({','.join(units)}))"
                "REPRESENTATION_CONTEXT('',''))")  # fmt: skip
    for name, mesh in parts.items():
        points, faces = [triple("CARTESIAN_POINT", v) for v in mesh.vertices], []
        for corners, normal in zip(mesh.faces, mesh.face_normals):
            along = triple("DIRECTION", mesh.vertices[corners[1]] - mesh.vertices[corners[0]])
            frame = f"AXIS2_PLACEMENT_3D('',{points[corners[0]]},{triple('DIRECTION', normal)},{along})"
            loop = add(f"POLY_LOOP('',({','.join(points[c] for c in corners)}))")
            bound = add(f"FACE_OUTER_BOUND('',{loop},.T.)")
            plane = add(f"PLANE('',{add(frame)})")
            faces.append(add(f"FACE_SURFACE('',({bound}),{plane},.T.)"))
        solid = add(f"FACETED_BREP('',{add(f'''CLOSED_SHELL('',({','.join(faces)}))''')})")
        shape = add(f"FACETED_BREP_SHAPE_REPRESENTATION('{name}',({solid}),{space})")
        product = add(f"PRODUCT('{name}','{name}','',({add(f'''PRODUCT_CONTEXT('',{use},'mechanical')''')}))")
        made = add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        stage = add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{use},'design')")
        shown = add(f"PRODUCT_DEFINITION_SHAPE('','',{add(f'''PRODUCT_DEFINITION('','',{made},{stage})''')})")
        add(f"SHAPE_DEFINITION_REPRESENTATION({shown},{shape})")
    head = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    schema = "FILE_SCHEMA(('AUTOMOTIVE_DESIGN'));\nENDSEC;\nDATA;\n"
    return head + schema + "\n".join(lines) + "\nENDSEC;\nEND-ISO-10303-21;\n"


def write(folder: Path) -> dict[str, Path]:
    """The mechanism as a folder of STL files, as glTF (in metres) and as STEP."""
    parts = mechanism()
    (folder / "stl").mkdir(parents=True, exist_ok=True)
    for name, mesh in parts.items():
        mesh.export(folder / "stl" / f"{name}.stl")
    trimesh.Scene(parts).apply_scale(1e-3).export(folder / "block.glb")
    (folder / "block.step").write_text(step(parts))
    return {"mm": folder / "stl", "m": folder / "block.glb", "": folder / "block.step"}


def main(folder: Path) -> None:
    for units, path in write(folder).items():
        assembly = ns.Assembly.load(path, units=units or None)
        # A cage that is not drawn keeps the balls, which lie on nothing flat; what presses pins in is no preload here.
        kept = [name for name in assembly.names if name.startswith(("ball", "pin"))]
        for gravity, fixed in ((False, ["base"]), (True, ["base", *kept]), (True, ["base"])):
            problem = ns.load_domain("assembly").problem(assembly, gravity=gravity, fixed=fixed)
            result = ns.solve(problem, prior="outermost-first", budget=ns.Budget(seconds=10))
            print(f"{path.name:10} {len(fixed)} fixed, {'with' if gravity else 'no'} gravity:", end=" ")
            print(result.status.sentence if result.plan is None else " ".join(result.plan))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
