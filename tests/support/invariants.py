"""What every mesh must satisfy, told from its arrays alone."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label as connected
from scipy.ndimage import maximum_filter, minimum_filter
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from imgquad_core.boundary.areas import enclosed_areas
from imgquad_core.model import VOID, LabelImage, PointKind, QuadMesh
from imgquad_core.picture.selection import material_number
from imgquad_core.pipeline import Run

Array = NDArray[Any]
LEAST_SIDE = 0.001  #: px, of a quad, at sizes from 1 px on, but for periodic cells; the campaign's shortest was .0048
_PIXELS = 10**6  # looked at at once


Lengths = float | tuple[float, float]


def assert_valid_mesh(mesh: QuadMesh, image: LabelImage, *, pixel_size: Lengths = 1.0) -> None:
    """Fail unless `mesh` is a valid all-quad mesh of `image`: convex, conforming, whole, of the right materials."""
    rows, cols = image.shape
    points = np.asarray(mesh.points) / pixel_size
    assert_arrays(mesh)
    assert_convex(points, mesh.quads)
    assert_conforming(mesh)
    assert_constraints(mesh, points, (cols, rows))
    assert_within(points, (cols, rows), pixel_size)
    assert_topology(mesh, image)
    assert_materials(mesh, points, image)


def assert_simplified_mesh(mesh: QuadMesh, labels: LabelImage, *, pixel_size: Lengths = 1.0) -> None:
    """Fail unless `mesh` is valid, with the materials of `labels`, its void left out; outlines may have moved."""
    rows, cols = labels.shape
    points = np.asarray(mesh.points) / pixel_size
    assert_arrays(mesh)
    assert_convex(points, mesh.quads)
    assert_conforming(mesh)
    assert_constraints(mesh, points, (cols, rows))
    assert_within(points, (cols, rows), pixel_size)
    assert_topology(mesh, labels)
    solid = labels.labels != VOID
    assert np.array_equal(np.unique(mesh.quad_material), np.unique(labels.labels[solid]))
    if solid.all():
        assert np.isclose(quad_areas(points, mesh.quads).sum(), solid.size, rtol=1e-9)


def assert_within(points: Array, extent: tuple[int, int], pixel_size: Lengths) -> None:
    """No point lies beyond the border; only what was divided by a length other than 1 may be off, by rounding."""
    room = 0.0 if np.all(np.equal(pixel_size, 1.0)) else 1e-12
    assert (points <= np.multiply(extent, 1.0 + room)).all()


def assert_areas_of_boundary(done: Run) -> None:
    """Fail unless each region has the area within its boundary, to rounding: none is lost, none lies over another."""
    mesh = done.pixel_mesh
    found = np.bincount(mesh.quad_region, quad_areas(mesh.points, mesh.quads), len(mesh.region_label))
    assert np.array_equal(mesh.region_label, done.boundary.region_label)
    assert np.allclose(found, enclosed_areas(done.boundary), rtol=1e-9, atol=1e-9)


def assert_areas_of_pixels(done: Run) -> None:
    """Fail unless each region of 50 pixels or more has the area of its pixels, to 2 %."""
    pixels = done.boundary.region_pixels
    error = np.abs(enclosed_areas(done.boundary) / pixels - 1.0)[pixels >= 50]
    assert error.max(initial=0.0) < 0.02, f"a region is off by {error.max():.1%} of its area"


def assert_opposite_sides_match(mesh: QuadMesh, directions: str, shape: tuple[int, int]) -> None:
    """Fail if a node of one side of a picture of `shape` lies within an edge of the opposite side."""
    for axis in map("xy".index, directions):
        low, high = (_edges_at(mesh, axis, level) for level in (0, shape[1 - axis]))
        for edges, others in ((low, high), (high, low)):
            places = np.unique(others)
            within = np.searchsorted(places, edges[:, 0], "right") < np.searchsorted(places, edges[:, 1], "left")
            assert not within.any(), f"nodes within edges of the opposite side, first at {edges[within][0]}"


def _edges_at(mesh: QuadMesh, axis: int, level: int) -> Array:
    """Lower and upper ends of the edges on one side of the border, shape (n, 2)."""
    ends = np.stack(_half_edges(mesh.quads), axis=1)
    ends = ends[(mesh.points[ends, axis] == level).all(axis=1)]
    return np.sort(mesh.points[ends, 1 - axis], axis=1)


def assert_sides_long(pixel_mesh: QuadMesh) -> None:
    """Fail if a side of a quad is shorter than is promised."""
    start, end = _half_edges(pixel_mesh.quads)
    shortest = np.linalg.norm(pixel_mesh.points[start] - pixel_mesh.points[end], axis=1).min()
    assert shortest >= LEAST_SIDE, f"a side of {shortest:.2g} px"


def quad_areas(points: Array, quads: Array) -> Array:
    """Area of each quad, negative where it runs clockwise."""
    x, y = np.moveaxis(points[quads], 2, 0)
    return 0.5 * ((x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0]))


def assert_accounted(done: Run) -> None:
    """Fail unless every material is meshed or named as absorbed, and what is lost and gained adds up."""
    solid = done.clean.labels[done.clean.labels != VOID]
    was, now = np.unique(solid), np.unique(done.mesh.quad_material)
    gone = {row.material for row in done.absorbed if row.lost == row.pixels and row.absorbed == row.regions}
    dropped = {material_number(done.clean.materials, name) for name in done.options.drop}
    assert set(was.tolist()) == set(now.tolist()) | gone | (dropped & set(was.tolist()))  # some were noise before
    assert gone.isdisjoint(now.tolist())
    for row in done.absorbed:
        assert row.pixels == np.count_nonzero(solid == row.material)
        assert 0 <= row.absorbed <= row.regions
        assert 0 <= row.lost <= row.pixels
        assert row.absorbed == 0 or row.lost > 0
        if row.material in done.options.keep:
            assert row.lost == 0
    lost, gained = (sum(getattr(row, name) for row in done.absorbed) for name in ("lost", "gained"))
    assert abs(lost - gained) <= len(done.absorbed)  # an enlarged picture has parts of pixels


def assert_arrays(mesh: QuadMesh) -> None:
    assert mesh.quads.ndim == 2
    assert mesh.quads.shape[1] == 4
    assert mesh.n_quads > 0
    assert np.isfinite(mesh.points).all()
    assert np.array_equal(np.unique(mesh.quads), np.arange(mesh.n_points)), "points that no quad uses, or bad ids"
    assert len(np.unique(mesh.points, axis=0)) == mesh.n_points or VOID in mesh.chain_regions, "coincident points"
    assert len(mesh.quad_region) == mesh.n_quads
    assert mesh.quad_region.min() >= 0
    assert mesh.quad_region.max() < len(mesh.region_label)
    for name in ("points", "quads", "quad_region", "region_label", "chain_points"):
        assert not getattr(mesh, name).flags.writeable


def assert_convex(points: Array, quads: Array) -> None:
    """All four corners turn left: counter-clockwise, convex, of positive area, no repeated node."""
    p = points[quads]
    ahead, back = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
    turn = ahead[..., 0] * back[..., 1] - ahead[..., 1] * back[..., 0]
    bad = np.flatnonzero((turn <= 0).any(axis=1))
    assert not len(bad), f"{len(bad)} quads not convex, first at {p[bad[0]].mean(axis=0)}"


def assert_conforming(mesh: QuadMesh) -> None:
    """Every half-edge runs once, and at most one runs the other way."""
    start, end = _half_edges(mesh.quads)
    keys = start * mesh.n_points + end
    assert len(np.unique(keys)) == len(keys), "an edge has more than two quads, or two that lie on one side of it"


def assert_constraints(mesh: QuadMesh, points: Array, extent: tuple[float, float]) -> None:
    """The chains are just the edges of the rim and between regions, each with its regions left and right."""
    start, end = _half_edges(mesh.quads)
    region = dict(zip(zip(start.tolist(), end.tolist(), strict=True), np.repeat(mesh.quad_region, 4), strict=True))
    chain_edges = []
    for c, (left, right) in enumerate(mesh.chain_regions.tolist()):
        ids = mesh.chain_points[mesh.chain_offsets[c] : mesh.chain_offsets[c + 1]].tolist()
        for a, b in pairwise(ids):
            assert region.get((a, b), VOID) == left, f"left of chain {c} at {points[a]}"
            assert region.get((b, a), VOID) == right, f"right of chain {c} at {points[a]}"
            chain_edges.append((min(a, b), max(a, b)))
    assert len(set(chain_edges)) == len(chain_edges), "two chains run along one edge"
    borders = {(min(e), max(e)) for e, r in region.items() if region.get(e[::-1], VOID) != r}
    assert borders == set(chain_edges)

    on_chain = np.zeros(mesh.n_points, bool)
    on_chain[mesh.chain_points] = True
    assert np.array_equal(on_chain, mesh.point_kind != PointKind.INTERIOR)
    frame = points[mesh.point_kind == PointKind.FRAME]
    assert (np.isclose(frame, 0) | np.isclose(frame, extent)).any(axis=1).all(), "FRAME point off the border"
    assert points.min() >= 0


def assert_topology(mesh: QuadMesh, image: LabelImage) -> None:
    """The quads form a planar surface with as many parts and holes as it has rims: Euler, counted fan by fan."""
    start, end = _half_edges(mesh.quads)
    n = len(start)
    order = {(a, b): h for h, (a, b) in enumerate(zip(start.tolist(), end.tolist(), strict=True))}
    twin = np.array([order.get((b, a), -1) for a, b in zip(start.tolist(), end.tolist(), strict=True)])
    inner = np.flatnonzero(twin >= 0)
    n_fans, fan = _parts(n, inner, twin[inner] // 4 * 4 + (twin[inner] + 1) % 4)  # corners around a node
    n_parts, _ = _parts(mesh.n_quads, inner // 4, twin[inner] // 4)
    rim = np.flatnonzero(twin < 0)
    rim_fans, ends = np.unique(np.stack([fan[rim], fan[rim // 4 * 4 + (rim + 1) % 4]]), return_inverse=True)
    n_rims, _ = _parts(len(rim_fans), *ends.reshape(2, -1))
    n_edges = len(inner) // 2 + len(rim)
    assert n_fans - n_edges + mesh.n_quads == 2 * n_parts - n_rims

    solid = image.labels != VOID
    assert connected(solid, np.ones((3, 3)))[1] <= n_parts <= connected(solid)[1]
    if solid.all():
        assert n_fans == mesh.n_points
        assert (n_parts, n_rims) == (1, 1)


def assert_materials(mesh: QuadMesh, points: Array, image: LabelImage) -> None:
    """Every material of the picture, no other, where the picture has it; the area is that of the pixels."""
    solid = image.labels != VOID
    assert np.array_equal(np.unique(mesh.quad_material), np.unique(image.labels[solid]))
    if solid.all():
        assert np.isclose(quad_areas(points, mesh.quads).sum(), solid.size, rtol=1e-9)
    size = {"size": 3, "mode": "nearest"}
    away = maximum_filter(image.labels, **size) == minimum_filter(image.labels, **size)
    found = rasterise(points, mesh.quads, mesh.quad_material, image.shape)
    agree = (found == image.labels)[away]
    assert agree.all() if agree.size < 1000 else agree.mean() >= 0.999, (
        f"{np.sum(~agree)} of {agree.size} pixels differ"
    )


def rasterise(points: Array, quads: Array, values: Array, shape: tuple[int, int]) -> Array:
    """Value of the (convex, counter-clockwise) quad that holds each pixel's centre, VOID where none does."""
    rows, cols = shape
    out = np.full(shape, VOID, np.int64)
    corners = points[quads]
    first = np.maximum(np.floor(corners.min(axis=1)).astype(np.int64), 0)
    width, height = (np.minimum(np.ceil(corners.max(axis=1)).astype(np.int64), (cols, rows)) - first).T
    begins = np.arange(0, _PIXELS + (width * height).sum(), _PIXELS)
    for some in np.split(np.arange(len(quads)), np.searchsorted(np.cumsum(width * height), begins)):
        quad = np.repeat(some, (width * height)[some])
        k = np.arange(len(quad)) - np.searchsorted(quad, quad)  # number of the pixel in the box around its quad
        at = first[quad] + np.stack([k % width[quad], k // width[quad]], axis=1)
        to = (at + 0.5)[:, None] - corners[quad]
        e = np.roll(corners, -1, axis=1)[quad] - corners[quad]
        inside = (e[..., 0] * to[..., 1] - e[..., 1] * to[..., 0] >= -1e-9).all(axis=1)
        out[rows - 1 - at[inside, 1], at[inside, 0]] = values[quad[inside]]
    return out


def _half_edges(quads: Array) -> tuple[Array, Array]:
    return np.asarray(quads).ravel(), np.roll(quads, -1, axis=1).ravel()


def _parts(n: int, a: Array, b: Array) -> tuple[int, Array]:
    return connected_components(coo_array((np.ones(len(a), bool), (a, b)), shape=(n, n)), directed=False)
