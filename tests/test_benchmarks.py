"""What the tables of docs/benchmarks.md rest on: Gmsh gets our boundaries, and figures are put where they belong."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
import pytest

from figure_tables import Limit, replaced
from gmsh_routes import ROUTES, coarse_curves, gmsh_mesh
from growth import exponent
from imgquad_core import MeshOptions, QuadMesh, mesh_image
from imgquad_core.measures.quality import quad_areas
from rocks import MINERALS, rock, uniform
from run import PARTS
from support import ROOT, naive
from support.labels import voronoi


def length(mesh: QuadMesh) -> float:
    return float(naive.lengths(mesh.points, mesh.constraints).sum())


@pytest.mark.parametrize("route", ROUTES)
def test_gmsh_fills_our_boundaries_with_quads(route: str) -> None:
    pytest.importorskip("gmsh")
    ours = mesh_image(voronoi(60, 80, 9, seed=3), MeshOptions(size=4.0))
    made = gmsh_mesh(ours, route)
    assert made.not_quads == 0
    assert made.seconds > 0
    assert quad_areas(made.mesh.points, made.mesh.quads).sum() == pytest.approx(60 * 80)
    # chords of every second point are a little shorter than the boundary
    assert 0.98 * length(ours) < length(made.mesh) <= length(ours) + 1e-9
    assert 0.7 * ours.n_quads < made.mesh.n_quads < 1.6 * ours.n_quads


def curves(*chains: list[int]) -> list[list[int]]:
    mesh = mesh_image(np.zeros((4, 4), np.int32))
    offsets = np.cumsum([0, *map(len, chains)])
    flat = np.concatenate([np.array(c) for c in chains])
    return [c.tolist() for c in coarse_curves(replace(mesh, chain_offsets=offsets, chain_points=flat))]


def test_gmsh_gets_every_second_point() -> None:
    assert curves([0, 1, 2, 3, 4], [4, 5, 0], [6, 7, 8, 9, 10, 11, 6]) == [[0, 2, 4], [4, 0], [6, 8, 10, 6]]


def test_gmsh_gets_all_points_of_a_curve_that_would_vanish_or_lie_on_another() -> None:
    assert curves([0, 1, 2, 3, 0]) == [[0, 1, 2, 3, 0]]
    assert curves([0, 1, 2], [2, 3, 0]) == [[0, 1, 2], [2, 3, 0]]


def test_limits_are_told_as_met_only_if_they_are() -> None:
    assert Limit("x", 1.0, at_most=True).row("here", 1.1, "{:.1f}")[-1] == "**no**"
    assert Limit("x", 1.0, at_most=False).row("here", 1.1, "{:.1f}")[-1] == "yes"


def test_exponent_of_a_power_is_its_exponent() -> None:
    quads = np.array([1e3, 1e4, 1e6])
    assert exponent(quads, 3e-6 * quads**1.07) == pytest.approx(1.07)


def test_the_page_has_a_place_for_each_part() -> None:
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    for part in PARTS:
        before, after = (replaced(page, part, text) for text in ("one", "other"))
        assert "\none\n" in before
        assert before.replace("\none\n", "\nother\n") == after
    with pytest.raises(SystemExit, match="begin: speed"):
        replaced("nothing", "speed", "text")
    sizes = (ROOT / "docs" / "sizes.md").read_text(encoding="utf-8")
    assert all("\none\n" in replaced(sizes, part, "one") for part in ("bars", "coast", "kept", "judged"))


def test_the_rocks_are_those_that_were_measured() -> None:
    assert zlib.crc32(rock(1024, 48, 0, 0.0, 11).tobytes()) == 1056158398  # B1
    assert zlib.crc32(rock(256, 48, 4, 0.05, 11).tobytes()) == 747899585


def test_rocks_have_veins_and_noise_as_asked() -> None:
    plain, veined, noisy = rock(300, 30, 0, 0.0, 5), rock(300, 30, 3, 0.0, 5), rock(300, 30, 3, 0.1, 5)
    assert set(np.unique(plain)) == set(range(MINERALS))
    changed = plain != veined
    assert (veined[changed] == MINERALS).all()
    assert 2 * 300 < changed.sum() < 8 * 300
    assert (noisy != veined).mean() == pytest.approx(0.1, abs=0.01)
    assert uniform(1, 10_000).mean() == pytest.approx(0.5, abs=0.02)
