"""Junctions move to where the lines of their chains meet; ends on the border slide along it.

The pixel corner that a junction starts from is up to 0.7 px off. A straight line through each of its chains, over a
few pixels beyond the stairs at the junction itself, says where it should be; it moves by at most half a pixel.
"""

from __future__ import annotations

import numpy as np

from imgquad_core.arrays import Floats
from imgquad_core.jit import kernel, verb
from imgquad_core.model import PointKind

from .curves import Curves, Ends, line_beside

_NEAR, _FAR = 1.2, 8.0  # px of arc of a chain that its line is fitted to
_PULL = 0.15  # weight of the old place against that of one line
_FARTHEST = 0.5  # px that a node moves at most
_BESIDE = 1.5  # px of arc of its chains whose room a node minds too
_ROOM = 0.35  # of the local feature size and of the shortest chain at the node, so that no two nodes can meet
_NOTCH = np.radians(205.0)  # no sector gets wider
_BORDER_WINDOWS = np.array(
    [96.0, 68.0, 48.0, 36.0, 27.0, 20.0, 15.0, 11.0]
)  # px of arc that say where a chain meets the border
_BORDER_NOISE = 0.31  # px of residual up to which they are believed
_JUNCTION = int(PointKind.JUNCTION)


def place_junctions(curves: Curves, nodes: Ends, room: Floats, shape: tuple[float, float]) -> Floats:
    """Find better places for the junctions.

    Parameters
    ----------
    curves : Curves
        The pixel boundary.
    nodes : Ends
        The ends of its chains.
    room : float64, shape (n,)
        How far each dense point may move.
    shape : tuple of float
        (n_rows, n_cols) of the picture.

    Returns
    -------
    float64, shape (n_nodes, 2)
        New place of each node; those on the border moved along it, the picture's corners not at all.
    """
    return _place(curves, nodes, room, float(shape[1]), float(shape[0]), _BORDER_WINDOWS)


@kernel
def _place(curves: Curves, nodes: Ends, room: Floats, width: float, height: float, windows: Floats) -> Floats:
    placed = nodes.place.copy()
    for v in range(len(placed)):
        if nodes.kind[v] != _JUNCTION:
            continue
        x, y = nodes.place[v, 0], nodes.place[v, 1]
        on_side, on_end = x == 0 or x == width, y == 0 or y == height
        if on_side or on_end:
            dx, dy = _slide(curves, nodes, v, 0 if on_end else 1, windows)
        else:
            dx, dy = _meet(curves, nodes, v)
        limit = _limit(curves, nodes, room, v)
        size = np.hypot(dx, dy)
        if size > limit:
            dx, dy = dx * limit / size, dy * limit / size
        if not (on_side or on_end):
            scale = _scale(curves, nodes, v, dx, dy)
            dx, dy = dx * scale, dy * scale
        placed[v, 0], placed[v, 1] = x + dx, y + dy
    return placed


@verb
def _scale(curves: Curves, nodes: Ends, v: int, dx: float, dy: float) -> float:
    """Choose the share of a shift that opens no sector to a notch in the region there."""
    widest = max(_widest_sector(curves, nodes, v, 0.0, 0.0), _NOTCH)
    for k in range(3):
        scale = 0.5**k
        if _widest_sector(curves, nodes, v, scale * dx, scale * dy) <= widest:
            return scale
    return 0.0


@verb
def _widest_sector(curves: Curves, nodes: Ends, v: int, dx: float, dy: float) -> float:
    """Widest angle between the chains of a shifted node, as they run a pixel away from it."""
    widest = 0.0
    for k in range(nodes.offsets[v], nodes.offsets[v + 1]):
        mine, next_one = _bearing(curves, nodes.sockets[k], dx, dy), 2.0 * np.pi
        for j in range(nodes.offsets[v], nodes.offsets[v + 1]):
            if j != k:
                next_one = min(next_one, (_bearing(curves, nodes.sockets[j], dx, dy) - mine) % (2.0 * np.pi))
        widest = max(widest, next_one)
    return widest


@verb
def _bearing(curves: Curves, socket: int, dx: float, dy: float) -> float:
    """Direction from the shifted end of a chain to its point a pixel away."""
    first, last = curves.offsets[socket // 2], curves.offsets[socket // 2 + 1] - 1
    end, step = (last, -1) if socket % 2 else (first, 1)
    i = end
    while first <= i + step <= last and abs(curves.arc[i] - curves.arc[end]) < 1.0:
        i += step
    return float(np.arctan2(curves.raw[i, 1] - curves.raw[end, 1] - dy, curves.raw[i, 0] - curves.raw[end, 0] - dx))


@verb
def _limit(curves: Curves, nodes: Ends, room: Floats, v: int) -> float:
    limit = np.inf
    for k in range(nodes.offsets[v], nodes.offsets[v + 1]):
        socket = nodes.sockets[k]
        c = socket // 2
        first, last = curves.offsets[c], curves.offsets[c + 1] - 1
        end, step = (last, -1) if socket % 2 else (first, 1)
        unit = curves.scale[end]
        limit = min(limit, _ROOM * curves.arc[last], _FARTHEST * unit)
        i = end
        while first <= i <= last and abs(curves.arc[i] - curves.arc[end]) <= _BESIDE * unit:
            limit = min(limit, room[i])
            i += step
    return limit


@verb
def _end(curves: Curves, socket: int) -> int:
    """Dense point of a chain at one of its ends."""
    return int(curves.offsets[socket // 2 + 1] - 1 if socket % 2 else curves.offsets[socket // 2])


@verb
def _meet(curves: Curves, nodes: Ends, v: int) -> tuple[float, float]:
    """Shift of a node to the point nearest to the lines of its chains."""
    a, b, d, p, q = _PULL, 0.0, _PULL, 0.0, 0.0
    for k in range(nodes.offsets[v], nodes.offsets[v + 1]):
        socket = nodes.sockets[k]
        end = _end(curves, socket)
        near, far = _NEAR * curves.scale[end], _FAR * curves.scale[end]
        n, x, y, tx, ty, _ = line_beside(curves, socket // 2, end, 1 - 2 * (socket % 2), near, far)
        if n < 3:
            continue
        off = tx * y - ty * x
        a, b, d = a + ty * ty, b - tx * ty, d + tx * tx
        p, q = p - ty * off, q + tx * off
    det = a * d - b * b
    return (d * p - b * q) / det, (a * q - b * p) / det


@verb
def _slide(curves: Curves, nodes: Ends, v: int, axis: int, windows: Floats) -> tuple[float, float]:
    """Shift of a node along the border, to where the lines of its inner chains meet it."""
    total, count = 0.0, 0
    for k in range(nodes.offsets[v], nodes.offsets[v + 1]):
        socket = nodes.sockets[k]
        if curves.is_frame[socket // 2]:
            continue
        for far in windows:
            c = socket // 2
            n, x, y, tx, ty, rms = line_beside(curves, c, _end(curves, socket), 1 - 2 * (socket % 2), 0.4, far)
            along, across = (tx, ty) if axis == 0 else (ty, tx)
            if n < 12 or far > curves.arc[curves.offsets[c + 1] - 1] or rms > _BORDER_NOISE or abs(across) < 0.35:
                continue
            start, height = (x, y) if axis == 0 else (y, x)
            total, count = total + start - height * along / across, count + 1
            break
    if count == 0:
        return 0.0, 0.0
    shift = total / count
    return (shift, 0.0) if axis == 0 else (0.0, shift)
