"""The values that the stages take and give: frozen, with read-only arrays.

Coordinates are float64 (x right, y up, in pixels): pixel (row, column) of a picture with `n_rows` rows covers
``[column, column + 1] x [n_rows - row - 1, n_rows - row]``. Ids are int64, labels int32, -1 stands for none.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .arrays import Bytes, Floats, Ints, Labels, Value
from .frozen import FrozenMapping

VOID = -1  #: label of a pixel, or region beside a chain, that is not meshed


class PointKind(IntEnum):
    """What a point may do when nodes move."""

    FREE = 0  #: inside a chain: slides along it
    JUNCTION = 1  #: where three or more chains meet: stays
    FRAME = 2  #: on the picture's border, inside a chain: slides along the border
    CORNER = 3  #: a corner of the picture or a sharp corner of a chain: stays
    INTERIOR = 4  #: of a mesh only, on no chain: moves freely
    HELD = 5  #: inside a chain that somebody else meshes up to, too: stays, and its edges are not cut
    SEAM = 6  #: the same, of a chain that will be gone: poor elements there are mended then


@dataclass(frozen=True, eq=False)
class Materials(Value):
    """What the picture called its materials.

    Parameters
    ----------
    labels : array_like of int32, shape (n,)
        The number of each material, ascending.
    names : tuple of str
        Name of each material, in the order of `labels`.
    colors : array_like of uint8, shape (n, 3)
        RGB of each material, in the order of `labels`.
    phases : tuple of str, optional
        Phase of each material that is a grain, in the order of `labels`; empty for others.
    orientations : array_like of float64, shape (n, 3), optional
        Bunge's Euler angles (phi1, Phi, phi2) of each grain's crystal, degrees; NaN where unknown.
    """

    labels: Labels
    names: tuple[str, ...]
    colors: Bytes
    phases: tuple[str, ...] | None = None
    orientations: Floats | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "colors", np.reshape(self.colors, (-1, 3)))
        super().__post_init__()

    def name_of(self, label: int) -> str:
        """Name of material number `label`."""
        at = int(np.searchsorted(self.labels, label))
        return self.names[at] if at < len(self.labels) and self.labels[at] == label else f"material {label}"


@dataclass(frozen=True, eq=False)
class LabelImage(Value):
    """A picture in which every pixel has one material.

    Parameters
    ----------
    labels : array_like of int32, shape (n_rows, n_cols)
        Material of each pixel, row 0 on top; `VOID` where there is none.
    materials : Materials
        Number, name and colour of each material that occurs (and perhaps of more).
    """

    labels: Labels
    materials: Materials

    @property
    def shape(self) -> tuple[int, int]:
        """(n_rows, n_cols)."""
        return self.labels.shape[0], self.labels.shape[1]

    @cached_property
    def pixels(self) -> Mapping[int, int]:
        """Number of pixels of each material that occurs, ascending by the material's number."""
        numbers, counts = _counted(self.labels)
        return FrozenMapping({int(n): int(count) for n, count in zip(numbers, counts, strict=True) if n != VOID})


