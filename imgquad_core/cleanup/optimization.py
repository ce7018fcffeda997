"""Clean-up and relaxation of a mesh that is there already: its boundaries stay, point by point.

The mesh is cut at the boundaries into faces that share no point, which is what the kernels of the mesher work on. Each
face keeps its old quads unless the new ones are better.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.geometry.quad_shape import lower_to_worst, nodes_of_poor
from imgquad_core.grouping import grouped
from imgquad_core.measures.quality import corner_angles, scaled_jacobian, sectors_of
from imgquad_core.model import QuadMesh
from imgquad_core.threads import threads_of

from .batches import in_batches
from .faces import INNER_VALENCE, FaceQuads, faces_only, joined, stitched, wanted_quads
from .irregular_nodes import clean_up
from .options import CleanUp, OptimizationOptions
from .relaxation import BAD, GOOD, laplace, newton, rings_of, untangle
from .strips import nodes_around

CLEAN_UPS = {
    "fast": CleanUp((16,), 0.2, 0.6),
    "normal": CleanUp((16, 40, 80), 0.2, 0.6),
    "best": CleanUp((16, 40, 80, 160), 0.4, 0.6),
}
GOOD_ENOUGH = 0.5  # scaled Jacobian down to which a face may get worse where that saves irregular nodes
LAPLACE_SWEEPS, NEWTON_SWEEPS = 8, 6
UNTANGLE_ROUNDS = 12  # while rings are bad


def optimize(mesh: QuadMesh, options: OptimizationOptions | None = None) -> QuadMesh:
    """Lower the number of irregular nodes inside regions and raise the worst scaled Jacobian.

    Parameters
    ----------
    mesh : QuadMesh
        Any mesh of quads; some may be inverted.
    options : OptimizationOptions, optional
        Effort and threads.

    Returns
    -------
    QuadMesh
        With the same chains and regions. Boundary points stay where they are and come first, in their order. A region
        gets new quads only where its worst scaled Jacobian does not fall, or stays above 0.5 while irregular nodes
        become fewer.
    """
    options = options or OptimizationOptions()
    old = cut_at_chains(mesh)
    how = CLEAN_UPS[options.effort]
    new = joined(in_batches(old, lambda part: _relaxed(clean_up(_relaxed(part), how)), threads_of(options.threads)))
    better = _is_better(old, new, len(mesh.region_label))
    return stitched_onto(mesh, joined([faces_only(old, ~better), faces_only(new, better)]))


def cut_at_chains(mesh: QuadMesh) -> FaceQuads:
    """Give each sector between two boundary lines a point of its own."""
    sector = sectors_of(mesh)
    node = np.empty(sector.max() + 1, np.int64)
    node[sector] = mesh.quads
    on_rim = np.zeros(mesh.n_points, bool)
    on_rim[mesh.chain_points] = True
    corners = np.radians(corner_angles(mesh.points, mesh.quads))
    angle = np.asarray(np.bincount(sector.ravel(), weights=corners.ravel()), np.float64)
    return FaceQuads(
        mesh.points[node],
        sector,
        np.array(mesh.quad_region),
        np.where(on_rim[node], node, -1),
        np.where(on_rim[node], wanted_quads(angle), INNER_VALENCE),
    )


def _relaxed(part: FaceQuads) -> FaceQuads:
    """Smooth the nodes inside faces."""
    points, free = part.points.copy(), part.origin < 0
    rings = rings_of(part.quads, len(points))
    for attempt in range(UNTANGLE_ROUNDS):
        if attempt > 0:
            _spread(points, part.quads, free)
        laplace(points, rings, free, LAPLACE_SWEEPS)
        if untangle(points, rings, free, 2, BAD) == 0:
            break
    newton(points, rings, free, NEWTON_SWEEPS, GOOD)
    return part._replace(points=points)


def _spread(points: Floats, quads: Ints, free: Flags) -> None:
    """Move the nodes around inverted quads between their neighbours, in place, whatever that inverts on the way."""
    tangled = nodes_of_poor(points, quads, 0.0)
    near = np.flatnonzero(nodes_around(quads, tangled, 2) & free)
    ends = np.concatenate([quads[:, [k, (k + step) % 4]] for k in range(4) for step in (1, 3)])
    ends = ends[np.isin(ends[:, 0], near)]
    count = np.bincount(ends[:, 0], minlength=len(points))[near]
    for _ in range(LAPLACE_SWEEPS):
        for axis in (0, 1):
            total = np.bincount(ends[:, 0], points[ends[:, 1], axis], len(points))[near]
            points[near, axis] = total / count


def _is_better(old: FaceQuads, new: FaceQuads, n_faces: int) -> Flags:
    """Tell of each face whether its new quads are better than its old ones."""
    worst_old, worst_new = np.ones((2, n_faces))
    lower_to_worst(old.points, old.quads, old.face, worst_old)
    lower_to_worst(new.points, new.quads, new.face, worst_new)
    odd_old, odd_new = _irregular(old, n_faces), _irregular(new, n_faces)
    fewer = (odd_new < odd_old) & (worst_new >= np.minimum(worst_old, GOOD_ENOUGH))
    rounder = (worst_new == worst_old) & (_loss(new, n_faces) < _loss(old, n_faces))
    return np.asarray(fewer | ((odd_new <= odd_old) & ((worst_new > worst_old) | rounder)))


def _loss(mesh: FaceQuads, n_faces: int) -> Floats:
    """Return the sum of 1 - scaled Jacobian over the quads of each face."""
    return np.asarray(np.bincount(mesh.face, 1.0 - scaled_jacobian(mesh.points, mesh.quads), n_faces), np.float64)


def _irregular(mesh: FaceQuads, n_faces: int) -> Ints:
    """Return how many points of each face have another number of quads than they should."""
    offsets, corners = grouped(mesh.quads, len(mesh.points))
    odd = np.diff(offsets) != mesh.wanted
    return np.bincount(mesh.face[corners[offsets[:-1][odd]] >> 2], minlength=n_faces)


def stitched_onto(mesh: QuadMesh, quads: FaceQuads) -> QuadMesh:
    """Join faces at the boundary's points, which come first."""
    rim = np.unique(mesh.chain_points)
    place = np.full(mesh.n_points, -1, np.int64)
    place[rim] = np.arange(len(rim))
    chains = mesh.chains._replace(points=place[mesh.chain_points])
    return stitched(quads, place, mesh.points[rim], mesh.point_kind[rim], chains, mesh.region_label, mesh.materials)
