"""From boundaries to quads: the paper's step 4, face by face on strides.

Every face (region) is meshed alone; faces meet in the points of the boundary, so they fit whatever their stride. A
wide face is meshed and cleaned up with a stride of four final edges (an irregular node stays one node while nodes
become sixteen times as many), with effort "best" a very wide one with a stride of six, others with one of two. A face
whose worst element is poor is meshed again with the next smaller stride, and the better mesh is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from imgquad_core import ahead
from imgquad_core.arrays import Flags, Floats, Ints, Labels, read_only
from imgquad_core.chains import any_of_chain, edges_of_chains, without_unused_points
from imgquad_core.cleanup.faces import FaceQuads, joined, stitched
from imgquad_core.cleanup.options import Portions
from imgquad_core.cleanup.relaxation import GOOD, GUARD, LEAST, newton, part, rings_of, untangle
from imgquad_core.cleanup.sliding import slide
from imgquad_core.cleanup.strips import independent_nodes, nodes_around, strips_of
from imgquad_core.errors import TopologyError
from imgquad_core.geometry.conflicts import CROSSING, find_conflicts
from imgquad_core.geometry.quad_shape import lower_to_worst
from imgquad_core.model import VOID, BoundaryGraph, Materials, PointKind, QuadMesh
from imgquad_core.threads import in_threads

from .efforts import EFFORTS
from .options import MeshingOptions
from .outline import coarse_segments, with_short_chains_halved
from .progress import Progress
from .refits import State, with_musts
from .strides import LEAST_WIDTH, WIDEST, consistent, mesh_faces
from .wishes import with_wishes

STUB = 0.1  # of the longest edge at a node: a shorter one is lengthened in the end, as far as the worst quad allows
FAIR = 0.86  # below it, in the end, the worst corner of a ring counts alone; 60 degrees give .866


class Filled(NamedTuple):
    """A mesh, and on which stride each face was meshed."""

    mesh: QuadMesh
    stride: Ints  #: (n_faces,)
    fell: Flags  #: (n_faces,) those that were worse on a wider one


def mesh_boundaries(
    graph: BoundaryGraph,
    options: MeshingOptions | None = None,
    materials: Materials | None = None,
    told: Callable[[float], None] | None = None,
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
    told : callable, optional
        Called again and again with the share of the quads, 0 to 1, that are made.

    Returns
    -------
    QuadMesh
        Convex, counter-clockwise quads. The points of `graph` come first, in their order; those inside chains may
        have slid along them, and some edges may have got a mid-point.

    Raises
    ------
    TopologyError
        If the chains cross, or one has an odd number of edges.
    """
    return fill_faces(graph, options or MeshingOptions(), materials, told).mesh


@ahead.compiling
def fill_faces(
    graph: BoundaryGraph,
    options: MeshingOptions,
    materials: Materials | None = None,
    told: Callable[[float], None] | None = None,
    widest: Ints | None = None,
    once: Flags | None = None,
) -> Filled:
    """Do what `mesh_boundaries` does, with no face on a stride above its `widest`; tell also their strides.

    Faces flagged `once` are not tried again on a stride that they were worse on, when edges beside them are halved.
    """
    _assert_even(graph)
    graph = consistent(graph, np.ones(graph.n_chains, bool), options.triangulator)
    graph = with_short_chains_halved(graph, LEAST_WIDTH)
    progress = Progress(graph.region_pixels / options.face_sizes(graph.region_label) ** 2, told) if told else None
    n = len(graph.region_label)
    widest = np.full(n, WIDEST) if widest is None else widest
    meshed = mesh_faces(graph, np.ones(n, bool), options, widest, progress)
    state = State(graph, meshed, widest if once is None else np.where(once & meshed.fell, meshed.stride, widest))
    state = with_musts(state, options)
    mesh = _stitch(state.graph, state.meshed.parts, materials or _materials_of(graph.region_label))
    slid = _slid(mesh, graph.shape, EFFORTS[options.effort].slides, options.n_threads, options.tuning.portions)
    mended = with_wishes(slid, graph.shape, lambda area: fill_held(area, options), options)
    parted = _parted(mended, options.n_threads, options.tuning.portions)
    return Filled(parted, state.meshed.stride, state.meshed.fell | (state.widest < widest))


def _assert_even(graph: BoundaryGraph) -> None:
    if (odd := np.flatnonzero(edges_of_chains(graph) % 2)).size:
        raise TopologyError(f"chain {odd[0]} has {edges_of_chains(graph)[odd[0]]} edges: give each an even number")


def fill_held(graph: BoundaryGraph, options: MeshingOptions) -> QuadMesh:
    """Fill a boundary all points of which stay, on stride 2.

    Raises
    ------
    TopologyError
        Quads are folded, or a chain has an odd number of edges.
    """
    _assert_even(graph)
    every = np.ones(len(graph.region_label), bool)
    graph = consistent(graph, np.ones(graph.n_chains, bool), options.triangulator)
    meshed = mesh_faces(graph, every, options, np.full(len(every), 2))
    if meshed.worst.min() <= 0.0:
        raise TopologyError("quads beside a boundary that is held are folded")
    mesh = _stitch(graph, meshed.parts, _materials_of(graph.region_label))
    return _slid(mesh, graph.shape, 0, options.n_threads, options.tuning.portions)