def _counted(labels: Labels) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return the numbers that occur, ascending, and how often each does: by sorting only where they lie far apart."""
    low, high = (int(labels.min()), int(labels.max())) if labels.size else (0, 0)
    if high - low > 1 << 20:
        return np.unique(labels, return_counts=True)
    counts = np.bincount((labels - low).ravel())
    present = np.flatnonzero(counts)
    return present + low, counts[present]


class Chains(NamedTuple):
    """Polylines of boundaries, as they are handed on: see `BoundaryGraph`."""

    offsets: Ints  #: (n_chains + 1,) chain c has the points ``points[offsets[c]:offsets[c + 1]]``
    points: Ints  #: ids
    regions: Ints  #: (n_chains, 2) region on the left and on the right


@dataclass(frozen=True, eq=False)
class BoundaryGraph(Value):
    """Boundaries between all colours: chains of points from junction to junction.

    Parameters
    ----------
    points : float64, shape (n_points, 2)
        x right, y up, in pixels.
    point_kind : uint8, shape (n_points,)
        A `PointKind` each (never INTERIOR).
    chain_offsets : int64, shape (n_chains + 1,)
        Chain c has the points ``chain_points[chain_offsets[c]:chain_offsets[c + 1]]``.
    chain_points : int64
        Ids of points; a closed chain repeats its first point at its end.
    chain_regions : int64, shape (n_chains, 2)
        Region on the left and on the right of each chain, seen along it; `VOID` for none.
    region_label : int32, shape (n_regions,)
        Material of each region (connected, of one colour).
    region_pixels : int64, shape (n_regions,)
        Pixels of each region in the picture: the area that smoothing keeps.
    shape : tuple of int
        (n_rows, n_cols) of the picture; fractions of a data point while boundaries are smoothed.

    Notes
    -----
    `extract_boundaries` gives the pixel boundary. `smooth_boundaries` gives the boundary that is meshed: then
    every chain has an EVEN number of segments as long as the final edges, and the points at even places of a chain
    (the coarse nodes) form a planar graph by themselves, as do all points.
    """

    points: Floats
    point_kind: Bytes
    chain_offsets: Ints
    chain_points: Ints
    chain_regions: Ints
    region_label: Labels
    region_pixels: Ints
    shape: tuple[int, int]

    @property
    def n_chains(self) -> int:
        """Number of chains."""
        return len(self.chain_offsets) - 1

    @property
    def chains(self) -> Chains:
        """All chains in one value."""
        return Chains(self.chain_offsets, self.chain_points, self.chain_regions)

    def chain(self, c: int) -> Ints:
        """Ids of the points of chain `c`, in order."""
        return self.chain_points[self.chain_offsets[c] : self.chain_offsets[c + 1]]

    @cached_property
    def segments(self) -> Ints:
        """All segments of all chains as point ids, shape (n_segments, 2), chain by chain."""
        return chain_segments(self.chain_offsets, self.chain_points)


@dataclass(frozen=True, eq=False)
class QuadMesh(Value):
    """An all-quadrilateral mesh of several materials.

    Parameters
    ----------
    points : float64, shape (n_points, 2)
        x right, y up, in pixels (or in the user's unit after `scaled`).
    point_kind : uint8, shape (n_points,)
        A `PointKind` each.
    quads : int64, shape (n_quads, 4)
        Ids of the corners of each quad, counter-clockwise.
    quad_region : int64, shape (n_quads,)
        Region of each quad.
    region_label : int32, shape (n_regions,)
        Material of each region.
    chain_offsets, chain_points, chain_regions
        The chains of the boundaries, as in `BoundaryGraph`, in ids of this mesh's points.
    materials : Materials
        Number, name and colour of the materials.
    """

    points: Floats
    point_kind: Bytes
    quads: Ints
    quad_region: Ints
    region_label: Labels
    chain_offsets: Ints
    chain_points: Ints
    chain_regions: Ints
    materials: Materials

    @property
    def n_points(self) -> int:
        """Number of points."""
        return len(self.points)

    @property
    def n_quads(self) -> int:
        """Number of quads."""
        return len(self.quads)

    @property
    def chains(self) -> Chains:
        """All chains in one value."""
        return Chains(self.chain_offsets, self.chain_points, self.chain_regions)

    @cached_property
    def quad_material(self) -> Labels:
        """Material of each quad, int32, shape (n_quads,)."""
        return self.region_label[self.quad_region]

    @cached_property
    def constraints(self) -> Ints:
        """Edges that lie on a chain, shape (n, 2), chain by chain."""
        return chain_segments(self.chain_offsets, self.chain_points)

    @cached_property
    def valence(self) -> Ints:
        """Number of quads at each point."""
        return np.bincount(self.quads.ravel(), minlength=self.n_points)

    def scaled(self, factor: float | tuple[float, float]) -> QuadMesh:
        """Return the same mesh with all coordinates times `factor`, or x and y each times its own."""
        return replace(self, points=self.points * factor)

    def moved(self, by: tuple[float, float]) -> QuadMesh:
        """Return the same mesh moved by x and y."""
        return replace(self, points=self.points + by)


def chain_segments(offsets: Ints, points: Ints) -> Ints:
    """Return consecutive pairs of points within each chain, shape (n, 2)."""
    pairs: Ints = np.stack([points[:-1], points[1:]], axis=1)
    inside = np.ones(max(len(points) - 1, 0), bool)
    inside[offsets[1:-1] - 1] = False
    return np.ascontiguousarray(pairs[inside])
