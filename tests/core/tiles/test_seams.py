"""Seams through large regions: boundaries hardly know of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from imgquad_core.boundary import extract_boundaries, smooth_boundaries
from imgquad_core.cleanup.faces import FaceQuads
from imgquad_core.mesher.strides import SEAM_RINGS, judged
from imgquad_core.model import BoundaryGraph, PointKind
from imgquad_core.tiles.outlines import Outlines, settled
from support.labels import label_image
from support.tiles import LINE, SHAPE, SMOOTHING, outlines


def layers(slope: float) -> np.ndarray:
    y, x = np.indices(SHAPE) + 0.5
    return (y - 60 > slope * (x - LINE)).astype(np.int64)


def edges(found: Outlines, seam: bool) -> np.ndarray:
    """Lengths of the edges of seams, or of boundaries inside the picture."""
    inner = (found.owner < 2) & (found.seam == seam) & (found.shared if seam else (found.sides >= -1).all(axis=1))
    lengths = []
    for c in np.flatnonzero(inner):
        xy = found.points[found.ids[found.offsets[c] : found.offsets[c + 1]]]
        if not (((xy == 0) | (xy == SHAPE[::-1])).all(axis=0)).any():
            lengths.append(np.hypot(*np.diff(xy, axis=0).T))
    return np.concatenate(lengths)


@pytest.mark.parametrize("slope", [0.3, 1.0, 3.0, 8.0])
def test_edges_of_a_boundary_are_no_shorter_where_a_seam_crosses_it(slope: float) -> None:
    """However small the angle; where its pixels run along the line of tiles, it has one node there, not two."""
    labels = layers(slope)
    alone = smooth_boundaries(extract_boundaries(label_image(labels.astype(np.int32))), SMOOTHING)
    inner = np.flatnonzero((alone.chain_regions >= 0).all(axis=1))
    least = min(np.hypot(*np.diff(alone.points[alone.chain(int(c))], axis=0).T).min() for c in inner)
    for t in (0, 1):
        found = outlines(labels, t)
        assert found.seam.sum() == 2
        assert edges(found, seam=False).min() > 0.8 * least
        assert len(found.node) == 3  # the crossing, and both ends of the line


def test_both_tiles_have_the_same_nodes_at_a_crossing() -> None:
    labels = layers(5.0)
    both = [outlines(labels, t) for t in (0, 1)]
    tables = [sorted(map(tuple, found.node[:, 1:].tolist())) for found in both]
    assert tables[0] == tables[1]
    merged = settled(1, both[1], lambda other: both[other])
    seams = [{tuple(found.key[c]) for c in np.flatnonzero(found.seam)} for found in both]
    assert seams[0] == seams[1]
    kinds = {
        int(merged.kind[p])
        for c in np.flatnonzero(merged.seam)
        for p in merged.ids[merged.offsets[c] + 1 : merged.offsets[c + 1] - 1]
    }
    assert kinds == {PointKind.SEAM}


def test_a_seam_goes_round_what_is_close_beside_it() -> None:
    y, x = np.indices(SHAPE) + 0.5
    labels = (np.hypot(x - LINE + 16, y - 60) < 15).astype(np.int64)  # a pixel from the line
    found = outlines(labels, 1)
    (c,) = np.flatnonzero(found.seam)
    xy = found.points[found.ids[found.offsets[c] : found.offsets[c + 1]]]
    gap = np.hypot(xy[:, 0] - (LINE - 16), xy[:, 1] - 60) - 15
    assert gap.min() > 3.0
    assert xy[:, 0].min() > LINE - 1e-6
    assert (xy[[0, -1], 0] == LINE).all()


def test_areas_are_kept_where_a_seam_goes_round() -> None:
    y, x = np.indices(SHAPE) + 0.5
    labels = (np.hypot(x - LINE + 16, y - 60) < 15).astype(np.int64)
    found = outlines(labels, 0)
    (c,) = np.flatnonzero((found.owner == 0) & found.closed)
    px, py = found.points[found.ids[found.offsets[c] : found.offsets[c + 1]]].T
    area = 0.5 * abs(float((px[:-1] * py[1:] - px[1:] * py[:-1]).sum()))
    assert area == pytest.approx(np.count_nonzero(labels), rel=1e-3)


def test_valid_quads_near_seams_do_not_tell_how_good_a_face_is() -> None:
    """A row of quads: those at its start are near a seam, and count if they are folded only."""
    n = 2 * SEAM_RINGS
    x = np.arange(n + 1.0)
    points = np.concatenate([np.stack([x, 0 * x], axis=1), np.stack([x, 0 * x + 1], axis=1)])
    k = np.arange(n)
    quads = np.stack([k, k + 1, k + n + 2, k + n + 1], axis=1)
    faces = FaceQuads(points, quads, np.zeros(n, np.int64), np.arange(2 * n + 2), np.full(2 * n + 2, 4))
    kind = np.zeros(2 * n + 2, np.uint8)
    assert judged(faces, graph_with(kind)) is faces
    kind[0] = PointKind.SEAM
    assert np.array_equal(judged(faces, graph_with(kind)).quads, quads[SEAM_RINGS:])
    points[n + 2] = (1.0, -0.5)
    assert np.array_equal(judged(faces._replace(points=points), graph_with(kind)).quads[:2], quads[:2])


def graph_with(kind: np.ndarray) -> Any:
    none = np.empty(0, np.int64)
    return BoundaryGraph(
        np.zeros((len(kind), 2)), kind, np.zeros(1, np.int64), none, none.reshape(0, 2), none, none, (1, 1)
    )
