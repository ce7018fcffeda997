"""What every boundary graph must satisfy, checked slowly with shapely, independently of the code under test."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from imgquad_core.model import BoundaryGraph, PointKind


def level_chains(graph: BoundaryGraph, step: int) -> list[NDArray[np.int64]]:
    """Every `step`-th point of each chain."""
    return [graph.chain(c)[::step] for c in range(graph.n_chains)]


def check_planar(graph: BoundaryGraph, step: int) -> None:
    """Check that every `step`-th point forms polylines that meet in shared points only, with the right faces."""
    chains = level_chains(graph, step)
    segments = np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in chains])
    lines = shapely.linestrings(graph.points[segments])
    assert (shapely.length(lines) > 0).all(), "segment of no length"
    first, second = shapely.STRtree(lines).query(lines, predicate="intersects")
    first, second = first[first < second], second[first < second]
    shared = (segments[first][:, :, None] == segments[second][:, None, :]).any(axis=2).sum(axis=1)
    assert (shared == 1).all(), f"segments meet without a shared point: {segments[first[shared != 1]][:3].tolist()}"
    meet = shapely.intersection(lines[first], lines[second])
    assert (shapely.get_type_id(meet) == 0).all(), "segments overlap"
    check_faces(graph, chains)


def check_faces(graph: BoundaryGraph, chains: list[NDArray[np.int64]]) -> None:
    """Check that each face between the polylines has one region all round, and each region one face."""
    side = {}
    for c, chain in enumerate(chains):
        for a, b in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True):
            side[a, b], side[b, a] = graph.chain_regions[c]
    used = np.unique(np.concatenate(chains))
    at = {tuple(xy): k for k, xy in zip(used.tolist(), graph.points[used].tolist(), strict=True)}
    assert len(at) == len(used), "two points at one place"
    pairs = np.array(list(side))
    faces = shapely.get_parts(shapely.polygonize(shapely.linestrings(graph.points[pairs[pairs[:, 0] < pairs[:, 1]]])))
    found: Counter[int] = Counter()
    for face in shapely.orient_polygons(faces):
        regions = set()
        for ring in (face.exterior, *face.interiors):
            ids = [at[xy] for xy in ring.coords]
            regions |= {int(side[pair]) for pair in pairwise(ids)}
        assert len(regions) == 1, f"a face with the regions {regions}"
        found[regions.pop()] += 1
    assert all(found[r] == 1 for r in range(len(graph.region_label))), "a region with no face or several"


def check_meshable(graph: BoundaryGraph) -> None:
    """Check all that the mesher relies on."""
    counts = np.diff(graph.chain_offsets) - 1
    assert (counts % 2 == 0).all()
    assert (counts >= 2).all()
    ends = [(graph.chain(c)[0], graph.chain(c)[-1]) for c in range(graph.n_chains)]
    for c, (a, b) in enumerate(ends):
        if a == b:
            assert counts[c] >= 6, "a loop of fewer than three coarse segments"
    seen = Counter(tuple(sorted(e)) for e, n in zip(ends, counts, strict=True) if n == 2)
    assert all(n == 1 for n in seen.values()), "two chains of one coarse segment between the same points"
    n_rows, n_cols = graph.shape
    x, y = graph.points.T
    on_border = (x == 0) | (x == n_cols) | (y == 0) | (y == n_rows)
    assert ((x >= 0) & (x <= n_cols) & (y >= 0) & (y <= n_rows)).all()
    assert on_border[graph.point_kind == PointKind.FRAME].all()
    assert not on_border[graph.point_kind == PointKind.FREE].any()
    check_planar(graph, 1)
    check_planar(graph, 2)
