"""Faces on their strides: outline, triangulate, place points, compose, split, clean up.

A face is tried on the widest stride that fits it, and on the next smaller one where its worst element is poor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from imgquad_core import ahead
from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.chains import halved
from imgquad_core.cleanup.batches import batches_of
from imgquad_core.cleanup.faces import FaceQuads, faces_only
from imgquad_core.cleanup.options import CleanUp
from imgquad_core.cleanup.strips import nodes_around
from imgquad_core.errors import TopologyError
from imgquad_core.geometry.quad_shape import lower_to_worst
from imgquad_core.measures.quality import scaled_jacobian
from imgquad_core.model import BoundaryGraph, PointKind
from imgquad_core.threads import in_threads

from .composing import compose
from .crossfield import cross_field
from .cutting import CutMesh, FaceConflict, cut_at_constraints
from .efforts import EFFORTS
from .finishing import Task, finished
from .frontal import frontal_points
from .options import MeshingOptions
from .outline import Outline, chains_in_conflict, chains_of, coarse_segments, mean_edges, outline, wide_faces
from .progress import Progress
from .splitting import split_composed
from .triangulation import Triangles, constraint_table, triangulate
from .warm_up import compile_last_stages

WIDEST = 6  # stride there is
LEAST_WIDTH = 3.0  # of a face that is meshed on stride 4, in its coarse segments
EVEN = {4: 0.6, 6: 0.8}  # of the size inside, mean edge around a face at a stride: within it the size hardly grows
ENOUGH = 0.65  # worst element from which a face is not tried with a smaller stride
BACKGROUND_AREA = 2.5  # of a background triangle, over the square of the edge length
GROUP, MOST_GROUPS = 1000, 8  # cells of faces that are triangulated together, at least; groups at most
SEAM_RINGS = 6  # quads on each side of a seam that do not tell how good a face is
CONTRADICTIONS = 6  # rounds in which chains are halved whose coarse outlines contradict each other


class _Conflict(TopologyError):
    """Outlines of these regions contradict each other at this stride."""

    def __init__(self, regions: Ints) -> None:
        super().__init__(f"the outlines of regions {regions[:10].tolist()} contradict each other")
        self.regions = regions


class Meshed(NamedTuple):
    """Some faces meshed."""

    parts: list[FaceQuads]
    faces: Flags  #: which
    worst: Floats  #: scaled Jacobian of each of them, 1 for others
    stride: Ints  #: of each of them
    fell: Flags  #: whether they were worse on a wider one


def faces_of(parts: list[FaceQuads], faces: Flags) -> list[FaceQuads]:
    """Keep the quads of the flagged faces."""
    return [kept for part in parts if len((kept := faces_only(part, faces)).quads)]


def consistent(graph: BoundaryGraph, new: Flags, triangulator: str) -> BoundaryGraph:
    """Return the graph, with finer chains where coarse outlines of the new ones contradict each other or others."""
    for _ in range(CONTRADICTIONS):
        bad = chains_in_conflict(graph, coarse_segments(graph, np.ones(graph.n_chains, bool), 2), new)
        if not bad.any():
            flat = outline(graph, faces_beside(graph, new), 2)
            mesh = triangulate(flat.points, flat.segments, triangulator=triangulator)
            cut = cut_at_constraints(mesh, flat.constraints)
            if not isinstance(cut, FaceConflict):
                return graph
            faces = np.zeros(len(graph.region_label), bool)
            faces[cut.regions] = True
            bad = chains_of(graph, faces)
        graph, new = halved(graph, bad), new | bad
    raise TopologyError("the boundaries of the regions cross or contradict each other")


def mesh_faces(
    graph: BoundaryGraph, todo: Flags, options: MeshingOptions, widest: Ints, progress: Progress | None = None
) -> Meshed:
    """Mesh flagged faces, each on its stride, none wider than its `widest`."""
    effort = EFFORTS[options.effort]
    best = _nothing(np.zeros(len(todo), bool))._replace(worst=np.full(len(todo), -np.inf))
    rim = mean_edges(graph) / options.face_sizes(graph.region_label)
    if effort.in_nine:
        wide = todo & (widest >= 6) & wide_faces(graph, 6, options.tuning.very_wide) & (rim > EVEN[6])
        best = _better(best, _mesh_wide(graph, wide, 6, effort.wide, options, progress))
    wide = todo & (widest >= 4) & wide_faces(graph, 4, LEAST_WIDTH) & (rim >= EVEN[4]) & (best.worst < ENOUGH)
    best = _better(best, _mesh_wide(graph, wide, 4, effort.wide, options, progress))
    poor = todo & (best.worst < effort.again_below)
    return _better(best, _mesh_at_stride(graph, poor, 2, effort.narrow, options, progress))


def _nothing(faces: Flags) -> Meshed:
    n = len(faces)
    return Meshed([], faces, np.ones(n), np.zeros(n, np.int64), np.zeros(n, bool))


def _better(one: Meshed, other: Meshed) -> Meshed:
    """Take each face from where its worst element is better, the first one if none is."""
    better = other.faces & (other.worst > one.worst)
    return taken(one, other, better)._replace(
        faces=one.faces | other.faces, fell=np.where(better, one.faces | other.fell, one.fell)
    )


def taken(one: Meshed, other: Meshed, which: Flags) -> Meshed:
    """Take some faces from the other one."""
    parts = faces_of(one.parts, ~which) + faces_of(other.parts, which)
    worst, stride, fell = (np.where(which, b, a) for a, b in zip(one[2:], other[2:], strict=True))
    return Meshed(parts, one.faces, worst, stride, fell)


def _mesh_wide(
    graph: BoundaryGraph, faces: Flags, stride: int, how: CleanUp, options: MeshingOptions, progress: Progress | None
) -> Meshed:
    """Mesh faces coarsely, without those whose chords contradict each other."""
    while True:
        try:
            return _mesh_at_stride(graph, faces, stride, how, options, progress)
        except _Conflict as conflict:
            faces = faces.copy()
            faces[conflict.regions] = False


def _mesh_at_stride(
    graph: BoundaryGraph, faces: Flags, stride: int, how: CleanUp, options: MeshingOptions, progress: Progress | None
) -> Meshed:
    """Mesh the flagged faces from segments of `stride` edges."""
    if not faces.any():
        return _nothing(faces)
    portions = options.tuning.portions
    groups = _groups_of(graph, faces, options.face_sizes(graph.region_label) * stride)
    ahead.wait()
    composed = in_threads(
        groups,
        lambda group: batches_of(composed_quads(graph, group, stride, options), portions),
        options.n_threads,
        progress.composed if progress else None,
    )
    if options.n_threads > 1:
        compile_last_stages()  # loaded by threads, in turn and one in the other's way, machine code takes twice as long
    rim = coarse_segments(graph, chains_of(graph, faces), stride // 2)  # the Catmull-Clark split has halved edges
    nothing = np.zeros(len(rim.tail), np.int64)
    table = constraint_table(len(graph.points), rim.tail, rim.head, nothing, nothing, rim.middle)
    batches = [batch for group in composed for batch in group]
    task = Task(graph.points, stride // 2, table, how, options.n_threads, portions)
    parts = finished(batches, task, progress.finished if progress else None)
    told, worst = [judged(part, graph) for part in parts], np.ones(len(faces))
    in_threads(told, lambda part: lower_to_worst(part.points, part.quads, part.face, worst), options.n_threads)
    return Meshed(parts, faces, worst, np.where(faces, stride, 0), np.zeros(len(faces), bool))


def judged(part: FaceQuads, graph: BoundaryGraph) -> FaceQuads:
    """Return the quads that tell how good faces are: all but valid ones near seams, which are mended later."""
    is_seam = graph.point_kind == PointKind.SEAM
    if not is_seam.any():
        return part
    left_out = near_seams(part.quads, is_seam[np.maximum(part.origin, 0)] & (part.origin >= 0))
    left_out &= scaled_jacobian(part.points, part.quads) > 0.0
    return part._replace(quads=part.quads[~left_out], face=part.face[~left_out])


def near_seams(quads: Ints, is_seam: Flags) -> Flags:
    """Tell the quads that are made anew, or nearly so, when seams are gone."""
    return np.asarray(nodes_around(quads, is_seam, SEAM_RINGS - 1)[quads].any(axis=1))


def _groups_of(graph: BoundaryGraph, faces: Flags, sizes: Floats) -> list[Flags]:
    """Return the flagged faces in groups of neighbours (by number) that threads can share, whatever their number."""
    quads = np.where(faces, np.maximum(graph.region_pixels, 1) / sizes**2, 0.0)
    count = int(np.clip(quads.sum() / GROUP, 1, MOST_GROUPS))
    group = np.floor((np.cumsum(quads) - 0.5 * quads) / quads.sum() * count)
    return [faces & (group == g) for g in np.unique(group[faces])]


def composed_quads(graph: BoundaryGraph, faces: Flags, stride: int, options: MeshingOptions) -> FaceQuads:
    """Triangulate faces, place points in layers, compose the triangles and split all to quads."""
    sizes = options.face_sizes(graph.region_label) * stride
    flat = outline(graph, faces, stride)
    largest = BACKGROUND_AREA * float(sizes[faces].max()) ** 2
    cut = _cut(triangulate(flat.points, flat.segments, largest, options.triangulator), flat)
    field = cross_field(cut, _largest_sizes(cut, sizes), options.slope(stride))
    points = np.vstack([flat.points, frontal_points(cut, field)])
    cut = _cut(triangulate(points, flat.segments, triangulator=options.triangulator), flat)
    quads = split_composed(cut, compose(cut), len(flat.ids))
    if (lost := np.setdiff1d(np.flatnonzero(faces), quads.face)).size:
        raise _Conflict(lost)
    n = len(cut.points)
    origin = quads.origin.copy()
    origin[:n] = np.where(origin[:n] >= 0, flat.ids[np.maximum(origin[:n], 0)], -1)
    return quads._replace(origin=origin)


def _cut(mesh: Triangles, flat: Outline) -> CutMesh:
    cut = cut_at_constraints(mesh, flat.constraints)
    if isinstance(cut, FaceConflict):
        raise _Conflict(cut.regions)
    return cut


def _largest_sizes(cut: CutMesh, sizes: Floats) -> Floats:
    """Return the size asked for at each point of a cut mesh."""
    face = np.zeros(len(cut.points), np.int64)
    face[cut.triangles] = cut.face[:, None]
    return sizes[face]


def faces_beside(graph: BoundaryGraph, chains: Flags) -> Flags:
    """Return which faces have one of these chains on their outline."""
    faces = np.zeros(len(graph.region_label) + 1, bool)  # VOID is the last entry
    faces[graph.chain_regions[chains]] = True
    return faces[:-1]
