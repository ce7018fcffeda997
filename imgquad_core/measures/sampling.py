"""Values of a picture on the quads of a mesh: means by area, exact for pixels of constant value."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Floats, Ints
from imgquad_core.jit import kernel, verb


def area_means(values: NDArray[np.generic], points: Floats, quads: Ints) -> Floats:
    """Return the mean of a picture over each quad.

    Parameters
    ----------
    values : array_like, shape (n_rows, n_cols) or (n_rows, n_cols, n_channels)
        The picture, row 0 on top.
    points : float64, shape (n, 2)
        x right, y up, in pixels, within the picture.
    quads : int64, shape (m, 4)
        Corners of each quad, of positive area.

    Returns
    -------
    float64, shape (m,) or (m, n_channels)
        Integral of the picture over each quad by the quad's area.

    Notes
    -----
    Green's theorem: the integral of f over a polygon is that of F dy around it, where F(x, y) is the integral of f
    from the left up to x. F is a running sum in each row of pixels and linear within a pixel, so that edges cut at
    pixel sides need its mean between their ends only.
    """
    picture = np.asarray(values, np.float64)
    upright = picture[::-1].reshape(*picture.shape[:2], -1)
    sums = np.zeros((upright.shape[0], upright.shape[1] + 1, upright.shape[2]))
    np.cumsum(upright, axis=1, out=sums[:, 1:])
    means = _means(sums, np.array(points, np.float64), np.array(quads, np.int64))
    return means[:, 0] if picture.ndim == 2 else means


@kernel
def _means(sums: Floats, points: Floats, quads: Ints) -> Floats:
    n_channels = sums.shape[2]
    means = np.zeros((len(quads), n_channels))
    for q in range(len(quads)):
        area = 0.0
        for k in range(4):
            a, b = quads[q, k], quads[q, (k + 1) & 3]
            area += 0.5 * (points[a, 0] * points[b, 1] - points[b, 0] * points[a, 1])
            _add_edge(sums, points[a, 0], points[a, 1], points[b, 0], points[b, 1], means[q])
        for c in range(n_channels):
            means[q, c] /= area
    return means


@verb
def _add_edge(sums: Floats, ax: float, ay: float, bx: float, by: float, total: Floats) -> None:
    """Add the integral of F dy from a to b, cut at the sides of pixels."""
    n_rows, n_cols = sums.shape[0], sums.shape[1] - 1
    dx, dy = bx - ax, by - ay
    t = 0.0
    while t < 1.0:
        # the next side that the edge crosses, in x and in y
        x, y = ax + t * dx, ay + t * dy
        next_t = min(1.0, min(_crossing(ax, dx, x, t), _crossing(ay, dy, y, t)))
        half = 0.5 * (t + next_t)
        row = min(max(int(np.floor(ay + half * dy)), 0), n_rows - 1)
        # F is linear between the two cuts: its mean is its value halfway
        middle = min(max(ax + half * dx, 0.0), float(n_cols))
        column = min(int(middle), n_cols - 1)
        share = middle - column
        for c in range(sums.shape[2]):
            value = (1.0 - share) * sums[row, column, c] + share * sums[row, column + 1, c]
            total[c] += value * dy * (next_t - t)
        t = next_t


@kernel
def _crossing(start: float, step: float, here: float, t: float) -> float:
    """Parameter at which ``start + t * step`` next meets a whole number, after `t`."""
    if step == 0.0:
        return 2.0
    side = np.floor(here + 1e-12) + 1.0 if step > 0.0 else np.ceil(here - 1e-12) - 1.0
    return float(max((side - start) / step, t + 1e-12))
