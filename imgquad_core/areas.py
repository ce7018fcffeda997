"""Areas of the regions between polylines, and how they are given back what smoothing took.

Every chain is shifted across by one unknown d; the least shifts that give all regions their areas are
``d = lambda(right) - lambda(left)`` with ``L lambda = missing area`` and L the graph Laplacian of the regions, each
chain weighted by the length of it that can move. A few Newton steps, since areas are quadratic and nodes have bounds.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from imgquad_core.curves import Floats, Ints
from imgquad_core.jit import kernel

_STEPS = 5
_SMALL = 50  # px; smaller regions take what cannot be given to all
_GOOD = 1e-4  # share of a region's area that may stay missing


def polygon_areas(points: Floats, chain_points: Ints, offsets: Ints, sides: Ints, n_regions: int) -> Floats:
    """Area of each region within its chains, shape (n_regions,).

    Parameters
    ----------
    points, chain_points, offsets, sides
        As `points`, `chain_points`, `chain_offsets` and `chain_regions` of `BoundaryGraph`.
    n_regions : int
        Number of regions.
    """
    nowhere = np.zeros(len(chain_points))
    return _areas(_sweep(points, chain_points, offsets, nowhere, points, np.zeros(len(sides)))[0], sides, n_regions)


def _areas(swept: Floats, sides: Ints, n_regions: int) -> Floats:
    outer = np.where(sides < 0, n_regions, sides)
    area = np.bincount(outer[:, 0], swept, n_regions + 1) - np.bincount(outer[:, 1], swept, n_regions + 1)
    return np.asarray(area[:n_regions], np.float64)


def restore_areas(
    points: Floats, chain_points: Ints, offsets: Ints, sides: Ints, target: NDArray[Any], bound: Floats, shift: Floats
) -> tuple[Floats, Floats]:
    """Shift chains across so that the regions get their areas.

    Parameters
    ----------
    points : float64, shape (n, 2)
        All points.
    chain_points, offsets : int64
        Chains as in `BoundaryGraph`.
    sides : int64, shape (n_chains, 2)
        Region on the left and on the right of each chain, -1 for none.
    target : int64 or float64, shape (n_regions,)
        Wanted areas.
    bound : float64, shape (len(chain_points),)
        How far each point of a chain may be shifted; 0 at least at the ends of open chains.
    shift : float64, shape (n_chains,)
        Shifts to start from.

    Returns
    -------
    moved : float64, shape (n, 2)
        Shifted points.
    shift : float64, shape (n_chains,)
        How far each chain went to its left, where its points' bounds let it.
    """
    normal = _normals(points, chain_points, offsets, bound)
    moved = _moved(points, chain_points, offsets, bound, normal, shift)
    for _ in range(_STEPS):
        swept, growth = _sweep(moved, chain_points, offsets, bound, normal, shift)
        missing = target - _areas(swept, sides, len(target))
        if np.all(np.abs(missing) <= _GOOD * target):
            break
        shift = np.clip(shift + _shifts(np.maximum(growth, 0.0), sides, missing, target), -bound.max(), bound.max())
        moved = _moved(points, chain_points, offsets, bound, normal, shift)
    return moved, shift


@kernel
def _normals(points: Floats, chain_points: Ints, offsets: Ints, bound: Floats) -> Floats:
    """Left normal at every movable place of the chains."""
    normal = np.zeros((len(chain_points), 2))
    for c in range(len(offsets) - 1):
        for k in range(offsets[c], offsets[c + 1] - 1):
            if bound[k] > 0:
                a, b = _beside(chain_points, offsets, c, k)
                x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
                length = max(np.hypot(x, y), 1e-12)
                normal[k, 0], normal[k, 1] = -y / length, x / length
    return normal


@kernel
def _beside(chain_points: Ints, offsets: Ints, c: int, k: int) -> tuple[int, int]:
    """Points before and after place k of chain c; only closed chains have one before their first."""
    before = k - 1 if k > offsets[c] else offsets[c + 1] - 2
    return chain_points[before], chain_points[k + 1]


@kernel
def _sweep(
    points: Floats, chain_points: Ints, offsets: Ints, bound: Floats, normal: Floats, shift: Floats
) -> tuple[Floats, Floats]:
    """Area that each chain sweeps about the origin, and its growth by a unit of further shift."""
    swept, growth = np.zeros(len(shift)), np.zeros(len(shift))
    for c in range(len(shift)):
        for k in range(offsets[c], offsets[c + 1] - 1):
            p, q = chain_points[k], chain_points[k + 1]
            swept[c] += 0.5 * (points[p, 0] * points[q, 1] - points[q, 0] * points[p, 1])
            if bound[k] > abs(shift[c]):
                a, b = _beside(chain_points, offsets, c, k)
                x, y = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1]
                growth[c] += 0.5 * (normal[k, 1] * x - normal[k, 0] * y)
    return swept, growth


@kernel
def _moved(points: Floats, chain_points: Ints, offsets: Ints, bound: Floats, normal: Floats, shift: Floats) -> Floats:
    moved = points.copy()
    for c in range(len(shift)):
        for k in range(offsets[c], offsets[c + 1] - 1):
            if bound[k] > 0:
                d = min(max(shift[c], -bound[k]), bound[k])
                moved[chain_points[k], 0] += d * normal[k, 0]
                moved[chain_points[k], 1] += d * normal[k, 1]
    return moved


def _shifts(weight: Floats, sides: Ints, missing: Floats, target: NDArray[Any]) -> Floats:
    """Shift of each chain to its left that gives the regions what is missing, as far as their chains can move."""
    n = len(missing)
    free = np.flatnonzero((weight > 1e-9) & (sides[:, 0] != sides[:, 1]))
    left, right = np.where(sides[free] < 0, n, sides[free]).T
    adjacency = sparse.coo_matrix((weight[free], (left, right)), (n + 1, n + 1)).tocsr()
    adjacency = (adjacency + adjacency.T)[:, :]
    wanted = _consistent(adjacency, np.append(missing, 0.0), np.append(target, 0.0))
    inner = adjacency[:n, :n]
    degree = np.asarray(adjacency.sum(axis=1)).ravel()[:n]
    laplacian = sparse.diags(np.where(degree > 0, degree, 1.0)) - inner
    potential = np.append(_conjugate_gradients(laplacian.tocsr(), wanted[:n]), 0.0)
    shift = np.zeros(len(weight))
    shift[free] = potential[right] - potential[left]
    return shift


def _consistent(adjacency: Any, missing: Floats, target: Floats) -> Floats:
    """Take from each connected group of regions what no shift within it can give, from small regions by area."""
    n_groups, group = connected_components(adjacency, directed=False)
    share = np.where(target < _SMALL, target, 1e-3 * target)
    spare = np.bincount(group, missing, n_groups) / np.maximum(np.bincount(group, share, n_groups), 1e-12)
    spare[group[-1]] = 0.0  # joined to the outside, which takes any area
    return np.asarray(missing - spare[group] * share, np.float64)


def _conjugate_gradients(matrix: Any, right: Floats) -> Floats:
    """Solve for the symmetric positive (semi)definite matrix, preconditioned by its diagonal."""
    diagonal = matrix.diagonal()
    solution, residual = np.zeros_like(right), right.copy()
    scaled = residual / diagonal
    direction, rho = scaled.copy(), float(residual @ scaled)
    goal = 1e-5 * max(float(np.abs(right).max(initial=0.0)), 1e-12)
    for _ in range(1000):
        if np.abs(residual).max(initial=0.0) <= goal:
            break
        image = matrix @ direction
        curvature = float(direction @ image)
        if not curvature > 1e-12 * float(direction @ direction):
            break
        alpha = rho / curvature
        solution += alpha * direction
        residual -= alpha * image
        scaled = residual / diagonal
        rho, previous = float(residual @ scaled), rho
        direction = scaled + (rho / previous) * direction
    return solution
