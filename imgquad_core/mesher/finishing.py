"""From composed quads to those of a face: fit the rim, clean up, split, smooth, replace the worst.

Faces share no point, so threads can work on them in batches; large ones are worked on in pieces.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Floats
from imgquad_core.cleanup.batches import is_large
from imgquad_core.cleanup.faces import INNER_VALENCE, FaceQuads, wanted_quads
from imgquad_core.cleanup.irregular_nodes import clean_up
from imgquad_core.cleanup.options import CleanUp, Portions
from imgquad_core.cleanup.relaxation import BAD, GOOD, Rings, fit_rim, laplace, newton, rings_of, untangle
from imgquad_core.cleanup.strips import LEFT_ALONE, in_pieces, independent_nodes, nodes_around, strips_of
from imgquad_core.cleanup.worst_quads import repair
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.geometry.quad_shape import nodes_of_poor, rim_angles
from imgquad_core.threads import in_threads

from .splitting import points_between, refine_quads
from .triangulation import Constraints

FIT_ROUNDS = 6  # in which the rim goes to its places, each as far as no quad folds
RETRIED = 6  # quads beside a seam within which the clean-up of a large face looks again
ROOM = 10  # quads around a place that its cavities can reach
REACH = 3  # quads beside a seam that are smoothed again
POOR = 0.7  # scaled Jacobian below which single quads are replaced


class Sweeps(NamedTuple):
    """How often nodes are smoothed, at most."""

    laplace: int  #: towards the mean of their neighbours
    newton: int  #: towards the best shape of their quads


DRAFT, FULL, AGAIN = Sweeps(3, 0), Sweeps(8, 6), Sweeps(3, 6)  # before the clean-up, after it, again


class Task(NamedTuple):
    """What is asked of `finished`."""

    targets: Floats  #: (n, 2) where the rim belongs: points of the boundary, by `FaceQuads.origin`
    across: int  #: number of quads, 1, 2 or 3, across each one when it is split after the clean-up
    rim: Constraints  #: the rim's edges before that split, with the boundary's points between their ends
    how: CleanUp  #: how far the clean-up goes
    threads: int  #: the quads do not depend on it
    portions: Portions  #: which faces are large, and how wide their strips are

    @property
    def last(self) -> Sweeps:
        """Those at the end: nodes of split quads were smoothed before, while there were few."""
        return FULL if self.across == 1 else AGAIN


def finished(batches: list[FaceQuads], task: Task, told: Callable[[FaceQuads], None] | None = None) -> list[FaceQuads]:
    """Turn composed quads, from `batches_of`, into the final ones of their faces; `told` of each batch that is done."""
    small = [part for part in batches if not is_large(part, task.portions)]
    whole = in_threads(small, lambda part: _without_poor(_finished_whole(part, task)), task.threads, told)
    large = [part for part in batches if is_large(part, task.portions)]
    single = in_threads(large, lambda part: _finished_in_pieces(part, task), 1, told)
    return [*whole, *in_threads(single, _without_poor, task.threads)]


def _finished_whole(part: FaceQuads, task: Task) -> FaceQuads:
    part = clean_up(_relaxed(_fitted(part, task.targets, False), DRAFT), task.how)
    if task.across > 1:
        part = _split(_relaxed(part, FULL), task)
    return _relaxed(_fitted(part, task.targets, True), task.last)


def _finished_in_pieces(part: FaceQuads, task: Task) -> FaceQuads:
    part = _cleaned_in_pieces(_fitted(part, task.targets, False), task)
    if task.across > 1:
        part = _split(_relaxed_in_pieces(part, FULL, task), task)
    return _relaxed_in_pieces(_fitted(part, task.targets, True), task.last, task)


def _split(part: FaceQuads, task: Task) -> FaceQuads:
    """Split every quad into four or nine."""
    twins = twins_of(part.quads, len(part.points))
    return refine_quads(part, twins, points_between(part.quads, twins, part.origin, task.rim, task.across))


def _cleaned_in_pieces(face: FaceQuads, task: Task) -> FaceQuads:
    """Smooth and clean up one large face in strips, then in bands around the seams."""
    how, portions = task.how, task.portions
    strip = strips_of(face.points, face.quads, portions)
    face, seams = in_pieces(face, strip, lambda part, _: clean_up(_relaxed(part, DRAFT), how), task.threads)
    near = nodes_around(face.quads, seams, RETRIED)
    in_band = nodes_around(face.quads, near, ROOM)[face.quads].any(axis=1)
    band = np.where(in_band, strips_of(face.points, face.quads, portions, shifted=True), LEFT_ALONE)
    return in_pieces(face, band, lambda part, ids: clean_up(_relaxed(part, DRAFT), how, near[ids]), task.threads)[0]


def _relaxed_in_pieces(face: FaceQuads, sweeps: Sweeps, task: Task) -> FaceQuads:
    """Smooth the nodes inside one large face in strips, then those around the seams."""
    points, rings, free = face.points.copy(), rings_of(face.quads, len(face.points)), face.origin < 0
    groups, seams = independent_nodes(
        strips_of(points, face.quads, task.portions), face.quads, len(points), task.threads
    )
    near = nodes_around(face.quads, seams, REACH)
    in_threads(groups, lambda nodes: _relax(points, rings, free & nodes, sweeps), task.threads)
    _relax(points, rings, free & near, sweeps)
    return face._replace(points=points)


def _fitted(part: FaceQuads, targets: Floats, whole: bool) -> FaceQuads:
    """Move the rim to the boundary's points: as far as no quad folds, or all of it, whatever folds."""
    rim = part.origin >= 0
    points = part.points.copy()
    late = fit_rim(points, rings_of(part.quads, len(points)), rim, targets[part.origin], FIT_ROUNDS)
    if whole:
        points[late] = targets[part.origin[late]]
    wanted = np.where(rim, wanted_quads(rim_angles(points, part.quads, rim)), INNER_VALENCE)
    return part._replace(points=points, wanted=wanted)


def _relaxed(part: FaceQuads, sweeps: Sweeps, only: Flags | None = None) -> FaceQuads:
    """Smooth the nodes inside faces, all or some."""
    points, free = part.points.copy(), part.origin < 0
    if only is not None:
        free &= only
    _relax(points, rings_of(part.quads, len(points)), free, sweeps)
    return part._replace(points=points)


def _relax(points: Floats, rings: Rings, free: Flags, sweeps: Sweeps) -> None:
    """Smooth free nodes, in place."""
    laplace(points, rings, free, sweeps.laplace)
    untangle(points, rings, free, 2, BAD)
    newton(points, rings, free, sweeps.newton, GOOD)


def _without_poor(part: FaceQuads) -> FaceQuads:
    """Replace the worst quads, and smooth what is new."""
    poor = nodes_of_poor(part.points, part.quads, POOR)
    if not poor.any():
        return part
    near = nodes_around(part.quads, poor, ROOM)[part.quads].any(axis=1)
    return in_pieces(part, np.where(near, 0, LEFT_ALONE), lambda piece, _: _repaired(piece), 1)[0]


def _repaired(part: FaceQuads) -> FaceQuads:
    better, beside = repair(part, POOR)
    return _relaxed(better, AGAIN, beside)
