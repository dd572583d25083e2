"""A window on a `World`: its bodies as they collide, in the colours of a plan's parts."""

import numpy as np
from scipy.spatial import ConvexHull

from neurosym.geometry.staging import Staging
from neurosym.simulation.scene import part_colours
from neurosym.simulation.solids import RigidBody, Solid
from neurosym.simulation.storyboard import best_camera, room_for
from neurosym.simulation.window import HIDDEN, Shown, Spectator, Window
from neurosym.simulation.world import World
from neurosym.support.arrays import Array, Numbers


class WorldWindow(Spectator):
    """Shows a world as its time passes (a context manager).

    `world`: what is simulated. `staging`: the plan that is done there, for colours and for the room that its paths
    want. Raises NeurosymError: there is no screen, or no OpenGL.
    """

    def __init__(self, world: World, staging: Staging) -> None:
        self._world, self._keys = world, tuple(world.made)
        colours = part_colours(staging)
        bodies = [Shown(colours[key[0]], triangles=_triangles(body)) for key, body in world.made.items()]
        ground = staging.assembly.ground * world.scale if staging.assembly.has_table else None
        self._window = Window(bodies, room_for(staging) * world.scale, best_camera(staging), ground)

    def tick(self) -> None:
        """One time step of the world has passed."""
        self._window.advance(self._world.physics.time_step, self._poses)

    def _poses(self) -> Array:
        frames = self._world.poses().frames
        return np.array([(*frames[key][0], *frames[key][1]) if key in frames else HIDDEN for key in self._keys])


def _triangles(body: RigidBody) -> Array:
    """float64 (n, 3, 3): the surface of a body in its own frame."""
    corners = [(_faces(solid), (solid.corners - body.X_WC[:3, 3]) @ body.X_WC[:3, :3]) for solid in body.solids]
    return np.concatenate([points[faces] for faces, points in corners])


def _faces(solid: Solid) -> Numbers:
    """int64 (n, 3), outward: of the mesh as it is, or of the hull of its corners."""
    if solid.faces is not None:
        return solid.faces
    hull, points = ConvexHull(solid.corners), solid.corners
    faces = np.array(hull.simplices, dtype=np.int64)
    a, b, c = (points[faces[:, i]] for i in range(3))
    inward = np.einsum("ni,ni->n", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    return faces
