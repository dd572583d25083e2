"""URDF: links as parts where the joints put them, and files only inside the robot's folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pybullet_data
import pytest
from broken_inputs import box, obj, write

import neurosym as ns

ROBOTS = Path(pybullet_data.getDataPath())

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <link name="world"/>
  <link name="base">
    <inertial><mass value="8"/></inertial>
    <visual><origin xyz="0 0 0.5"/><geometry><box size="2 2 1"/></geometry></visual>
    <collision><origin xyz="0 0 0.5"/><geometry><box size="4 4 1"/></geometry></collision>
  </link>
  <link name="arm">
    <visual><origin xyz="0 0 1" rpy="0 1.5707963267948966 0"/><geometry><cylinder radius="0.5" length="3"/></geometry>
    </visual>
  </link>
  <link name="ball"><visual><geometry><sphere radius="0.25"/></geometry></visual></link>
  <link name="tool"><visual><geometry><mesh filename="{mesh}" scale="1 1 -2"/></geometry></visual></link>
  <joint name="ground" type="fixed"><parent link="world"/><child link="base"/></joint>
  <joint name="hinge" type="revolute"><origin xyz="0 0 1"/><parent link="base"/><child link="arm"/><axis xyz="0 0 2"/>
  </joint>
  <joint name="slide" type="prismatic"><origin xyz="5 0 0"/><parent link="arm"/><child link="ball"/><axis xyz="1 0 0"/>
    <mimic joint="hinge" multiplier="2" offset="1"/></joint>
  <joint name="flange" type="fixed"><origin xyz="0 0 5"/><parent link="base"/><child link="tool"/></joint>
</robot>
"""


def robot(folder: Path, mesh: str = "tool.obj") -> Path:
    write(folder / "tool.obj", obj(box()))
    return write(folder / "arm.urdf", ARM.format(mesh=mesh))


def span(assembly: ns.Assembly, part: str) -> np.ndarray:
    return assembly.bodies.part_bounds[assembly.index[part]]


def test_links_are_parts_where_their_joints_put_them(tmp_path: Path):
    assembly = ns.Assembly.load(robot(tmp_path))
    assert (assembly.names, assembly.units, assembly.fixed) == (("base", "arm", "ball", "tool"), "m", ("base",))
    np.testing.assert_allclose(span(assembly, "base"), [[-1, -1, 0], [1, 1, 1]])
    np.testing.assert_allclose(span(assembly, "arm"), [[-1.5, -0.5, 1.5], [1.5, 0.5, 2.5]], atol=1e-9)
    np.testing.assert_allclose(span(assembly, "ball"), [[5.75, -0.25, 0.75], [6.25, 0.25, 1.25]], atol=1e-9)
    np.testing.assert_allclose(
        span(assembly, "tool"), [[-0.5, -0.5, 4], [0.5, 0.5, 6]], atol=1e-9
    )
    assert assembly["base"].density == pytest.approx(2)
    assert "inverted" not in [note.kind for note in assembly.notes]


def test_a_configuration_moves_what_hangs_on_a_joint(tmp_path: Path):
    assembly = ns.Assembly.load(robot(tmp_path), joints={"hinge": np.pi / 2})
    np.testing.assert_allclose(span(assembly, "arm"), [[-0.5, -1.5, 1.5], [0.5, 1.5, 2.5]], atol=1e-9)
    middle = span(assembly, "ball").mean(axis=0)
    np.testing.assert_allclose(middle, [0, 5 + 1 + np.pi, 1], atol=1e-9)
    np.testing.assert_allclose(span(assembly, "base"), [[-1, -1, 0], [1, 1, 1]])
    with pytest.raises(ns.InputError, match="Did you mean 'hinge'"):
        ns.Assembly.load(robot(tmp_path), joints={"hing": 1.0})
    with pytest.raises(ns.InputError, match="a number for the joint"):
        ns.Assembly.load(robot(tmp_path), joints={"hinge": float("nan")})


def test_what_links_collide_as_can_be_read_instead(tmp_path: Path):
    assembly = ns.Assembly.load(robot(tmp_path), meshes="collision")
    assert (assembly.names, assembly.fixed) == (("base",), ("base",))
    np.testing.assert_allclose(span(assembly, "base"), [[-2, -2, 0], [2, 2, 1]])
    with pytest.raises(ns.InputError, match="collision"):
        ns.Assembly.load(robot(tmp_path), meshes="collisions")


@pytest.mark.parametrize("mesh", ["package://arm/tool.obj", "package://meshes/tool.obj", "../meshes/tool.obj"])
def test_a_package_is_the_folder_that_says_so(mesh: str, tmp_path: Path):
    package = tmp_path / "arm"
    path = robot(package / "urdf", mesh)
    write(package / "package.xml", "<package><name>arm</name></package>")
    (package / "meshes").mkdir()
    (package / "urdf" / "tool.obj").rename(package / ("tool.obj" if "arm" in mesh else "meshes/tool.obj"))
    assert len(ns.Assembly.load(path)) == 4
    (package / "package.xml").unlink()
    with pytest.raises(ns.InputError, match=r"lies outside|can be read"):
        ns.Assembly.load(path)


def test_links_that_cannot_be_used_are_named_with_the_way_out(tmp_path: Path):
    path = robot(tmp_path)
    write(tmp_path / "tool.obj", obj((box()[0], box()[1][1:])))
    with pytest.raises(ns.AssemblyError, match=r"'tool' is open: 3 edges(.|\n)*--meshes collision"):
        ns.Assembly.load(path)


def test_robots_of_others(tmp_path: Path):
    block = ns.Assembly.load(ROBOTS / "block.urdf")
    assert (len(block), block.fixed) == (1, block.names)
    car = ns.Assembly.load(ROBOTS / "racecar" / "racecar.urdf", meshes="collision")
    assert len(car) == 6
    for name, part in (("kuka_iiwa/model.urdf", "lbr_iiwa_link_7"), ("franka_panda/panda.urdf", "panda_link3")):
        with pytest.raises(ns.AssemblyError, match="is open") as caught:
            ns.Assembly.load(ROBOTS / name)
        assert (part, "open") in {(note.part, note.kind) for note in caught.value.notes}  # type: ignore[attr-defined]
