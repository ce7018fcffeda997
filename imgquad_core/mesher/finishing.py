"""From composed quads to those of a face: fit the rim, clean up, split, smooth, replace the worst.

Faces share no point, so threads can work on them in batches; large ones are worked on in pieces.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Flags, Floats
from imgquad_core.cleanup.batches import in_threads, is_large
from imgquad_core.cleanup.faces import INNER_VALENCE, FaceQuads, wanted_quads
from imgquad_core.cleanup.irregular_nodes import clean_up
from imgquad_core.cleanup.options import CleanUp, Portions
from imgquad_core.cleanup.relaxation import BAD, GOOD, Rings, fit_rim, laplace, newton, rings_of, untangle
from imgquad_core.cleanup.strips import LEFT_ALONE, in_pieces, independent_nodes, nodes_around, strips_of
from imgquad_core.cleanup.worst_quads import repair
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.geometry.quad_shape import nodes_of_poor, sector_angles

from .splitting import points_between, split_quads
from .triangulation import Constraints

FIT_ROUNDS = 6  # in which the rim goes to its places, each as far as no quad folds
DRAFT, FULL, AGAIN = (3, 0), (8, 6), (3, 6)  # sweeps of Laplace and of Newton: before the clean-up, after it, again
RETRIED = 6  # quads beside a seam within which the clean-up of a large face looks again
ROOM = 10  # quads around a place that its cavities can reach
REACH = 3  # quads beside a seam that are smoothed again
POOR = 0.7  # scaled Jacobian below which single quads are replaced


def finished(
    batches: list[FaceQuads],
    targets: Floats,
    across: int,
    rim: Constraints,
    how: CleanUp,
    threads: int,
    portions: Portions,
) -> list[FaceQuads]:
    """Turn composed quads into the final ones of their faces, batch by batch.

    Parameters
    ----------
    batches : list of FaceQuads
        Composed quads, from `batches_of`.
    targets : float64, shape (n, 2)
        Where the rim belongs: points of the boundary, by `FaceQuads.origin`.
    across : int
        Number of quads, 1, 2 or 3, across each one when it is split after the clean-up.
    rim : Constraints
        The rim's edges before that split, with the boundary's points between their ends.
    how : CleanUp
        How far the clean-up goes.
    threads : int
        Number of threads; the quads do not depend on it.
    portions : Portions
        Which faces are large, and how wide their strips are.
    """

    def whole(part: FaceQuads) -> FaceQuads:
        part = clean_up(_relaxed(_fitted(part, targets, False), *DRAFT), how)
        if across > 1:  # smoothed while there are few nodes
            part = _split(_relaxed(part, *FULL), rim, across)
        return _without_poor(_relaxed(_fitted(part, targets, True), *last))

    def large(part: FaceQuads) -> FaceQuads:
        part = _cleaned_in_pieces(_fitted(part, targets, False), how, threads, portions)
        if across > 1:
            part = _split(_relaxed_in_pieces(part, *FULL, threads, portions), rim, across)
        return _relaxed_in_pieces(_fitted(part, targets, True), *last, threads, portions)

    last = FULL if across == 1 else AGAIN
    small = in_threads([part for part in batches if not is_large(part, portions)], whole, threads)
    single = [large(part) for part in batches if is_large(part, portions)]
    return [*small, *in_threads(single, _without_poor, threads)]


def _split(part: FaceQuads, rim: Constraints, across: int) -> FaceQuads:
    """Split every quad into four or nine."""
    twins = twins_of(part.quads, len(part.points))
    return split_quads(part, twins, points_between(part.quads, twins, part.origin, rim, across))


def _cleaned_in_pieces(face: FaceQuads, how: CleanUp, threads: int, portions: Portions) -> FaceQuads:
    """Smooth and clean up one large face in strips, then in bands around the seams."""
    strip = strips_of(face.points, face.quads, portions)
    face, seams = in_pieces(face, strip, lambda part, _: clean_up(_relaxed(part, *DRAFT), how), threads)
    near = nodes_around(face.quads, seams, RETRIED)
    in_band = nodes_around(face.quads, near, ROOM)[face.quads].any(axis=1)
    band = np.where(in_band, strips_of(face.points, face.quads, portions, shifted=True), LEFT_ALONE)
    return in_pieces(face, band, lambda part, ids: clean_up(_relaxed(part, *DRAFT), how, near[ids]), threads)[0]


def _relaxed_in_pieces(
    face: FaceQuads, laplace_sweeps: int, newton_sweeps: int, threads: int, portions: Portions
) -> FaceQuads:
    """Smooth the nodes inside one large face in strips, then those around the seams."""
    points, rings, free = face.points.copy(), rings_of(face.quads, len(face.points)), face.origin < 0
    groups, seams = independent_nodes(strips_of(points, face.quads, portions), face.quads, len(points), threads)
    near = nodes_around(face.quads, seams, REACH)
    in_threads(groups, lambda nodes: _relax(points, rings, free & nodes, laplace_sweeps, newton_sweeps), threads)
    _relax(points, rings, free & near, laplace_sweeps, newton_sweeps)
    return face._replace(points=points)


def _fitted(part: FaceQuads, targets: Floats, whole: bool) -> FaceQuads:
    """Move the rim to the boundary's points: as far as no quad folds, or all of it, whatever folds."""
    rim = part.origin >= 0
    points = part.points.copy()
    late = fit_rim(points, rings_of(part.quads, len(points)), rim, targets[part.origin], FIT_ROUNDS)
    if whole:
        points[late] = targets[part.origin[late]]
    wanted = np.where(rim, wanted_quads(sector_angles(points, part.quads, rim)), INNER_VALENCE)
    return part._replace(points=points, wanted=wanted)


def _relaxed(part: FaceQuads, laplace_sweeps: int, newton_sweeps: int, only: Flags | None = None) -> FaceQuads:
    """Smooth the nodes inside faces, all or some."""
    points, free = part.points.copy(), part.origin < 0
    if only is not None:
        free &= only
    _relax(points, rings_of(part.quads, len(points)), free, laplace_sweeps, newton_sweeps)
    return part._replace(points=points)


def _relax(points: Floats, rings: Rings, free: Flags, laplace_sweeps: int, newton_sweeps: int) -> None:
    """Smooth free nodes, in place."""
    laplace(points, rings, free, laplace_sweeps)
    untangle(points, rings, free, 2, BAD)
    newton(points, rings, free, newton_sweeps, GOOD)


def _without_poor(part: FaceQuads) -> FaceQuads:
    """Replace the worst quads, and smooth what is new."""
    poor = nodes_of_poor(part.points, part.quads, POOR)
    if not poor.any():
        return part
    near = nodes_around(part.quads, poor, ROOM)[part.quads].any(axis=1)
    return in_pieces(part, np.where(near, 0, LEFT_ALONE), lambda piece, _: _repaired(piece), 1)[0]


def _repaired(part: FaceQuads) -> FaceQuads:
    better, beside = repair(part, POOR)
    return _relaxed(better, *AGAIN, beside)
