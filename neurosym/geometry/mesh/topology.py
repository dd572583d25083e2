"""Triangle meshes as graphs: merged vertices, open edges, shells, windings. All of it whole arrays at a time."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from neurosym.geometry.mesh.connections import adjacent, alike, connected, opposite
from neurosym.support.arrays import Array, Numbers, Truths

#: Open edges beyond this number are a hole, not a row of T-junctions: nobody is asked to match them up.
MAX_OPEN_EDGES = 5_000


def in_use(vertices: Array, faces: Numbers) -> Truths:
    """bool (n,): which vertices some face has for a corner."""
    used = np.zeros(len(vertices), dtype=bool)
    used[faces] = True
    return used


def merged(vertices: Array, faces: Numbers, within: float = 0.0) -> tuple[Array, Numbers]:
    """Vertices in one place made one, unused ones dropped; `within` a length: chains of nearer ones, too."""
    used = in_use(vertices, faces)
    # Adding 0 turns -0 into 0.
    vertices, faces = vertices[used] + 0.0, (np.cumsum(used) - 1)[faces]
    groups, first = alike(vertices)
    vertices, faces = vertices[first], groups[faces]
    if within > 0:
        from scipy.spatial import cKDTree

        pairs = cKDTree(vertices).query_pairs(within, output_type="ndarray")
        if len(pairs):
            labels = _components(pairs, len(vertices))
            _, first = np.unique(labels, return_index=True)
            vertices, faces = vertices[first], labels[faces]
    return vertices, faces


def without_repeats(faces: Numbers, *, cancel: bool = True) -> Numbers:
    """The faces that have three corners, each once; a face and its mirror image cancel, or else are one."""
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    if not len(faces):
        return faces
    # From the least corner on, so that one face has one form; the sign says which way round it goes.
    start = np.argmin(faces, axis=1)
    one, two, three = (faces[np.arange(len(faces)), (start + k) % 3] for k in range(3))
    group, first = alike(np.stack([one, np.minimum(two, three), np.maximum(two, three)], axis=1))
    windings = np.zeros((len(first), 2), dtype=bool)
    windings[group, (two < three).astype(int)] = True
    kept = np.zeros(len(faces), dtype=bool)
    kept[first] = ~(cancel & windings.all(axis=1))
    return faces[kept]


def _components(pairs: Numbers, count: int) -> Numbers:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def half_edges(faces: Numbers) -> tuple[Numbers, Numbers]:
    """The half edges of faces (m, 3): start and end, int64 (3 m, 2), and the number of the edge of each, (3 m,).

    Half edge h belongs to face h // 3.
    """
    start, end = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    edge = alike(np.stack([np.minimum(start, end), np.maximum(start, end)], axis=1))[0]
    return np.stack([start, end], axis=1), edge


def _upward(half: Numbers) -> Array:
    """+1 for a half edge that runs to the higher number, -1 for one that comes back."""
    return np.where(half[:, 0] < half[:, 1], 1.0, -1.0)


def open_edges(faces: Numbers) -> tuple[Numbers, bool]:
    """Half edges (k, 2) that no face comes back along; and whether turning faces might close them all."""
    half, edge = half_edges(faces)
    balance = np.bincount(edge, weights=_upward(half))
    # Of an edge that is gone along more often one way, the halves of that way are open.
    odd = _upward(half) == np.sign(balance[edge])
    return half[odd], bool(odd.any() and (np.bincount(edge) % 2 == 0).all())


def neighbours(faces: Numbers) -> tuple[Numbers, Truths]:
    """Faces that share an edge with each other and no third, int64 (k, 2), and whether both go along it alike."""
    other = opposite(faces)
    half = np.flatnonzero(other > np.arange(len(other)))
    start = faces.ravel()
    return np.stack([half, other[half]], axis=1) // 3, start[half] == start[other[half]]


def same_winding(faces: Numbers) -> Numbers | None:
    """The faces turned so that neighbours agree, or None where no way of turning does (a Moebius strip).

    Each face is two nodes, as it is and turned; neighbours join the nodes that agree. Where a face falls into one
    component with its own opposite, the surface has but one side.
    """
    pairs, alike = neighbours(faces)
    m = len(faces)
    one, two = pairs.T
    here = np.stack([one, two + m * alike], axis=1)
    there = np.stack([one + m, two + m * ~alike], axis=1)
    labels = _components(np.concatenate([here, there]), 2 * m)
    if (labels[:m] == labels[m:]).any():
        return None
    turned = labels[:m] > labels[m:]
    return np.where(turned[:, None], faces[:, ::-1], faces)


def shells_of(faces: Numbers) -> Numbers:
    """int64 (m,): the number of the shell that each face belongs to; shells that meet in an edge are two."""
    return connected(adjacent(faces))


def unshared(faces: Numbers, groups: Numbers) -> tuple[Numbers, Numbers]:
    """Faces (m, 3) numbered anew, so that those of different groups share no vertex; and what each number was."""
    count = int(faces.max()) + 1
    numbers, split = np.unique(faces + groups[:, None] * count, return_inverse=True)
    return split.reshape(-1, 3).astype(np.int64), numbers % count


def closed_shells(faces: Numbers) -> Numbers | None:
    """The shells, if each of them is closed by itself."""
    shells = shells_of(faces)
    return None if len(open_edges(unshared(faces, shells)[0])[0]) else shells


def closed_runs(faces: Numbers) -> Numbers:
    """int64 (m,): the number of the run that each face belongs to: faces in their order, until their edges close."""
    edge = half_edges(faces)[1]
    face = np.arange(len(edge)) // 3
    order = np.lexsort((face, edge))
    place = np.arange(len(edge)) - np.searchsorted(edge[order], edge[order])
    # The first face along an edge leaves it open, the second closes it, a third opens it again.
    opened = np.bincount(face[order], weights=1 - 2 * (place % 2), minlength=len(faces)).cumsum()
    return np.concatenate([[0], (opened == 0).cumsum()[:-1]])


def closes_at_junctions(vertices: Array, faces: Numbers, within: float) -> bool:
    """Whether the open edges close once each is cut at the open corners that lie on it, nearer than `within`."""
    half, _ = open_edges(faces)
    if not 0 < len(half) <= MAX_OPEN_EDGES:
        return False
    corners = np.unique(half)
    from scipy.spatial import cKDTree

    tree = cKDTree(vertices[corners])
    pieces = []
    for start, end in half:
        a, along = vertices[start], vertices[end] - vertices[start]
        length = float(np.linalg.norm(along))
        near = corners[tree.query_ball_point(a + along / 2, length / 2 + within)]
        share = (vertices[near] - a) @ along / max(length**2, 1e-300)
        off = np.linalg.norm(vertices[near] - a - share[:, None] * along, axis=1)
        on = (off <= within) & (share * length > within) & ((1 - share) * length > within)
        chain = [start, *near[on][np.argsort(share[on])], end]
        pieces += list(pairwise(chain))
    cut = np.array(pieces, dtype=np.int64)
    edge = np.unique(cut.min(axis=1) * len(vertices) + cut.max(axis=1), return_inverse=True)[1]
    return not np.bincount(edge, weights=_upward(cut)).any()


def shell_volumes(vertices: Array, faces: Numbers, shells: Numbers) -> Array:
    """Signed volume of each shell, float64 (k,), positive where its faces point outward."""
    a, b, c = (vertices[faces[:, k]] - vertices.mean(axis=0) for k in range(3))
    return np.asarray(np.bincount(shells, weights=_six_volumes(a, b, c) / 6), dtype=np.float64)


def signed_volume(vertices: Array, faces: Numbers) -> float:
    """Volume enclosed by a closed mesh, positive when its faces point outward (divergence theorem)."""
    return float(_six_volumes(*(vertices[faces[:, k]] - vertices[0] for k in range(3))).sum() / 6)


def volume_and_centre(vertices: Array, faces: Numbers) -> tuple[float, Array]:
    """The same, and the centroid, float64 (3,)."""
    a, b, c = (vertices[faces[:, k]] - vertices[0] for k in range(3))
    six = _six_volumes(a, b, c)
    volume = float(six.sum() / 6)
    return volume, vertices[0] + (six[:, None] / 6 * (a + b + c)).sum(axis=0) / (4 * volume)


def _six_volumes(a: Array, b: Array, c: Array) -> Array:
    """float64 (m,): six times the volumes of tetrahedra with a corner at the origin and three at rows of a, b, c."""
    return np.asarray(np.einsum("nd,nd->n", a, np.cross(b, c)))
