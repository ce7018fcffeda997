"""EBSD maps: symmetries against published angles, grains against another program's, grids, files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from imgquad_core.errors import InputError
from imgquad_core.reading.formats import Picture, ReadOptions, read_picture
from imgquad_core.reading.grains import (
    LAUE_GROUPS,
    crystal_symmetries,
    disorientation,
    euler_angles_of,
    find_grains,
    mean_orientations,
    product,
    quaternions_of,
)
from support.files import CTF, PHASES, ang_text, ctf_text, points_of, two_halves


def random_turns(n: int, seed: int = 0) -> NDArray[np.float64]:
    turns = np.random.default_rng(seed).normal(size=(n, 4))
    return turns / np.linalg.norm(turns, axis=1, keepdims=True)


#: order of the proper part, and the largest disorientation: Grimmer 1979, doi:10.1016/0036-9748(79)90058-9
@pytest.mark.parametrize(
    ("laue", "order", "largest"),
    [("-1", 1, 180.0), ("2/m", 2, 180.0), ("mmm", 4, 120.0), ("4/m", 4, 180.0), ("4/mmm", 8, 98.42), ("-3", 3, 180.0),
     ("-3m", 6, 104.48), ("6/m", 6, 180.0), ("6/mmm", 12, 93.84), ("m-3", 12, 90.0), ("m-3m", 24, 62.80)],
)  # fmt: skip
def test_symmetries_form_groups_with_the_published_largest_angles(laue: str, order: int, largest: float) -> None:
    group = crystal_symmetries(laue)
    assert len(group) == order
    table = np.abs(product(group[:, None], group[None]) @ group.T).max(axis=-1)
    assert np.allclose(table, 1.0)  # closed
    angles = np.degrees(disorientation(random_turns(100_000), random_turns(100_000, 1), laue))
    assert angles.max() <= largest + 0.01
    assert angles.max() > largest - 3.0


def test_disorientations_of_random_cubes_have_mackenzies_mean() -> None:
    angles = np.degrees(disorientation(random_turns(300_000), random_turns(300_000, 1), "m-3m"))
    assert angles.mean() == pytest.approx(40.74, abs=0.06)  # Mackenzie 1958, doi:10.2307/2333042: 40 degrees 44 minutes


def test_twins_have_their_angle() -> None:
    sigma3 = np.array([[np.cos(np.pi / 6), *(np.sin(np.pi / 6) / np.sqrt(3) * np.ones(3))]])  # 60 degrees about <111>
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    assert np.degrees(disorientation(one, sigma3, "m-3m"))[0] == pytest.approx(60.0)
    half = np.array([[0.0, 1.0, 1.0, 1.0]]) / np.sqrt(3)  # 180 degrees about the same axis is the same twin
    assert np.degrees(disorientation(one, half, "m-3m"))[0] == pytest.approx(60.0)
    dauphine = np.array([[np.cos(np.pi / 6), 0.0, 0.0, np.sin(np.pi / 6)]])  # of quartz: 60 degrees about c
    assert np.degrees(disorientation(one, dauphine, "-3m"))[0] == pytest.approx(60.0)
    assert np.degrees(disorientation(one, dauphine, "6/mmm"))[0] == pytest.approx(0.0, abs=1e-5)


def test_two_fold_axes_of_trigonal_crystals_lie_along_b_or_along_a() -> None:
    one = np.array([[1.0, 0.0, 0.0, 0.0]])
    about_x, about_y = np.array([[0.0, 1.0, 0.0, 0.0]]), np.array([[0.0, 0.0, 1.0, 0.0]])
    for laue, same, other in (("-3m", about_y, about_x), ("-3m x", about_x, about_y)):
        assert disorientation(one, same, laue)[0] == pytest.approx(0.0, abs=1e-7)
        assert np.degrees(disorientation(one, other, laue))[0] == pytest.approx(60.0)


def test_euler_angles_go_to_quaternions_and_back_and_turn_as_bunges_matrix() -> None:
    euler = np.random.default_rng(2).random((500, 3)) * (2 * np.pi, np.pi, 2 * np.pi)
    turns = quaternions_of(euler)
    assert np.allclose(euler_angles_of(turns), euler)
    flat = np.array([[0.3, 0.0, 0.5], [0.3, np.pi, 0.5]])
    assert np.allclose(np.abs((quaternions_of(euler_angles_of(quaternions_of(flat))) * quaternions_of(flat)).sum(1)), 1)
    a, b, c = euler[0]

    def about(angle: float, axis: str) -> NDArray[np.float64]:
        s, k = np.sin(angle), np.cos(angle)
        return np.array([[k, -s, 0], [s, k, 0], [0, 0, 1]] if axis == "z" else [[1, 0, 0], [0, k, -s], [0, s, k]])

    vector = np.array([0.1, -0.7, 0.4])
    turned = product(product(turns[0], np.array([0.0, *vector])), turns[0] * (1, -1, -1, -1))[1:]
    assert np.allclose(turned, about(a, "z") @ about(b, "x") @ about(c, "z") @ vector)


def test_grains_are_joined_by_links_and_numbered_in_reading_order() -> None:
    angles = np.radians(np.array([[0, 3, 6, 20], [0, 3, 30, 20], [90, 93, 30, 1]], float))
    euler = np.stack([angles, 0 * angles, 0 * angles], axis=-1)
    phase = np.ones(angles.shape, np.int32)
    phase[2, 3] = -1
    grains = find_grains(phase, quaternions_of(euler), {1: "-1"}, 5.0)
    assert grains.tolist() == [[1, 1, 1, 2], [1, 1, 3, 2], [4, 4, 3, -1]]
    cubic = find_grains(phase, quaternions_of(euler), {1: "m-3m"}, 5.0)  # 90 degrees about a cube's axis are none
    assert cubic.tolist() == [[1, 1, 1, 2], [1, 1, 3, 2], [1, 1, 3, -1]]
    phase[0, 1] = 2
    assert find_grains(phase, quaternions_of(euler), {1: "-1", 2: "-1"}, 5.0).max() == 6


def test_the_mean_of_a_grain_does_not_mind_symmetric_twins_of_its_pixels() -> None:
    rng = np.random.default_rng(5)
    truth = random_turns(1, 7)[0]
    spread = np.concatenate([np.ones((400, 1)), 0.02 * rng.normal(size=(400, 3))], axis=1)
    spread /= np.linalg.norm(spread, axis=1, keepdims=True)
    turns = product(
        product(np.repeat(truth[None], 400, 0), spread), crystal_symmetries("m-3m")[rng.integers(0, 24, 400)]
    )
    grains = np.ones((20, 20), np.int32)
    mean = mean_orientations(grains, turns.reshape(20, 20, 4), {1: "m-3m"})[1]
    assert np.degrees(disorientation(truth[None], mean[None], "m-3m"))[0] < 0.3


# --------------------------------------------------------------------------------------------------- files


def test_an_ang_map_gives_phases_by_name_and_grains_with_orientations(tmp_path: Path) -> None:
    phase, euler = two_halves()
    points = points_of(phase, euler)
    points[5, 6] = -1.0  # confidence
    points[30, :3] = 4 * np.pi
    points[70, 7] = 0
    (tmp_path / "a.ang").write_text(ang_text(points))
    found = read_picture(tmp_path / "a.ang")
    assert found.labels
    assert found.names == {1: "Quartz", 2: "Ferrite"}
    assert found.void is not None
    assert np.flatnonzero(found.void).tolist() == [5, 30, 70]
    assert (found.values == np.where(found.void, -1, phase)).all()
    assert found.calibration.size is not None
    assert found.calibration.size.text == "0.25 um"
    grains = read_picture(tmp_path / "a.ang", ReadOptions(scalars="grains"))
    assert grains.values.max() == 3
    assert grains.names == {1: "Quartz_1", 2: "Ferrite_2", 3: "Quartz_3"}
    assert grains.crystals is not None
    assert grains.crystals[3].phase == "Quartz"
    assert np.allclose(np.radians(grains.crystals[3].euler), (1.0, 0.5, 0.2), atol=1e-4)


def test_points_in_any_order_and_a_wrong_header_give_the_same_map(tmp_path: Path) -> None:
    phase, euler = two_halves()
    points = points_of(phase, euler)
    (tmp_path / "a.ang").write_text(ang_text(np.random.default_rng(0).permutation(points), PHASES + "# XSTEP: 9\n"))
    assert (read_picture(tmp_path / "a.ang").values == phase).all()


def test_a_map_of_one_phase_counts_from_0_or_1_and_gives_grains(tmp_path: Path) -> None:
    phase, euler = two_halves()
    header = "# MaterialName  Iron (Alpha)\n# Symmetry 43\n"
    for number in (0, 1):
        (tmp_path / "a.ang").write_text(ang_text(points_of(np.full_like(phase, number), euler), header))
        found = read_picture(tmp_path / "a.ang")
        assert found.values.max() == 3
        assert found.names is not None
        assert found.names[1] == "Iron (Alpha)_1"


def test_a_hexagonal_grid_keeps_every_row_and_every_grain(tmp_path: Path) -> None:
    phase, euler = two_halves()
    euler[5, 4] = (3.0, 1.0, 0.0)  # a grain of one point
    points = points_of(phase, euler, hexagonal=True)
    points = points[~((points[:, 4] % 0.433 > 0.1) & (points[:, 3] > 4.8))]  # every second row is one shorter
    (tmp_path / "a.ang").write_text(ang_text(points).replace("SqrGrid", "HexGrid"))
    found = read_picture(tmp_path / "a.ang", ReadOptions(scalars="grains"))
    assert found.shape == (12, round(20.5 / (np.sqrt(3) / 2)))
    assert found.void is None
    assert found.values.max() == 4
    assert "hexagonal" in found.notes[0]
    areas = np.bincount(read_picture(tmp_path / "a.ang").values.ravel())[1:] / found.values.size
    assert areas[0] == pytest.approx(11 / 20, abs=0.03)


@pytest.mark.parametrize("comma", [False, True])
def test_a_ctf_map_in_degrees_with_points_or_commas(tmp_path: Path, comma: bool) -> None:
    phase, euler = two_halves()
    phase[3, 3] = 0
    (tmp_path / "a.ctf").write_bytes(ctf_text(phase, euler, comma).encode())
    found = read_picture(tmp_path / "a.ctf", ReadOptions(scalars="grains"))
    assert found.void is not None
    assert np.argwhere(found.void).tolist() == [[3, 3]]
    assert found.names == {1: "Quartz-new_1", 2: "Copper_2", 3: "Quartz-new_3"}
    assert found.crystals is not None
    assert np.allclose(np.radians(found.crystals[3].euler), (1.0, 0.5, 0.2), atol=1e-4)


def test_scattered_points_unknown_phases_and_other_texts_are_one_line_errors(tmp_path: Path) -> None:
    phase, euler = two_halves()
    points = points_of(phase, euler)
    scattered = points.copy()
    scattered[:, 3:5] = np.random.default_rng(0).random((len(points), 2)) * 9
    far = points.copy()
    far[0, 3] = 1e9
    for text, words in (
        (ang_text(scattered), "regular grid"),
        (ang_text(np.where(np.arange(8) == 7, 5, points)), "phase 5"),
        (ang_text(points).replace("0.90000", "good"), "no table of numbers"),
        (PHASES, "no points"),
        (ang_text(points[:1]), "single point"),
        (ang_text(far), "max_pixels|whole map"),
        (ang_text(np.where(np.arange(8) == 6, -1, points)), "no point of .* is indexed"),
        (ang_text(np.where(np.arange(8) == 3, np.nan, points)), "without a place"),
        ("hello", "no table"),
    ):
        (tmp_path / "a.ang").write_text(text)
        with pytest.raises(InputError, match=words) as told:
            read_picture(tmp_path / "a.ang")
        assert "\n" not in str(told.value)
    for text in ("Channel Text File\nPhases\t1\n", "x\n" + CTF, CTF, CTF.replace("Euler2", "Roll") + "1\t0\t0\n"):
        (tmp_path / "a.ctf").write_text(text)
        with pytest.raises(InputError, match=r"a\.ctf") as told:
            read_picture(tmp_path / "a.ctf")
        assert "\n" not in str(told.value)
    (tmp_path / "b.ang").write_text(ang_text(points))
    with pytest.raises(InputError, match="give phases or grains"):
        read_picture(tmp_path / "b.ang", ReadOptions(scalars="FeatureIds"))


def grains_of(path: Path) -> Picture:
    return read_picture(path, ReadOptions(scalars="grains"))


def test_samples_come_out_as_their_catalogue_says(samples: Path, images: Path) -> None:
    from PIL import Image

    steel = read_picture(samples / "sdss_ferrite_austenite.ang")
    drawn = np.asarray(Image.open(images / "steel_duplex_ebsd_phase.png"))
    assert steel.names == {1: "austenite/austenite", 2: "ferrite/ferrite"}
    assert (steel.values == drawn + 1).all()
    square, hexagonal = (grains_of(samples / f"testdata_{grid}.ctf") for grid in ("sqr", "hex"))
    truth = np.repeat(np.repeat([[1, 2], [3, 4]], 15, axis=0), 15, axis=1)  # the last two columns of the file say so
    assert (square.values == truth).all()
    counts = np.bincount(hexagonal.values.ravel())[1:]
    assert len(counts) == 4
    assert np.ptp(counts) <= 1


def test_every_laue_group_of_oxfords_numbers_is_known() -> None:
    assert len(LAUE_GROUPS) == 11
    assert [len(crystal_symmetries(laue)) for laue in LAUE_GROUPS] == [1, 2, 4, 4, 8, 3, 6, 6, 12, 12, 24]
