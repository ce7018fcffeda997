"""Results as arrays that the page draws: positions in pixels of the picture, from its upper left corner, y down."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.arrays import Floats, Labels
from imgquad_core.model import BoundaryGraph, LabelImage, Materials, QuadMesh

Arrays = Mapping[str, NDArray[Any]]
LARGEST = 4096  #: side of a texture that every WebGL 2 has
MOST_ENTRIES = 1 << 20  #: of a table by the number of the material


def packed(arrays: Arrays) -> tuple[list[dict[str, Any]], bytes]:
    """Return what stands where, and the bytes; each array begins at a multiple of four."""
    listed, parts = [], []
    for name, array in arrays.items():
        data = np.ascontiguousarray(array).tobytes()
        listed.append({"name": name, "type": array.dtype.name, "shape": list(array.shape), "bytes": len(data)})
        parts.append(data + bytes(-len(data) % 4))
    return listed, b"".join(parts)


def label_places(labels: Labels, materials: Materials) -> NDArray[Any]:
    """Return each pixel's place in the table of materials (the number behind the last: void), shrunk to a texture."""
    step = -(-max(labels.shape) // LARGEST)
    shown = labels[::step, ::step]
    n, highest = len(materials.labels), int(materials.labels.max(initial=0))
    kind = np.uint8 if n < 255 else np.uint16
    if highest > MOST_ENTRIES:
        return np.where(shown < 0, n, np.searchsorted(materials.labels, shown)).astype(kind)
    places = np.full(highest + 2, n, kind)
    places[materials.labels] = np.arange(n)
    return np.asarray(places[shown])  # void, -1, is the last entry


def material_rows(image: LabelImage, shares: Mapping[int, float], colors: Floats) -> list[dict[str, Any]]:
    """Return the table of materials, in the order of `label_places`."""
    rows = zip(image.materials.labels.tolist(), image.materials.names, np.round(colors * 255).astype(int), strict=True)
    return [
        {"number": n, "name": name, "color": "#{:02x}{:02x}{:02x}".format(*color), "share": shares[n]}
        for n, name, color in rows
    ]


class Frame:
    """Where the meshed part lies on the picture: turns its coordinates into those of the page."""

    def __init__(self, part: tuple[int, int], graph: tuple[int, int], crop: tuple[int, ...] | None) -> None:
        self._height = graph[0]
        self._scale = np.array([part[1] / graph[1], part[0] / graph[0]])
        self._corner = np.array(crop[:2] if crop else (0, 0))

    def __call__(self, points: Floats) -> NDArray[np.float32]:
        """Return points (x right, y up) as the page has them."""
        flipped = np.stack([points[:, 0], self._height - points[:, 1]], axis=1)
        return np.asarray(flipped * self._scale + self._corner, np.float32)


def pack_lines(graph: BoundaryGraph, frame: Frame) -> Arrays:
    """Return both ends of each segment, shape (n, 4)."""
    return {"lines": frame(graph.points)[graph.segments].reshape(-1, 4)}


def pack_quads(mesh: QuadMesh, jacobians: Floats, frame: Frame) -> Arrays:
    """Return corners (n, 8), scaled Jacobians, places in the table of materials and numbers of quads.

    Quads that lie together stand together, so that the page can leave out blocks of them that are not in view.
    """
    points = frame(mesh.points)
    order = np.argsort(_morton(points[mesh.quads[:, 0]]), kind="stable")
    places = np.searchsorted(mesh.materials.labels, mesh.region_label).astype(np.uint16)
    return {
        "corners": points[mesh.quads[order]].reshape(-1, 8),
        "jacobians": jacobians.astype(np.float32)[order],
        "places": places[mesh.quad_region[order]],
        "quads": order.astype(np.uint32),
    }


def _morton(points: NDArray[np.float32]) -> NDArray[np.uint16]:
    """Return the place of each point on the Z curve (Morton 1966) through 256 x 256 cells: 16 bits sort the fastest."""
    low, high = points.min(axis=0), points.max(axis=0)
    cells = ((points - low) / np.maximum(high - low, 1e-6) * 255).astype(np.uint16)
    return _spread(cells[:, 0]) | _spread(cells[:, 1]) << np.uint16(1)


def _spread(bits: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Put a zero behind each of 8 bits."""
    for shift, mask in ((4, 0x0F0F), (2, 0x3333), (1, 0x5555)):
        bits = (bits | bits << np.uint16(shift)) & np.uint16(mask)
    return bits
