"""From boundaries to quads: the paper's step 4, face by face on levels.

Every face (region) is meshed alone; faces meet in the points of the boundary, so they fit whatever their level. A
wide face is meshed and cleaned up with a stride of four final edges (an irregular node stays one node while nodes
become sixteen times as many), with effort "best" a very wide one with a stride of six, others with one of two. A face
whose worst element is poor is meshed again with the next smaller stride, and the better mesh is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from . import aside
from .batches import LARGEST, batches_of, faces_only, in_threads, joined
from .composing import compose
from .crossfield import cross_field
from .cutting import CutMesh, FaceConflict, cut_at_constraints
from .errors import InputError, TopologyError
from .finishing import finished
from .frontal import frontal_points
from .model import BoundaryGraph, Materials, PointKind, QuadMesh
from .outline import (
    Flags,
    Outline,
    chains_in_conflict,
    chains_of,
    coarse_segments,
    halved,
    mean_edges,
    outline,
    refined,
    wide_faces,
    with_chains_of,
    with_short_chains_halved,
    without_unused_points,
)
from .pieces import independent_nodes, strips_of
from .quality import scaled_jacobian
from .relaxation import GOOD, lower_to_worst, newton, rings_of, untangle
from .sliding import slide
from .splitting import FaceQuads, split_composed
from .topology import CleanUp
from .triangulation import Triangles, constraint_table, triangulate

Ids = NDArray[np.int64]
Points = NDArray[np.float64]

STEEPEST = 0.35  # slope of the size inside; above it the worst elements get bad (study: .55 gives SJ .03)
LEAST_WIDTH = 3.0  # of a face that is meshed on stride 4, in its coarse segments
VERY_WIDE = 6.0  # the same on stride 6
EVEN = 0.8  # of the size inside, mean edge around a face at stride 6: its size hardly grows from the rim inwards
ENOUGH = 0.65  # worst element from which a face is not tried with a smaller stride
BACKGROUND_AREA = 2.5  # of a background triangle, over the square of the edge length
GROUP, MOST_GROUPS = 1000, 8  # cells of faces that are triangulated together, at least; groups at most
LARGE = 20_000  # quads of a face that is not meshed again for a quad that is not that bad
FAIR = 0.86  # below it, in the end, the worst corner of a ring counts alone; 60 degrees give .866
WORST = 0.42  # below it the boundary's edges at the quad are halved, in
WISHES = 3  # rounds at most, and only what gets better is kept; at folded quads in
REFITS = 16  # rounds, of which
PATIENCE = 6  # reach no farther
CONTRADICTIONS = 6  # rounds in which chains are halved whose coarse outlines contradict each other


class Effort(NamedTuple):
    """How far a mesh is optimised."""

    wide: CleanUp  #: clean-up of faces on level 2
    narrow: CleanUp  #: clean-up of faces on level 1
    again_below: float  #: a face on level 2 with a worse element is meshed on level 1 as well
    slides: int  #: rounds in which boundary nodes slide along their chains
    in_nine: bool = False  #: whether very wide faces are meshed on stride 6 and their quads split in nine


EFFORTS: Mapping[str, Effort] = {
    "fast": Effort(CleanUp((16, 40), 0.2, 0.6), CleanUp((16,), 0.2, 0.6), 0.4, 0),
    "normal": Effort(CleanUp((40, 160), 0.5, 0.6), CleanUp((16, 40, 80), 0.5, 0.6), 0.5, 2),
    "best": Effort(
        CleanUp((16, 40, 80, 160, 160), 0.8, 0.6, 160), CleanUp((16, 40, 80, 160), 1.0, 0.6, 160), 0.5, 4, True
    ),
}


@dataclass(frozen=True)
class MeshingOptions:
    """How boundaries are filled with quads.

    Parameters
    ----------
    size : float
        Length of final edges inside, in pixels.
    growth : float
        Largest ratio of the sizes of neighbouring elements (above 1.35 it counts as 1.35 inside faces).
    material_sizes : mapping of int to float
        Length of final edges per material label.
    effort : {"fast", "normal", "best"}
        How far irregular nodes are hunted.
    threads : int
        Number of threads; the mesh does not depend on it.
    """

    size: float = 4.0
    growth: float = 1.3
    material_sizes: Mapping[int, float] | None = field(default=None)
    effort: str = "normal"
    threads: int = 1

    def __post_init__(self) -> None:
        sizes = {"size": self.size} | {f"size of material {k}": v for k, v in self._sizes().items()}
        for name, value in sizes.items():
            if not 0.05 <= value < float("inf"):
                raise InputError(f"{name} is {value}; give a length of at least 0.05 px")
        if not 1.01 <= self.growth <= 10.0:
            raise InputError(f"growth is {self.growth}; give a ratio from 1.01 to 10")
        if self.effort not in EFFORTS:
            raise InputError(f"effort is {self.effort!r}; give one of {', '.join(EFFORTS)}")
        if self.threads < 1:
            raise InputError(f"threads is {self.threads}; give at least 1")

    def _sizes(self) -> Mapping[int, float]:
        return self.material_sizes or {}

    @property
    def slope(self) -> float:
        """Growth of the edge length per unit of length inside faces."""
        return min(self.growth - 1.0, STEEPEST)

    def face_sizes(self, labels: NDArray[np.int32]) -> Points:
        """Return the edge length asked for in each face."""
        sizes = np.full(len(labels), float(self.size))
        for label, size in self._sizes().items():
            sizes[labels == label] = size
        return sizes


class _Conflict(TopologyError):
    """Outlines of these regions contradict each other at this stride."""

    def __init__(self, regions: Ids) -> None:
        super().__init__(f"the outlines of regions {regions[:10].tolist()} contradict each other")
        self.regions = regions


class _Meshed(NamedTuple):
    """Some faces meshed."""

    parts: list[FaceQuads]
    faces: Flags  # which
    worst: Points  # scaled Jacobian of each of them, 1 for others


class _State(NamedTuple):
    """All faces meshed, after some rounds."""

    graph: BoundaryGraph
    meshed: _Meshed


def mesh_boundaries(
    graph: BoundaryGraph, options: MeshingOptions | None = None, materials: Materials | None = None
) -> QuadMesh:
    """Fill the regions between boundaries with quadrilaterals.

    Parameters
    ----------
    graph : BoundaryGraph
        From `smooth_boundaries`: chains of final edges, an even number each.
    options : MeshingOptions, optional
        Sizes, effort, threads.
    materials : Materials, optional
        Carried to the mesh; by default made of the labels.

    Returns
    -------
    QuadMesh
        Convex, counter-clockwise quads. The points of `graph` come first, in their order; those inside chains may
        have slid along them, and some edges may have got a mid-point.

    Raises
    ------
    TopologyError
        If the chains cross.
    """
    aside.start()
    options = options or MeshingOptions()
    graph = with_short_chains_halved(_consistent(graph, np.ones(graph.n_chains, bool)), LEAST_WIDTH)
    everything = np.ones(len(graph.region_label), bool)
    state = _State(graph, _mesh_faces(graph, everything, options))
    for attempt in range(REFITS):
        wished = attempt < WISHES
        poor = _poor_rim(state.meshed, WORST if wished else 0.0)
        if len(poor) == 0:
            break
        try:
            state = _refitted(state, _refined(state.graph, poor, attempt), options)
        except TopologyError:
            if state.meshed.worst.min(initial=1.0) <= 0.0:
                raise
            break  # what is there is valid
    if (poor := _poor_rim(state.meshed, 0.0)).size:
        where = state.graph.points[poor[0]].tolist()
        raise TopologyError(f"{len(poor)} boundary points fold quads, the first at {where}")
    mesh = _stitch(state.graph, state.meshed.parts, materials or _materials_of(graph.region_label))
    return _slid(mesh, EFFORTS[options.effort].slides, options.threads)


def _refitted(state: _State, finer: BoundaryGraph, options: MeshingOptions) -> _State:
    """Mesh the faces beside chains that are finer, and keep what is better, group by group of such neighbours.

    Where quads fold, the new state is kept in any case.
    """
    graph, meshed = state
    finer = _consistent(finer, _differ(graph, finer))
    changed = _differ(graph, finer)
    todo = _faces_beside(graph, changed)
    done = _mesh_faces(finer, todo, options)
    group = _groups_across(graph, changed)
    old, new = np.ones((2, len(todo)))
    np.minimum.at(old, group, meshed.worst)
    np.minimum.at(new, group, np.where(todo, done.worst, 1.0))
    better = todo & ((new > old) | (old <= 0.0))[group]
    parts = _faces_of(meshed.parts, ~better) + _faces_of(done.parts, better)
    kept = changed & np.append(better, False)[graph.chain_regions].any(axis=1)
    return _State(
        with_chains_of(graph, finer, kept),
        _Meshed(parts, meshed.faces, np.where(better, done.worst, meshed.worst)),
    )


def _groups_across(graph: BoundaryGraph, chains: Flags) -> Ids:
    """Return the number of the group of each face; faces on both sides of a flagged chain are of one group."""
    n = len(graph.region_label)
    pairs = graph.chain_regions[chains]
    a, b = pairs[(pairs >= 0).all(axis=1)].T
    return np.asarray(connected_components(coo_array((np.ones(len(a)), (a, b)), (n, n)), False)[1], np.int64)


def _refined(graph: BoundaryGraph, poor: Ids, attempt: int) -> BoundaryGraph:
    """Return the graph with halved edges beside points with poor quads.

    A halved edge is straight, so no point there can fold a quad. With every wish, and later after some attempts, the
    reach grows, and in the end all edges are halved: that settles it whatever the picture.
    """
    if attempt == REFITS - 1:
        return halved(graph, np.ones(graph.n_chains, bool))
    return refined(graph, poor, attempt if attempt < WISHES else 2 ** max(attempt - PATIENCE, 0) - 1)


def _faces_of(parts: list[FaceQuads], faces: Flags) -> list[FaceQuads]:
    """Keep the quads of the flagged faces."""
    return [kept for part in parts if len((kept := faces_only(part, faces)).quads)]


def _poor_rim(meshed: _Meshed, limit: float) -> Ids:
    """Return the boundary points of quads not above `limit`, and all those of a face whose such quads have none."""
    found = [np.empty(0, np.int64)]
    for part in meshed.parts if (meshed.worst <= limit).any() else ():
        looked_at = np.flatnonzero(meshed.worst[part.face] <= limit)
        poor = looked_at[scaled_jacobian(part.points, part.quads[looked_at]) <= limit]
        origin = part.origin[part.quads[poor]]
        inner = np.setdiff1d(part.face[poor], part.face[poor[(origin >= 0).any(axis=1)]])
        found += [origin.ravel(), part.origin[part.quads[np.isin(part.face, inner)]].ravel()]
    points = np.unique(np.concatenate(found))
    return np.asarray(points[points >= 0])


def _differ(graph: BoundaryGraph, finer: BoundaryGraph) -> Flags:
    """Return which chains have more points in the finer graph."""
    return np.asarray(np.diff(finer.chain_offsets) != np.diff(graph.chain_offsets))


def _consistent(graph: BoundaryGraph, new: Flags) -> BoundaryGraph:
    """Return the graph, with finer chains where coarse outlines of the new ones contradict each other or others."""
    for _ in range(CONTRADICTIONS):
        bad = chains_in_conflict(graph, coarse_segments(graph, np.ones(graph.n_chains, bool), 2), new)
        if not bad.any():
            flat = outline(graph, _faces_beside(graph, new), 2)
            cut = cut_at_constraints(triangulate(flat.points, flat.segments), flat.constraints)
            if not isinstance(cut, FaceConflict):
                return graph
            faces = np.zeros(len(graph.region_label), bool)
            faces[cut.regions] = True
            bad = chains_of(graph, faces)
        graph, new = halved(graph, bad), new | bad
    raise TopologyError("the boundaries of the regions cross or contradict each other")


def _mesh_faces(graph: BoundaryGraph, todo: Flags, options: MeshingOptions) -> _Meshed:
    """Mesh flagged faces on their levels."""
    effort = EFFORTS[options.effort]
    best = _Meshed([], np.zeros(len(todo), bool), np.full(len(todo), -np.inf))
    if effort.in_nine:
        even = mean_edges(graph) > EVEN * options.face_sizes(graph.region_label)
        best = _better(best, _mesh_wide(graph, todo & wide_faces(graph, 6, VERY_WIDE) & even, 6, effort.wide, options))
    wide = todo & wide_faces(graph, 4, LEAST_WIDTH) & (best.worst < ENOUGH)
    best = _better(best, _mesh_wide(graph, wide, 4, effort.wide, options))
    enough = np.where(_large_faces(best), min(WORST, effort.again_below), effort.again_below)
    return _better(best, _mesh_level(graph, todo & (best.worst < enough), 2, effort.narrow, options))


def _better(one: _Meshed, other: _Meshed) -> _Meshed:
    """Take each face from where its worst element is better, the first one if none is."""
    better = other.faces & (other.worst > one.worst)
    parts = _faces_of(one.parts, ~better) + _faces_of(other.parts, better)
    return _Meshed(parts, one.faces | other.faces, np.where(better, other.worst, one.worst))


def _large_faces(meshed: _Meshed) -> Flags:
    """Return which faces have so many quads that they are not meshed again for one that is not that bad."""
    faces = [np.empty(0, np.int64), *(part.face for part in meshed.parts)]
    return np.asarray(np.bincount(np.concatenate(faces), minlength=len(meshed.faces)) > LARGE)


def _mesh_wide(graph: BoundaryGraph, faces: Flags, stride: int, how: CleanUp, options: MeshingOptions) -> _Meshed:
    """Mesh faces coarsely, without those whose chords contradict each other."""
    while True:
        try:
            return _mesh_level(graph, faces, stride, how, options)
        except _Conflict as conflict:
            faces = faces.copy()
            faces[conflict.regions] = False


def _mesh_level(graph: BoundaryGraph, faces: Flags, stride: int, how: CleanUp, options: MeshingOptions) -> _Meshed:
    """Mesh the flagged faces from segments of `stride` edges."""
    worst = np.ones(len(faces))
    if not faces.any():
        return _Meshed([], faces, worst)
    groups = _groups_of(graph, faces, options.face_sizes(graph.region_label) * stride)
    composed = in_threads(groups, lambda group: batches_of(_compose(graph, group, stride, options)), options.threads)
    aside.wait()
    rim = coarse_segments(graph, chains_of(graph, faces), stride // 2)  # the Catmull-Clark split has halved edges
    nothing = np.zeros(len(rim.tail), np.int64)
    table = constraint_table(len(graph.points), rim.tail, rim.head, nothing, nothing, rim.middle)
    batches = [batch for group in composed for batch in group]
    parts = finished(batches, graph.points, stride // 2, table, how, options.threads)
    in_threads(parts, lambda part: lower_to_worst(part.points, part.quads, part.face, worst), options.threads)
    return _Meshed(parts, faces, worst)


def _groups_of(graph: BoundaryGraph, faces: Flags, sizes: Points) -> list[Flags]:
    """Return the flagged faces in groups of neighbours (by number) that threads can share, whatever their number."""
    quads = np.where(faces, np.maximum(graph.region_pixels, 1) / sizes**2, 0.0)
    count = int(np.clip(quads.sum() / GROUP, 1, MOST_GROUPS))
    group = np.floor((np.cumsum(quads) - 0.5 * quads) / quads.sum() * count)
    return [faces & (group == g) for g in np.unique(group[faces])]


def _compose(graph: BoundaryGraph, faces: Flags, stride: int, options: MeshingOptions) -> FaceQuads:
    """Triangulate faces, place points in layers, compose the triangles and split all to quads."""
    sizes = options.face_sizes(graph.region_label) * stride
    flat = outline(graph, faces, stride)
    cut = _cut(triangulate(flat.points, flat.segments, BACKGROUND_AREA * float(sizes[faces].max()) ** 2), flat)
    field = cross_field(cut, _largest_sizes(cut, sizes), options.slope)
    points = np.vstack([flat.points, frontal_points(cut, field)])
    cut = _cut(triangulate(points, flat.segments), flat)
    quads = split_composed(cut, compose(cut), len(flat.ids))
    n = len(cut.points)
    origin = quads.origin.copy()
    origin[:n] = np.where(origin[:n] >= 0, flat.ids[np.maximum(origin[:n], 0)], -1)
    return quads._replace(origin=origin)


def _cut(mesh: Triangles, flat: Outline) -> CutMesh:
    cut = cut_at_constraints(mesh, flat.constraints)
    if isinstance(cut, FaceConflict):
        raise _Conflict(cut.regions)
    return cut


def _largest_sizes(cut: CutMesh, sizes: Points) -> Points:
    """Return the size asked for at each point of a cut mesh."""
    face = np.zeros(len(cut.points), np.int64)
    face[cut.triangles] = cut.face[:, None]
    return sizes[face]


def _faces_beside(graph: BoundaryGraph, chains: Flags) -> Flags:
    """Return which faces have one of these chains on their outline."""
    faces = np.zeros(len(graph.region_label) + 1, bool)  # VOID is the last entry
    faces[graph.chain_regions[chains]] = True
    return faces[:-1]


def _stitch(graph: BoundaryGraph, parts: list[FaceQuads], materials: Materials) -> QuadMesh:
    """Join faces at the boundary's points."""
    graph, place = without_unused_points(graph)
    quads = joined(parts)
    inner = quads.origin < 0
    ids = place[quads.origin]
    ids[inner] = len(graph.points) + np.arange(inner.sum())
    points = np.vstack([graph.points, quads.points[inner]])
    kind = np.concatenate([graph.point_kind, np.full(inner.sum(), PointKind.INTERIOR, np.uint8)])
    return QuadMesh(
        points,
        kind,
        ids[quads.quads],
        quads.face,
        graph.region_label,
        graph.chain_offsets,
        graph.chain_points,
        graph.chain_regions,
        materials,
    )


