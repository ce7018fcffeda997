"""Mesh the boundaries of a mesh with Gmsh, one thread, and print what comes out as JSON.

    python benchmarks/gmsh_routes.py MESH.vtu subdivide-8

Each route makes a mesh of quads and triangles from every second point of our boundaries and splits it once, so that
its final edges are as long as ours. The time is that of Gmsh's own `generate` and `refine`, without handing over the
geometry.
"""

from __future__ import annotations

import json
import sys
from collections import Counter
from dataclasses import asdict
from itertools import pairwise
from time import perf_counter, process_time
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from imgquad_core.measures.quality import quad_areas, quality_report
from imgquad_core.model import Materials, PointKind, QuadMesh

Ids = NDArray[np.int64]
LINE, QUAD = 1, 3  #: Gmsh's numbers of element types


class Route(NamedTuple):
    """How Gmsh is asked for quads."""

    algorithm: int  #: 6 Frontal-Delaunay, 8 Frontal-Delaunay for quads
    recombination: int  #: 1 Blossom, 3 Blossom full-quad
    whole: bool  #: curves from junction to junction, which Gmsh may divide anew; else every segment is one curve


ROUTES = {
    "subdivide-6": Route(6, 1, False),
    "subdivide-8": Route(8, 1, False),
    "full-quad": Route(8, 3, True),
}


class Made(NamedTuple):
    """A mesh of Gmsh's and what it took."""

    mesh: QuadMesh
    not_quads: int
    seconds: float
    cpu: float


def gmsh_mesh(mesh: QuadMesh, route: str) -> Made:
    """Mesh the boundaries of `mesh` with Gmsh."""
    import gmsh

    how = ROUTES[route]
    curves = coarse_curves(mesh)
    size = float(np.median(np.concatenate([np.hypot(*np.diff(mesh.points[c], axis=0).T) for c in curves])))
    gmsh.initialize(interruptible=False)
    try:
        for name, value in (
            ("General.Terminal", 0),
            ("General.NumThreads", 1),
            ("Mesh.Algorithm", how.algorithm),
            ("Mesh.RecombineAll", 1),
            ("Mesh.RecombinationAlgorithm", how.recombination),
            ("Mesh.MeshSizeExtendFromBoundary", 1),
            ("Mesh.SubdivisionAlgorithm", 0),
        ):
            gmsh.option.setNumber(name, value)
        if how.whole:
            gmsh.option.setNumber("Mesh.MeshSizeMin", 0.9 * size)
            gmsh.option.setNumber("Mesh.MeshSizeMax", 1.1 * size)
        _hand_over(gmsh.model, mesh.points, curves, size, how.whole)
        start, cpu = perf_counter(), process_time()
        gmsh.model.mesh.generate(2)
        gmsh.option.setNumber("Mesh.SubdivisionAlgorithm", 1)
        gmsh.model.mesh.refine()
        seconds, cpu = perf_counter() - start, process_time() - cpu
        return Made(*_taken_back(gmsh.model.mesh), seconds, cpu)
    finally:
        gmsh.finalize()


def coarse_curves(mesh: QuadMesh) -> list[Ids]:
    """Return every second point of each chain; all points where a chain would vanish or two would coincide."""
    fine = [mesh.chain_points[a:b] for a, b in pairwise(mesh.chain_offsets)]
    coarse = [np.append(c[:-1:2], c[-1]) for c in fine]
    spans = Counter(frozenset((c[0], c[-1])) for c in coarse if len(c) == 2)

    def stands(c: Ids) -> bool:
        return len(c) > 3 or (c[0] != c[-1] and (len(c) > 2 or spans[frozenset((c[0], c[-1]))] == 1))

    return [c if stands(c) else full for c, full in zip(coarse, fine, strict=True)]


