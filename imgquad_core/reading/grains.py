"""Grains of an EBSD map: pixels of one phase joined where their crystals are turned by less than a threshold.

Orientations are unit quaternions (w, x, y, z) that turn crystal axes to sample axes; Euler angles are Bunge's
(phi1 about z, Phi about the new x, phi2 about the new z). Crystal axes are those of the instruments' files: z along c,
and y along b (Oxford: x normal to b and c) or, for trigonal crystals of EDAX, x along a.

References: Bunge, Texture Analysis in Materials Science (1982), doi:10.1016/C2013-0-11769-2; Markley et al., Averaging
Quaternions (2007), doi:10.2514/1.28949; Bachmann, Hielscher and Schaeben, Grain detection from 2d and 3d EBSD data
(2011), doi:10.1016/j.ultramic.2011.08.002.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from math import cos, pi, sin, sqrt

import numpy as np

from imgquad_core.arrays import Flags, Floats, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.grouping import linked

#: about this many pairs of pixels are compared at once (24 symmetries of 8 bytes each: 25 MB)
AT_ONCE = 1 << 17
#: angle between two pixels (degrees) from which they belong to two grains, if nothing else is asked for
THRESHOLD = 5.0

_X, _Y, _Z, _DIAGONAL = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)
#: rotations that generate the proper part of each Laue group: (axis, fold)
_GENERATORS: Mapping[str, tuple[tuple[tuple[float, float, float], int], ...]] = {
    "-1": (),
    "2/m": ((_Y, 2),),
    "mmm": ((_Z, 2), (_X, 2)),
    "4/m": ((_Z, 4),),
    "4/mmm": ((_Z, 4), (_X, 2)),
    "-3": ((_Z, 3),),
    "-3m": ((_Z, 3), (_Y, 2)),
    "-3m x": ((_Z, 3), (_X, 2)),
    "6/m": ((_Z, 6),),
    "6/mmm": ((_Z, 6), (_X, 2)),
    "m-3": ((_Z, 2), (_DIAGONAL, 3)),
    "m-3m": ((_Z, 4), (_DIAGONAL, 3)),
}
#: the Laue groups in the order of their numbers in the files of Oxford Instruments, from 1 on
LAUE_GROUPS = ("-1", "2/m", "mmm", "4/m", "4/mmm", "-3", "-3m", "6/m", "6/mmm", "m-3", "m-3m")


@cache
def crystal_symmetries(laue: str) -> Floats:
    """Return the rotations that leave a crystal as it is.

    Parameters
    ----------
    laue : str
        One of `LAUE_GROUPS`; the two-fold axis of 2/m and those of -3m lie along y (b), of "-3m x" along x (a).

    Returns
    -------
    float64, shape (n, 4)
        Quaternions, one of each pair of opposite ones; the first is (1, 0, 0, 0).
    """
    if laue not in _GENERATORS:
        raise InputError(f"Laue group '{laue}' is unknown: give one of {', '.join(LAUE_GROUPS)}")
    found = np.array([[1.0, 0.0, 0.0, 0.0]])
    generators = [_turn(axis, 2.0 * pi / fold) for axis, fold in _GENERATORS[laue]]
    n = 0
    while len(found) > n:  # until products give nothing new
        n = len(found)
        for turn in generators:
            found = _distinct(np.concatenate([found, product(found, turn)]))
    found.flags.writeable = False
    return found


def _turn(axis: tuple[float, float, float], angle: float) -> Floats:
    length = sqrt(sum(part * part for part in axis))
    return np.array([cos(angle / 2.0), *(sin(angle / 2.0) * part / length for part in axis)])


def _distinct(turns: Floats) -> Floats:
    kept: list[Floats] = []
    for turn in turns:
        if all(abs(float(turn @ other)) < 1.0 - 1e-9 for other in kept):
            kept.append(turn)
    return np.array(kept)


def product(first: Floats, second: Floats) -> Floats:
    """Return the quaternions that turn by `second`, then by `first`; shapes (..., 4) that broadcast."""
    a, b, c, d = np.moveaxis(first, -1, 0)
    w, x, y, z = np.moveaxis(second, -1, 0)
    parts = (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )
    return np.stack(parts, axis=-1)


def quaternions_of(euler: Floats) -> Floats:
    """Return the quaternions, shape (..., 4), of Bunge's Euler angles in radians, shape (..., 3)."""
    first, middle, last = np.moveaxis(np.asarray(euler, float), -1, 0)
    c, s = np.cos(middle / 2.0), np.sin(middle / 2.0)
    total, difference = (first + last) / 2.0, (first - last) / 2.0
    return np.stack([c * np.cos(total), s * np.cos(difference), s * np.sin(difference), c * np.sin(total)], axis=-1)


def euler_angles_of(quaternions: Floats) -> Floats:
    """Return Bunge's Euler angles in radians, shape (..., 3), of quaternions: phi1 and phi2 in [0, 2 pi)."""
    w, x, y, z = np.moveaxis(quaternions, -1, 0)
    total, difference = np.arctan2(z, w), np.arctan2(y, x)
    along, across = np.hypot(w, z), np.hypot(x, y)
    # where Phi is 0 or pi, only the sum or the difference counts: all of it is given to phi1
    difference = np.where(across < 1e-12, total, difference)
    total = np.where(along < 1e-12, difference, total)
    angles = np.stack([total + difference, 2.0 * np.arctan2(across, along), total - difference], axis=-1)
    angles[..., ::2] %= 2.0 * pi
    return np.asarray(angles, float)


