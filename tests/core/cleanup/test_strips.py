"""Large faces in strips: sewn together as they were, worked on at once, and no scar where they meet."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from imgquad_core.boundary.extraction import extract_boundaries
from imgquad_core.boundary.smoothing import SmoothingOptions, smooth_boundaries
from imgquad_core.cleanup.faces import INNER_VALENCE, FaceQuads
from imgquad_core.cleanup.irregular_nodes import CleanUp, clean_up
from imgquad_core.cleanup.options import Portions
from imgquad_core.cleanup.strips import LEFT_ALONE, in_pieces, independent_nodes, nodes_around, strips_of
from imgquad_core.measures.quality import quality_report
from imgquad_core.mesher.efforts import Tuning
from imgquad_core.mesher.meshing import mesh_boundaries
from imgquad_core.mesher.options import MeshingOptions
from imgquad_core.model import LabelImage
from support import naive
from support.faces import assert_valid_faces, grid, polygon_graph, quads_of, valences
from support.invariants import assert_valid_mesh
from support.labels import label_image, labels_of_kind, pixel_centres

Ids = np.ndarray[tuple[int], np.dtype[np.int64]]


NARROW = Portions(strip=8)


@pytest.fixture
def face() -> FaceQuads:
    """Return a hexagon of unstructured quads, wide enough for some strips of eight quads."""
    corners = [(60 + 58 * np.cos(a), 60 + 58 * np.sin(a)) for a in np.arange(6) * np.pi / 3]
    return quads_of(polygon_graph(corners, [24] * 6, (120, 120)), 2.4)


def cut(mesh: FaceQuads, shifted: bool = False) -> Ids:
    return strips_of(mesh.points, mesh.quads, NARROW, shifted=shifted)


@pytest.mark.parametrize("shifted", [False, True])
def test_strips_lie_side_by_side_and_shifted_ones_half_way_between(face: FaceQuads, shifted: bool) -> None:
    strip = cut(face, shifted)
    count = strip.max() + 1
    assert count > 4
    assert np.array_equal(np.unique(strip), np.arange(count))
    corner = face.points[face.quads[:, 0]]
    along = int(np.ptp(corner, axis=0).argmax())
    wide = np.ptp(corner[:, along]) / (count - shifted)
    for k in range(count):
        where = corner[strip == k, along] - corner[:, along].min()
        assert where.min() >= (k - 0.5 * shifted) * wide - 1e-9
        assert where.max() <= (k + 1 - 0.5 * shifted) * wide + 1e-9


def test_a_strip_has_its_seams_as_rim_and_the_sewn_face_is_as_it_was(face: FaceQuads) -> None:
    seen = np.zeros(len(face.points), np.int64)

    def look(part: FaceQuads, nodes: Ids) -> FaceQuads:
        seen[nodes] += 1
        assert np.array_equal(part.points, face.points[nodes])
        held = part.origin >= 0
        assert np.array_equal(part.origin[held], nodes[held])
        complete = np.bincount(part.quads.ravel()) == valences(face)[nodes]
        assert np.array_equal(held, ~complete | (face.origin[nodes] >= 0))
        assert np.array_equal(part.wanted[complete], face.wanted[nodes][complete])
        assert np.array_equal(part.wanted[~complete], valences(part)[~complete])
        return part

    sewn, seams = in_pieces(face, cut(face), look, 1)
    assert seen.min() == 1
    assert corners(sewn) == corners(face)
    assert set(map(tuple, sewn.points[seams].tolist())) == set(map(tuple, face.points[seen > 1].tolist()))
    assert_valid_faces(sewn)
    for name in ("origin", "wanted"):
        assert table(sewn, name) == table(face, name)


def corners(mesh: FaceQuads) -> set[tuple[tuple[float, float], ...]]:
    return {tuple(sorted(map(tuple, p))) for p in mesh.points[mesh.quads].tolist()}


def table(mesh: FaceQuads, name: str) -> dict[tuple[float, ...], int]:
    """Return a value of each node by its place."""
    return dict(zip(map(tuple, mesh.points.tolist()), getattr(mesh, name).tolist(), strict=True))


@pytest.mark.parametrize("threads", [2, 3])
def test_new_quads_are_sewn_in_and_threads_do_not_change_a_byte(face: FaceQuads, threads: int) -> None:
    def work(part: FaceQuads, _: Ids) -> FaceQuads:
        return clean_up(part, CleanUp((16, 40), 0.2, 0.6))

    (alone, seams), (together, _) = (in_pieces(face, cut(face), work, n) for n in (1, threads))
    assert all(a.tobytes() == b.tobytes() for a, b in zip(alone, together, strict=True))
    assert_valid_faces(alone)
    assert table(alone, "origin").items() >= {k: v for k, v in table(face, "origin").items() if v >= 0}.items()
    assert 0 < irregular(alone) < irregular(face)
    assert not seams[alone.origin < 0].all()
    assert naive.areas(alone.points, alone.quads).sum() == pytest.approx(
        naive.areas(face.points, face.quads).sum(), rel=1e-12
    )


def irregular(mesh: FaceQuads) -> int:
    return int(np.count_nonzero((valences(mesh) != INNER_VALENCE) & (mesh.origin < 0)))


def test_two_strips_are_worked_on_at_once(face: FaceQuads) -> None:
    meet, begun = threading.Barrier(2, timeout=20), []

    def work(part: FaceQuads, _: Ids) -> FaceQuads:
        begun.append(part)
        if len(begun) <= 2:
            meet.wait()  # breaks unless another thread comes here too
        return part

    in_pieces(face, cut(face), work, 2)


def test_what_is_left_alone_stays_as_it_is() -> None:
    mesh = grid(30, 4, 0.2)
    middle = np.abs(mesh.points[mesh.quads].mean(axis=1)[:, 0] - 15.0) < 2.0

    def flatten(part: FaceQuads, _: Ids) -> FaceQuads:
        inner = part.origin < 0
        return part._replace(points=np.where(inner[:, None], np.round(part.points), part.points))

    done, seams = in_pieces(mesh, np.where(middle, 0, LEFT_ALONE), flatten, 1)
    moved = np.array([p not in table(mesh, "origin") for p in map(tuple, done.points.tolist())])
    assert np.array_equal(np.unique(done.points[moved, 0]), [14, 15, 16])
    assert np.array_equal(np.unique(np.round(done.points[seams, 0])), [13, 17])
    assert_valid_faces(done)


def test_nodes_around_some(face: FaceQuads) -> None:
    start = np.zeros(len(face.points), bool)
    start[face.quads[100, 0]] = True
    once = np.isin(np.arange(len(start)), face.quads[np.isin(face.quads, np.flatnonzero(start)).any(axis=1)])
    twice = np.isin(np.arange(len(start)), face.quads[np.isin(face.quads, np.flatnonzero(once)).any(axis=1)])
    for rings, expected in enumerate((start, once, twice)):
        assert np.array_equal(nodes_around(face.quads, start, rings), expected)


@pytest.mark.parametrize("n_groups", [1, 2, 3])
def test_groups_of_nodes_share_no_quad(face: FaceQuads, n_groups: int) -> None:
    groups, seams = independent_nodes(cut(face), face.quads, len(face.points), n_groups)
    assert len(groups) == n_groups
    assert np.array_equal(sum(group.astype(int) for group in groups) + seams, np.ones(len(seams)))
    for group in groups:
        mine = group[face.quads].any(axis=1)
        assert mine.any()
        assert (group | seams)[face.quads[mine]].all()


@pytest.fixture(scope="module")
def matrix() -> LabelImage:
    """Return a matrix with discs that do not meet."""
    n, draw = 620, np.random.default_rng(3)
    x, y = pixel_centres(n, n)
    labels, placed = np.zeros((n, n), np.int32), np.empty((0, 3))
    while len(placed) < 45:
        r = draw.uniform(8, 22)
        u, v = draw.uniform(r + 5, n - r - 5, 2)
        if (np.hypot(placed[:, 0] - u, placed[:, 1] - v) > placed[:, 2] + r + 8).all():
            placed = np.vstack([placed, [u, v, r]])
            labels[np.hypot(x - u, y - v) < r] = 1 + len(placed) % 3
    return label_image(labels)


def test_a_matrix_in_pieces_has_no_scar(matrix: LabelImage) -> None:
    graph = smooth_boundaries(extract_boundaries(matrix), SmoothingOptions(size=2.0))
    options = MeshingOptions(size=2.0)
    one, two = (mesh_boundaries(graph, replace(options, threads=n)) for n in (1, 2))
    assert one.points.tobytes() == two.points.tobytes()
    assert one.quads.tobytes() == two.quads.tobytes()
    assert_valid_mesh(one, matrix)
    whole = mesh_boundaries(graph, replace(options, tuning=Tuning(portions=Portions(largest=10**9))))
    assert whole.quads.tobytes() != one.quads.tobytes()
    ours, theirs = quality_report(one), quality_report(whole)
    assert ours.irregular < 1.08 * theirs.irregular
    assert ours.mean_sj > theirs.mean_sj - 0.0005
    assert ours.min_sj > theirs.min_sj - 0.05
    assert ours.sj_1_percent > theirs.sj_1_percent - 0.01


@pytest.mark.parametrize("kind", ["noise", "checkerboard", "speckled", "void"])
def test_narrow_strips_leave_any_picture_valid(kind: str) -> None:
    narrow = Tuning(portions=Portions(largest=30, strip=4))
    image = label_image(labels_of_kind(kind, 24, 28, 3, 7))
    graph = smooth_boundaries(extract_boundaries(image), SmoothingOptions(size=1.0))
    assert_valid_mesh(mesh_boundaries(graph, MeshingOptions(size=1.0, tuning=narrow), image.materials), image)