def _slid(mesh: QuadMesh, rounds: int, threads: int) -> QuadMesh:
    """Let boundary nodes slide, and the nodes inside follow."""
    points, gone = mesh.points.copy(), np.zeros(mesh.n_points)
    rings, (groups, seams) = rings_of(mesh.quads, mesh.n_points), _inner_nodes(mesh, threads)

    def move(how: Callable[[Flags], object]) -> None:
        in_threads(groups, how, threads)
        how(seams)

    for _ in range(rounds):
        slide(points, rings, mesh.point_kind, mesh.chain_offsets, mesh.chain_points, gone)
        move(lambda free: newton(points, rings, free, 2, GOOD))
    move(lambda free: untangle(points, rings, free, 4, FAIR))
    return replace(mesh, points=points)


def _inner_nodes(mesh: QuadMesh, n_groups: int) -> tuple[list[Flags], Flags]:
    """Return the nodes inside faces in groups that do not feel each other, and those between them.

    A group has whole faces or strips of large ones, whatever the number of groups.
    """
    strip, n_strips = np.zeros(mesh.n_quads, np.int64), np.ones(len(mesh.region_label), np.int64)
    for face in np.flatnonzero(np.bincount(mesh.quad_region) > 4 * LARGEST):
        quads = np.flatnonzero(mesh.quad_region == face)
        strip[quads] = strips_of(mesh.points, mesh.quads[quads])
        n_strips[face] = strip[quads].max() + 1
    piece = (np.cumsum(n_strips) - n_strips)[mesh.quad_region] + strip
    groups, seams = independent_nodes(piece, mesh.quads, mesh.n_points, n_groups)
    inner = mesh.point_kind == PointKind.INTERIOR
    return [inner & group for group in groups], inner & seams


def _materials_of(labels: NDArray[np.int32]) -> Materials:
    present = np.unique(labels)
    shade = np.linspace(0, 255, len(present)).astype(np.uint8)
    return Materials(present, tuple(f"material {m}" for m in present), np.repeat(shade[:, None], 3, axis=1))