def disorientation(first: Floats, second: Floats, laue: str) -> Floats:
    """Return the least angle, radians, that turns crystals of one orientation to those of another.

    Parameters
    ----------
    first, second : float64, shape (n, 4)
        Quaternions.
    laue : str
        Laue group of both.

    Notes
    -----
    The misorientation is m = first^-1 second. All its symmetric equivalents are s m t with s, t of the crystal; the
    angle of s m t is that of m t s, so that one pass over the group finds the least: 2 arccos of max |<m, t>|.
    """
    between = product(first * (1.0, -1.0, -1.0, -1.0), second)
    nearest = np.abs(between @ crystal_symmetries(laue).T).max(axis=-1)
    return np.asarray(2.0 * np.arccos(np.minimum(nearest, 1.0)))


def find_grains(phase: Labels, quaternions: Floats, laue: Mapping[int, str], threshold: float = THRESHOLD) -> Labels:
    """Number the grains of a map.

    Parameters
    ----------
    phase : int32, shape (n_rows, n_cols)
        Phase of each pixel, below 0 where there is none.
    quaternions : float64, shape (n_rows, n_cols, 4)
        Orientation of each pixel.
    laue : mapping of int to str
        Laue group of each phase.
    threshold : float
        Neighbours (4) of one phase belong to one grain if their disorientation is no more than this, degrees.

    Returns
    -------
    int32, shape (n_rows, n_cols)
        1, 2, ... in the order of their first pixels, row by row; -1 where there is no phase.
    """
    if not 0.0 < threshold <= 180.0:
        raise InputError(f"grain-angle is {threshold}: give degrees above 0, up to 180")
    links = _links(phase, quaternions, laue, threshold * pi / 180.0)
    part, _ = linked(links[:, 0], links[:, 1], phase.size)
    return _in_reading_order(part.astype(np.int32).reshape(phase.shape), phase >= 0)


def _links(phase: Labels, quaternions: Floats, laue: Mapping[int, str], threshold: float) -> Ints:
    """Return the pairs of neighbours, flat places, shape (n, 2), that belong to one grain."""
    places = np.arange(phase.size).reshape(phase.shape)
    across = np.stack([places[:, :-1].ravel(), places[:, 1:].ravel()], axis=1)
    down = np.stack([places[:-1].ravel(), places[1:].ravel()], axis=1)
    pairs = np.concatenate([across, down])
    flat = phase.ravel()
    pairs = pairs[(flat[pairs[:, 0]] == flat[pairs[:, 1]]) & (flat[pairs[:, 0]] >= 0)]
    turns = quaternions.reshape(-1, 4)
    near = np.zeros(len(pairs), np.bool_)
    for number in np.unique(flat[pairs[:, 0]]):
        those = np.flatnonzero(flat[pairs[:, 0]] == number)
        for start in range(0, len(those), AT_ONCE):
            some = those[start : start + AT_ONCE]
            angle = disorientation(turns[pairs[some, 0]], turns[pairs[some, 1]], laue[int(number)])
            near[some] = angle <= threshold
    return np.asarray(pairs[near])


def _in_reading_order(part: Labels, inside: Flags) -> Labels:
    values, first, where = np.unique(part[inside], return_index=True, return_inverse=True)
    number = np.empty(len(values), np.int32)
    number[np.argsort(first)] = np.arange(1, len(values) + 1)
    grains = np.full(part.shape, -1, np.int32)
    grains[inside] = number[where]
    return grains


def mean_orientations(grains: Labels, quaternions: Floats, laue_of: Mapping[int, str]) -> dict[int, Floats]:
    """Return the mean orientation of each grain, a quaternion.

    Parameters
    ----------
    grains : int32, shape (n_rows, n_cols)
        Grain of each pixel.
    quaternions : float64, shape (n_rows, n_cols, 4)
        Orientation of each pixel.
    laue_of : mapping of int to str
        Laue group of each grain; others are left out.

    Notes
    -----
    Each pixel takes the symmetric equivalent nearest to the mean before (at first, to the grain's first pixel); the
    mean is the largest eigenvector of the sum of q q^T (Markley et al.). Twice is enough for grains of a few degrees.
    """
    order = np.argsort(grains.ravel(), kind="stable")
    numbers, starts = np.unique(grains.ravel()[order], return_index=True)
    turns = quaternions.reshape(-1, 4)
    parts = zip(numbers.tolist(), np.split(order, starts[1:]), strict=True)
    return {number: _mean(turns[pixels], laue_of[number]) for number, pixels in parts if number in laue_of}


def _mean(turns: Floats, laue: str) -> Floats:
    mean = turns[0]
    for _ in range(2):
        alike = _nearest(turns, mean, laue)
        mean = np.linalg.eigh(np.einsum("ij,ik->jk", alike, alike))[1][:, -1]
    return np.asarray(mean * (-1.0 if mean[np.argmax(np.abs(mean))] < 0 else 1.0))


def _nearest(turns: Floats, reference: Floats, laue: str) -> Floats:
    """Return the symmetric equivalent of each orientation that is nearest to a reference."""
    # <q s, r> = <s, q^-1 r>
    symmetries = crystal_symmetries(laue)
    between = product(turns * (1.0, -1.0, -1.0, -1.0), reference)
    best = np.abs(between @ symmetries.T).argmax(axis=1)
    return product(turns, symmetries[best])