def _hand_over(model: Any, points: NDArray[np.float64], curves: list[Ids], size: float, whole: bool) -> None:
    """Give points, curves and faces to Gmsh, with the number of edges on each curve."""
    from shapely import LineString
    from shapely.geometry.polygon import orient
    from shapely.ops import polygonize

    geo = model.geo
    used = np.unique(np.concatenate(curves))
    id_at = {tuple(points[i]): int(i) for i in used}
    for i in used:
        geo.addPoint(*points[i], 0.0, size, int(i) + 1)
    curve_of: dict[tuple[int, int], int] = {}
    edges: dict[int, int] = {}
    for ids in curves:
        for piece in [ids.tolist()] if whole else [list(pair) for pair in pairwise(ids.tolist())]:
            add = geo.addLine if len(piece) == 2 else lambda *tags: geo.addPolyline(tags)
            curve = add(*(i + 1 for i in piece))
            # full-quad wants an even number of edges on every curve
            edges[curve] = len(piece) - 1 + (whole and len(piece) % 2 == 0)
            for a, b in pairwise(piece):
                curve_of[a, b], curve_of[b, a] = curve, -curve
    for face in map(orient, polygonize([LineString(points[c]) for c in curves])):
        rings = [[id_at[xy] for xy in ring.coords] for ring in (face.exterior, *face.interiors)]
        geo.addPlaneSurface([geo.addCurveLoop(_curves_along(ring, curve_of)) for ring in rings])
    geo.synchronize()
    for curve, n in edges.items():
        model.mesh.setTransfiniteCurve(curve, n + 1)


def _curves_along(ring: list[int], curve_of: dict[tuple[int, int], int]) -> list[int]:
    """Return the curves of a ring in order, each once; the ring may start inside one."""
    steps = [curve_of[pair] for pair in pairwise(ring)]
    found = [c for before, c in zip([0, *steps[:-1]], steps, strict=True) if c != before]
    return found[:-1] if len(found) > 1 and found[0] == found[-1] else found


def _taken_back(mesh: Any) -> tuple[QuadMesh, int]:
    """Return the quads as one region, its curves as chains of single edges, and the number of other cells."""
    tags, xyz, _ = mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags] = np.arange(len(tags))
    points = xyz.reshape(-1, 3)[:, :2]
    types, cells, _ = mesh.getElements(2)
    others = sum(len(c) for t, c in zip(types, cells, strict=True) if t != QUAD)
    quads = place[mesh.getElementsByType(QUAD)[1]].reshape(-1, 4)
    # a face may be meshed from below
    quads = np.where((quad_areas(points, quads) < 0)[:, None], quads[:, ::-1], quads)
    edges = place[mesh.getElementsByType(LINE)[1]]
    return QuadMesh(
        points=points,
        point_kind=np.full(len(points), PointKind.INTERIOR, np.uint8),
        quads=quads,
        quad_region=np.zeros(len(quads), np.int64),
        region_label=np.zeros(1, np.int32),
        chain_offsets=np.arange(0, len(edges) + 1, 2),
        chain_points=edges,
        chain_regions=np.zeros((len(edges) // 2, 2), np.int64),
        materials=Materials(np.zeros(1, np.int32), ("all",), np.zeros((1, 3), np.uint8)),
    ), others


def main(path: str, route: str) -> None:
    import pyvista as pv

    from imgquad_mesh.datasets.grids import to_mesh
    from imgquad_mesh.outputs.report import peak_memory_mb

    made = gmsh_mesh(to_mesh(pv.read(path))[0], route)
    figures = {"seconds": made.seconds, "cpu": made.cpu, "not_quads": made.not_quads}
    area = float(quad_areas(made.mesh.points, made.mesh.quads).sum())
    quality = asdict(quality_report(made.mesh))
    print(json.dumps(figures | {"area": area, "peak_memory_mb": peak_memory_mb(), "quality": quality}))


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[2] not in ROUTES:
        sys.exit(f"{__doc__}\nroutes: {', '.join(ROUTES)}")
    main(*sys.argv[1:])
