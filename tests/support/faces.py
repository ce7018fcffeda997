"""Boundary graphs and meshes of faces made by hand, and what every mesh of faces must satisfy."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import Voronoi

from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.mesher.composing import compose
from imgquad_core.mesher.crossfield import cross_field
from imgquad_core.mesher.cutting import CutMesh, FaceConflict, cut_at_constraints
from imgquad_core.mesher.frontal import frontal_points
from imgquad_core.mesher.outline import Outline, outline
from imgquad_core.mesher.splitting import split_composed
from imgquad_core.mesher.triangulation import triangulate
from imgquad_core.model import VOID, BoundaryGraph, PointKind
from support import naive

Ids = NDArray[np.int64]
Points = NDArray[np.float64]


def graph_of(
    points: ArrayLike, chains: Sequence[Sequence[int]], regions: Sequence[tuple[int, int]], shape: tuple[int, int]
) -> BoundaryGraph:
    """Boundary graph of chains of point ids; region r has material r."""
    xy = np.asarray(points, float)
    x, y = xy.T
    rows, cols = shape
    on_x, on_y = (x == 0) | (x == cols), (y == 0) | (y == rows)
    kind = np.where(on_x & on_y, PointKind.CORNER, np.where(on_x | on_y, PointKind.FRAME, PointKind.FREE))
    ends = Counter(v for chain in chains for v in {chain[0], chain[-1]})
    kind[[v for v, n in ends.items() if n > 2]] = PointKind.JUNCTION
    n_regions = max(max(pair) for pair in regions) + 1
    area = np.zeros(n_regions + 1)
    for chain, (left, right) in zip(chains, regions, strict=True):
        a, b = xy[list(chain[:-1])], xy[list(chain[1:])]
        swept = 0.5 * (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()
        area[left] += swept
        area[right] -= swept
    return BoundaryGraph(
        xy,
        kind,
        np.cumsum([0] + [len(chain) for chain in chains]),
        np.concatenate(chains),
        np.array(regions),
        np.arange(n_regions),
        np.round(area[:-1]).astype(np.int64),
        shape,
    )


def polygon_graph(corners: ArrayLike, edges: Sequence[int], shape: tuple[int, int]) -> BoundaryGraph:
    """One region within a polygon (counter-clockwise) whose sides have so many edges each."""
    xy = np.asarray(corners, float)
    sides = [
        a + (b - a) * np.arange(n)[:, None] / n for a, b, n in zip(xy, np.roll(xy, -1, axis=0), edges, strict=True)
    ]
    n = sum(edges)
    return graph_of(np.concatenate(sides), [[*range(n), 0]], [(0, VOID)], shape)


def voronoi_graph(n: int, cells: int, size: float, seed: int, bend: float = 0.06) -> BoundaryGraph:
    """Grains of n x n pixels, `cells` along each side: Voronoi cells with sides bent by `bend` times their length.

    Sides have edges of about `size`, a multiple of 4 where they are longer than six edges, else of 2.
    """
    rng = np.random.default_rng(seed)
    seeds = (np.indices((cells, cells)).reshape(2, -1).T + rng.random((cells**2, 2))) * n / cells
    mirrored = [seeds, seeds * [-1, 1], seeds * [1, -1], [2 * n, 0] + seeds * [-1, 1], [0, 2 * n] + seeds * [1, -1]]
    diagram = Voronoi(np.vstack(mirrored))
    points: list[Points] = []
    place: dict[int, int] = {}

    def add(xy: Points) -> int:
        on = np.isclose(xy[:, None], [0, n], atol=1e-6)
        points.append(np.where(on.any(axis=1), n * on[:, 1], xy))
        return len(points) - 1

    chains, regions = [], []
    for (a, b), (u, w) in zip(diagram.ridge_points, diagram.ridge_vertices, strict=True):
        if min(a, b) >= len(seeds):
            continue
        for v in (u, w):
            place[v] = place[v] if v in place else add(diagram.vertices[v])
        start, end = points[place[u]], points[place[w]]
        along = end - start
        length = np.hypot(*along)
        edges = max(2, 4 * round(length / size / 4) if length > 6 * size else 2 * round(length / size / 2))
        on_frame = max(a, b) >= len(seeds)
        aside = np.array([-along[1], along[0]]) * (0.0 if on_frame else bend)
        s = np.arange(1, edges)[:, None] / edges
        inner = [add(xy) for xy in start + along * s + aside * np.sin(np.pi * s)]
        chains.append([place[u], *inner, place[w]])
        is_left = np.linalg.det([along, diagram.points[a] - start]) > 0
        pair = (a, b) if is_left else (b, a)
        regions.append((pair[0] if pair[0] < len(seeds) else VOID, pair[1] if pair[1] < len(seeds) else VOID))
    return graph_of(np.array(points), chains, regions, (n, n))


def cut_of(graph: BoundaryGraph, stride: int, max_area: float | None) -> tuple[CutMesh, Outline]:
    """Triangulate the outline of all faces and cut it apart."""
    flat = outline(graph, np.ones(len(graph.region_label), bool), stride)
    cut = cut_at_constraints(triangulate(flat.points, flat.segments, max_area), flat.constraints)
    assert not isinstance(cut, FaceConflict)
    return cut, flat


def with_layers(graph: BoundaryGraph, size: float, stride: int = 2) -> tuple[CutMesh, Outline]:
    """Triangulate faces with points in layers, for final edges of length `size`."""
    coarse = size * stride
    cut, flat = cut_of(graph, stride, 2.5 * coarse**2)
    field = cross_field(cut, np.full(len(cut.points), coarse), 0.3)
    points = np.vstack([flat.points, frontal_points(cut, field)])
    full = cut_at_constraints(triangulate(points, flat.segments), flat.constraints)
    assert not isinstance(full, FaceConflict)
    return full, flat


def quads_of(graph: BoundaryGraph, size: float, stride: int = 2) -> FaceQuads:
    """Mesh all faces, without any clean-up; `origin` in ids of the graph, straight edges between coarse points."""
    cut, flat = with_layers(graph, size, stride)
    mesh = split_composed(cut, compose(cut), len(flat.ids))
    n = len(cut.points)
    origin = mesh.origin.copy()
    origin[:n] = np.where(origin[:n] >= 0, flat.ids[origin[:n]], -1)
    return mesh._replace(origin=origin)


def grid(n: int, m: int, jiggle: float = 0.0, seed: int = 0) -> FaceQuads:
    """n x m unit squares, the inner points moved at random by up to `jiggle` along each axis."""
    y, x = np.divmod(np.arange((n + 1) * (m + 1)), n + 1)
    points = np.stack([x, y], axis=1).astype(float)
    inner = (x > 0) & (x < n) & (y > 0) & (y < m)
    points[inner] += np.random.default_rng(seed).uniform(-jiggle, jiggle, (int(inner.sum()), 2))
    first = np.flatnonzero((x < n) & (y < m))
    quads = np.stack([first, first + 1, first + n + 2, first + n + 1], axis=1)
    wanted = np.bincount(quads.ravel())
    return FaceQuads(points, quads, np.zeros(n * m, np.int64), np.where(inner, -1, np.arange(len(x))), wanted)


def valences(mesh: FaceQuads) -> Ids:
    """Number of quads at each point."""
    return np.bincount(mesh.quads.ravel(), minlength=len(mesh.points))


def rim_edges(mesh: FaceQuads) -> set[tuple[int, int, int]]:
    """Face, origin of the tail, origin of the head of each half-edge on the rim."""
    rim = np.flatnonzero(naive.twins(mesh.quads) == -1)
    tail, head = mesh.quads.ravel()[rim], np.roll(mesh.quads, -1, axis=1).ravel()[rim]
    rows = np.stack([mesh.face[rim // 4], mesh.origin[tail], mesh.origin[head]], axis=1)
    return {(f, a, b) for f, a, b in rows.tolist()}


def assert_valid_faces(mesh: FaceQuads, graph: BoundaryGraph | None = None) -> None:
    """Convex quads in faces that share no point, whole, each with its own rim; rim points where the graph has them."""
    assert naive.worst_quality(mesh.points, mesh.quads) > 0
    twins = naive.twins(mesh.quads)
    assert twins.min() >= -1, "an edge with more than two quads"
    assert np.array_equal(np.unique(mesh.quads), np.arange(len(mesh.points))), "points without quads"
    inner = np.flatnonzero(twins >= 0)
    assert np.array_equal(mesh.face[inner // 4], mesh.face[twins[inner] // 4]), "faces are joined"
    on_rim = np.zeros(len(mesh.points), bool)
    on_rim[mesh.quads.ravel()[twins == -1]] = True
    assert np.array_equal(on_rim, mesh.origin >= 0)
    assert (mesh.wanted[~on_rim] == 4).all()
    n_corners = np.bincount(mesh.quads.ravel())[on_rim]
    leaving = np.bincount(mesh.quads.ravel()[twins == -1], minlength=len(mesh.points))[on_rim]
    assert (leaving == 1).all(), "a rim point in two sectors"
    assert (n_corners >= 1).all()
    if graph is not None:
        rim = rim_edges(mesh)
        expected = set()
        for c, (left, right) in enumerate(graph.chain_regions.tolist()):
            for a, b in zip(graph.chain(c)[:-1].tolist(), graph.chain(c)[1:].tolist(), strict=True):
                expected |= {(f, *e) for f, e in ((left, (a, b)), (right, (b, a))) if f != VOID}
        assert rim == expected


def irregularity(mesh: FaceQuads) -> int:
    """Sum over all points of what the clean-up lowers: 1, 3, 5, ... inside, 4 or 2 per quad too few or many on rims."""
    off = valences(mesh) - mesh.wanted
    rim = np.where(off < 0, -4 * off, 2 * off)
    inside = np.where(off == 0, 0, 2 * np.abs(off) - 1)
    return int(np.where(mesh.origin >= 0, rim, inside).sum())
