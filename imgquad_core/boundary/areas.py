"""Areas of the regions between polylines, and how they are given back what smoothing took.

Every chain is shifted across by one unknown d; the least shifts that give all regions their areas are
``d = lambda(right) - lambda(left)`` with ``L lambda = missing area`` and L the graph Laplacian of the regions, each
chain weighted by the length of it that can move. A few Newton steps, since areas are quadratic and nodes have bounds.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Floats, Ints
from imgquad_core.chains import Places, places_of
from imgquad_core.grouping import linked
from imgquad_core.jit import kernel, verb
from imgquad_core.model import BoundaryGraph, Chains

_STEPS = 5  # of Newton towards the wanted areas, at most; most end sooner, at `_GOOD`
_SMALL = 50  # px; smaller regions take what cannot be given to all
_SHARPEST = 0.2  # 1 + cos of the largest turn that is mitred, 143 degrees
_GOOD = 1e-4  # share of a region's area that may stay missing


def polygon_areas(points: Floats, chains: Chains, n_regions: int) -> Floats:
    """Area of each region within its chains, shape (n_regions,).

    Parameters
    ----------
    points : float64, shape (n, 2)
        All points.
    chains : Chains
        Outlines of the regions.
    n_regions : int
        Number of regions.
    """
    swept = _swept(points, places_of(chains.points, chains.offsets), len(chains.regions))
    return _areas(swept, chains.regions, n_regions)


def _areas(swept: Floats, sides: Ints, n_regions: int) -> Floats:
    outer = np.where(sides < 0, n_regions, sides)
    area = np.bincount(outer[:, 0], swept, n_regions + 1) - np.bincount(outer[:, 1], swept, n_regions + 1)
    return np.asarray(area[:n_regions], np.float64)


def restore_areas(
    points: Floats, chains: Chains, target: NDArray[Any], bound: Floats, shift: Floats
) -> tuple[Floats, Floats]:
    """Shift chains across so that the regions get their areas.

    Parameters
    ----------
    points : float64, shape (n, 2)
        All points.
    chains : Chains
        Outlines of the regions.
    target : int64 or float64, shape (n_regions,)
        Wanted areas.
    bound : float64, shape (len(chains.points),)
        How far the segments at each point of a chain may be shifted; 0 at least at the ends of open chains.
    shift : float64, shape (n_chains,)
        Shifts to start from.

    Returns
    -------
    moved : float64, shape (n, 2)
        Shifted points.
    shift : float64, shape (n_chains,)
        How far each chain went to its left, where its points' bounds let it.
    """
    places, sides, most = places_of(chains.points, chains.offsets), chains.regions, bound.max()
    bound = bound[places.at]
    normal = mitres(points, places)
    moved = _moved(points, places, bound, normal, shift)
    for _ in range(_STEPS):
        missing = target - _areas(_swept(moved, places, len(shift)), sides, len(target))
        if np.all(np.abs(missing) <= _GOOD * target):
            break
        weight = np.maximum(_growth(moved, places, bound, normal, shift), 0.0)
        shift = np.clip(shift + _shifts(weight, sides, missing, target), -most, most)
        moved = _moved(points, places, bound, normal, shift)
    return moved, shift


@kernel
def mitres(points: Floats, places: Places) -> Floats:
    """Shift of each place that shifts the segments before and after it by 1 to their left.

    At a corner with an angle of 2 a that is a shift by 1 / sin(a): both its sides keep their directions.
    """
    found = np.empty((len(places.here), 2))
    for k in range(len(found)):
        x, y = _left_normal(points, places.before[k], places.here[k])
        next_x, next_y = _left_normal(points, places.here[k], places.after[k])
        share = max(1.0 + (x * next_x + y * next_y), _SHARPEST)
        found[k, 0], found[k, 1] = (x + next_x) / share, (y + next_y) / share
    return found


@verb
def _left_normal(points: Floats, p: int, q: int) -> tuple[float, float]:
    dx, dy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
    length = max(np.hypot(dx, dy), 1e-12)
    return -dy / length, dx / length


@kernel
def _swept(points: Floats, places: Places, n_chains: int) -> Floats:
    """Area that each chain sweeps about the origin."""
    swept = np.zeros(n_chains)
    for k in range(len(places.here)):
        p, q = places.here[k], places.after[k]
        swept[places.chain[k]] += 0.5 * (points[p, 0] * points[q, 1] - points[q, 0] * points[p, 1])
    return swept


@kernel
def _growth(points: Floats, places: Places, bound: Floats, normal: Floats, shift: Floats) -> Floats:
    """How much the area that each chain sweeps grows by a unit of further shift."""
    growth = np.zeros(len(shift))
    for k in range(len(places.here)):
        p, q, c = places.before[k], places.after[k], places.chain[k]
        if bound[k] > abs(shift[c]):
            dx, dy = points[q, 0] - points[p, 0], points[q, 1] - points[p, 1]
            growth[c] += 0.5 * (normal[k, 1] * dx - normal[k, 0] * dy)
    return growth


@kernel
def _moved(points: Floats, places: Places, bound: Floats, normal: Floats, shift: Floats) -> Floats:
    moved = points.copy()
    for k in range(len(places.here)):
        by = min(max(shift[places.chain[k]], -bound[k]), bound[k])
        for axis in range(2):
            moved[places.here[k], axis] += by * normal[k, axis]
    return moved


def _shifts(weight: Floats, sides: Ints, missing: Floats, target: NDArray[Any]) -> Floats:
    """Shift of each chain to its left that gives the regions what is missing, as far as their chains can move."""
    n = len(missing)
    free = np.flatnonzero((weight > 1e-9) & (sides[:, 0] != sides[:, 1]))
    left, right = np.where(sides[free] < 0, n, sides[free]).T
    wanted = _consistent(*linked(left, right, n + 1), np.append(missing, 0.0), np.append(target, 0.0))
    links = _Links(weight[free], left, right, n)
    potential = np.append(_conjugate_gradients(links, wanted[:n]), 0.0)
    shift = np.zeros(len(weight))
    shift[free] = potential[right] - potential[left]
    return shift


class _Links(NamedTuple):
    """The Laplacian of regions that are linked by their chains; the outside, the last one, stays at zero."""

    weight: Floats  #: (n_links,)
    left: Ints  #: (n_links,) region
    right: Ints  #: (n_links,) another one
    n: int  #: regions

    @property
    def diagonal(self) -> Floats:
        """Sum of the weights of each region, 1 where it has no link."""
        degree = self._sums(self.weight, self.weight)
        return np.where(degree > 0.0, degree, 1.0)

    def others(self, values: Floats) -> Floats:
        """Return the Laplacian of values of the regions, but for what its diagonal gives."""
        all_values = np.append(values, 0.0)
        return -self._sums(self.weight * all_values[self.right], self.weight * all_values[self.left])

    def _sums(self, on_left: Floats, on_right: Floats) -> Floats:
        """Sum over the links of each region."""
        sums = np.bincount(self.left, on_left, self.n + 1) + np.bincount(self.right, on_right, self.n + 1)
        return np.asarray(sums[:-1], np.float64)


def _consistent(group: Ints, n_groups: int, missing: Floats, target: Floats) -> Floats:
    """Take from each connected group of regions what no shift within it can give, from small regions by area."""
    share = np.where(target < _SMALL, target, 1e-3 * target)
    spare = np.bincount(group, missing, n_groups) / np.maximum(np.bincount(group, share, n_groups), 1e-12)
    spare[group[-1]] = 0.0  # joined to the outside, which takes any area
    return np.asarray(missing - spare[group] * share, np.float64)


def _dot(a: Floats, b: Floats) -> float:
    """Sum of products without BLAS, whose sums hang on its number of threads, which spin between two calls."""
    return float(np.add.reduce(a * b))


def _conjugate_gradients(links: _Links, right: Floats) -> Floats:
    """Solve for the Laplacian, which is symmetric and positive (semi)definite, preconditioned by its diagonal."""
    diagonal = links.diagonal
    solution, residual = np.zeros_like(right), right.copy()
    scaled = residual / diagonal
    direction, rho = scaled.copy(), _dot(residual, scaled)
    goal = 1e-5 * max(float(np.abs(right).max(initial=0.0)), 1e-12)
    for _ in range(1000):
        if np.abs(residual).max(initial=0.0) <= goal:
            break
        image = diagonal * direction + links.others(direction)
        curvature = _dot(direction, image)
        if not curvature > 1e-12 * _dot(direction, direction):
            break
        alpha = rho / curvature
        solution += alpha * direction
        residual -= alpha * image
        scaled = residual / diagonal
        rho, previous = _dot(residual, scaled), rho
        direction = scaled + (rho / previous) * direction
    return solution


def enclosed_areas(graph: BoundaryGraph) -> Floats:
    """Area of each region within its chains, in square pixels, shape (n_regions,).

    Compare with `graph.region_pixels` for the error of smoothing.
    """
    return polygon_areas(graph.points, graph.chains, len(graph.region_label))
