"""Which particles belong together: friends-of-friends on a mesh, quick and good enough to point a camera."""

import itertools

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

# Half of the 26 neighbours of a cell of the mesh: the other half finds the same pairs from the other side.
_HALF_NEIGHBOURS = [n for n in itertools.product((-1, 0, 1), repeat=3) if n > (0, 0, 0)]


def mean_spacing(position):
    """Distance of neighbours where the matter is dense [m]: that of a random sample to their nearest particle."""
    sample = np.random.default_rng(1).choice(len(position), size=min(200, len(position)), replace=False)
    distance, _ = cKDTree(position).query(position[sample], k=2)
    return float(np.median(distance[:, 1]))


def _keys(cells):
    return (cells[:, 0] << 42) + (cells[:, 1] << 21) + cells[:, 2]


def _pairs_of_touching_cells(cells):
    keys = _keys(cells)
    first, second = [], []
    for neighbour in _HALF_NEIGHBOURS:
        wanted = _keys(cells + np.array(neighbour))
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        found = keys[place] == wanted
        first.append(np.flatnonzero(found))
        second.append(place[found])
    return np.concatenate(first), np.concatenate(second)


def largest(position, length):
    """Mask of the particles in the largest group of occupied, touching cubes of side `length` [m]."""
    limit = 2**20 - 2  # cells along an axis that fit into a key; what is farther out joins no clump
    cells = np.clip(np.floor((position - np.median(position, axis=0)) / length), -limit, limit).astype(np.int64)
    cells += 2**20
    order = np.argsort(_keys(cells), kind="stable")
    unique, start, inverse = np.unique(_keys(cells)[order], return_index=True, return_inverse=True)
    cell_of_particle = np.empty(len(position), dtype=np.int64)
    cell_of_particle[order] = inverse.reshape(-1)
    first, second = _pairs_of_touching_cells(cells[order][start])
    touching = coo_matrix((np.ones(len(first), dtype=np.int8), (first, second)), shape=(len(unique), len(unique)))
    _, label = connected_components(touching, directed=False)
    members = np.bincount(label[cell_of_particle])
    return label[cell_of_particle] == members.argmax()