def _stitch(graph: BoundaryGraph, parts: list[FaceQuads], materials: Materials) -> QuadMesh:
    """Join faces at the boundary's points."""
    graph, place = without_unused_points(graph)
    return stitched(joined(parts), place, graph.points, graph.point_kind, graph.chains, graph.region_label, materials)


def _slid(mesh: QuadMesh, shape: tuple[int, int], rounds: int, threads: int, portions: Portions) -> QuadMesh:
    """Let boundary nodes slide, and the nodes inside follow.

    Quads on both sides keep chains apart; on the side of void there are none, so what meets there is held, and all is
    done anew.
    """
    held = np.zeros(mesh.n_points, bool)
    while True:
        moved = _slid_but(mesh, held, rounds, threads, portions)
        met = _met_over_void(moved, shape) & ~held
        if met.any():
            met &= (moved.points != mesh.points).any(axis=1)
        if not met.any():
            return moved
        held |= met


def _slid_but(mesh: QuadMesh, held: Flags, rounds: int, threads: int, portions: Portions) -> QuadMesh:
    points, gone = mesh.points.copy(), np.zeros(mesh.n_points)
    rings, (groups, seams) = rings_of(mesh.quads, mesh.n_points), _inner_nodes(mesh, threads, portions)
    kind = read_only(np.where(held, PointKind.HELD, mesh.point_kind), np.uint8)  # else compiled once more

    def move(how: Callable[[Flags], object]) -> None:
        in_threads(groups, how, threads)
        how(seams)

    for _ in range(rounds):
        slide(points, rings, kind, mesh.chain_offsets, mesh.chain_points, gone)
        move(lambda free: newton(points, rings, free, 2, GOOD))
    move(lambda free: untangle(points, rings, free, 4, FAIR))
    return replace(mesh, points=points)


def _parted(mesh: QuadMesh, threads: int, portions: Portions) -> QuadMesh:
    """Lengthen edges that are stubs beside the others of their node."""
    points, mended = mesh.points.copy(), np.zeros(mesh.n_points, bool)
    rings, (groups, seams) = rings_of(mesh.quads, mesh.n_points), _inner_nodes(mesh, threads, portions)
    floor = _worst(points, rings.quads)
    in_threads(groups, lambda free: part(points, rings, free, STUB, floor, mended), threads)
    part(points, rings, seams, STUB, floor, mended)
    if mended.any():
        near = nodes_around(rings.quads, mended, 1)
        in_threads(groups, lambda free: untangle(points, rings, free & near, 4, FAIR), threads)
        untangle(points, rings, seams & near, 4, FAIR)
    return replace(mesh, points=points)


def _met_over_void(mesh: QuadMesh, shape: tuple[int, int]) -> Flags:
    """Flag the points of boundaries of void that cross or touch others, or have left the picture."""
    met: Flags = ((mesh.points < 0.0) | (mesh.points > shape[::-1])).any(axis=1)
    is_free = any_of_chain(mesh.point_kind[mesh.chain_points] == PointKind.FREE, mesh.chain_offsets)
    of_void = is_free & (mesh.chain_regions == VOID).any(axis=1)  # the picture's border has no free points
    if of_void.any():
        segments = coarse_segments(mesh, np.ones(len(of_void), bool), 1)
        pairs = np.stack([segments.tail, segments.head], axis=1)
        marks = find_conflicts(mesh.points, pairs, segments.chain, of_void, shape)
        met[pairs[marks == CROSSING]] = True
    return met


def _worst(points: Floats, quads: Ints) -> float:
    """Return the worst scaled Jacobian, within the limits that nodes may lower others to."""
    worst = np.ones(1)
    lower_to_worst(points, quads, np.zeros(len(quads), np.int64), worst)
    return float(np.clip(worst[0], LEAST, GUARD))


def _inner_nodes(mesh: QuadMesh, n_groups: int, portions: Portions) -> tuple[list[Flags], Flags]:
    """Return the nodes inside faces in groups that do not feel each other, and those between them.

    A group has whole faces or strips of large ones, whatever the number of groups.
    """
    strip, n_strips = np.zeros(mesh.n_quads, np.int64), np.ones(len(mesh.region_label), np.int64)
    for face in np.flatnonzero(np.bincount(mesh.quad_region) > 4 * portions.largest):
        quads = np.flatnonzero(mesh.quad_region == face)
        strip[quads] = strips_of(mesh.points, mesh.quads[quads], portions)
        n_strips[face] = strip[quads].max() + 1
    piece = (np.cumsum(n_strips) - n_strips)[mesh.quad_region] + strip
    groups, seams = independent_nodes(piece, mesh.quads, mesh.n_points, n_groups)
    inner = mesh.point_kind == PointKind.INTERIOR
    return [inner & group for group in groups], inner & seams


def _materials_of(labels: Labels) -> Materials:
    present = np.unique(labels)
    shade = np.linspace(0, 255, len(present)).astype(np.uint8)
    return Materials(present, tuple(f"material {m}" for m in present), np.repeat(shade[:, None], 3, axis=1))
