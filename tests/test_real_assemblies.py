"""Geometry of the assemblies in shared/data, as they were drawn: everything is answered, one way as the other.

Masonry whose joints are oblique, overlap a little and are cut into slivers is where polygons go wrong.
"""

from pathlib import Path

import numpy as np
import pytest
import shapely

import neurosym as ns
from neurosym.geometry.mesh.polygons import intersections, union

SHARED = Path(__file__).parents[1] / ".." / "shared" / "data"
SLANTED = np.array([[1, 2, 3], [-2, 1, 0.5], [0.3, -1, 0.01]])


@pytest.mark.parametrize("name", ["arch", "bricks", "wall", "crossvault", "dome", "as1/as1_pe_203.stp"])
def test_what_hits_going_one_way_is_hit_going_the_other(name):
    if not (SHARED / name).exists():
        pytest.skip("the assemblies in ../shared/data are not here")
    geometry = ns.AssemblyGeometry(ns.Assembly.load(SHARED / name, units=None if "." in name else "m"))
    assert {c.a for c in geometry.contacts} | {c.b for c in geometry.contacts} > {0, len(geometry) - 1}
    hits = 0
    for direction in np.concatenate([np.eye(3), SLANTED / np.linalg.norm(SLANTED, axis=1, keepdims=True)]):
        there, back = (geometry._sweeps.along(d).pairs for d in (direction, -direction))
        assert set(map(tuple, there.tolist())) == set(map(tuple, back[:, ::-1].tolist()))
        hits += len(there)
    assert hits > len(geometry)


def crossed(rng, count):
    """Closed lines through random points: most cross themselves, which GEOS does not take for polygons."""
    return np.array([shapely.Polygon(rng.normal(size=(k, 2)).round(2)) for k in rng.integers(4, 12, count)])


@pytest.mark.parametrize("seed", range(5))
def test_polygons_that_cross_themselves_are_put_together_all_the_same(seed):
    rng = np.random.default_rng(seed)
    one, two = crossed(rng, 20), crossed(rng, 20)
    with pytest.raises(shapely.errors.GEOSException):
        shapely.intersection(one, two, grid_size=1e-3)
    common, together = intersections(one, two, 1e-3), union(np.concatenate([one, two]), 1e-3)
    areas = [shapely.area(shapely.make_valid(p, method="structure")) for p in (one, two)]
    assert (shapely.area(common) <= np.minimum(*areas) + 0.05).all()
    assert np.max(areas) - 1e-9 <= together.area <= np.sum(areas) + 1e-9
