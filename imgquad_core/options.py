"""All options of a run in one flat value, and each stage's own options out of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Any, Literal

from .boundary import DIRECTIONS, ExtractionOptions, SmoothingOptions
from .errors import InputError
from .mesher import EFFORTS, MeshingOptions
from .model import Materials
from .picture import Box, DenoiseOptions, ReadOptions, SegmentationOptions, automatic_limits, material_number


@dataclass(frozen=True)
class MeshOptions:
    """How a picture is meshed. Lengths are in pixels.

    Parameters
    ----------
    size : float
        Length of the final edges.
    boundary_size : float, optional
        The same on boundaries; `size` by default.
    material_sizes : mapping of (str or int) to float
        The same in single materials, by name or number.
    growth : float
        Largest ratio of the sizes of neighbouring elements.
    colors : "auto", "exact", int or sequence of RGB
        How colours become materials; see `SegmentationOptions`.
    min_pixels : "auto" or int
        Clusters of fewer pixels are noise if they are also shorter than `min_length`.
    min_length : "auto" or float
        Characteristic length of the shortest cluster that stays. `auto` leaves exact label pictures as they are.
    policy : str
        Which pair is joined at an ambiguous corner of four pixels; see `ExtractionOptions`.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float
        How far smoothing moves a boundary at most.
    pixel_size : float
        Length of a pixel in the unit of the mesh.
    drop : sequence of str or int
        Materials that are left out: their boundary becomes a free border.
    drop_transparent : bool
        Whether pixels of alpha 0 are left out too.
    crop : tuple of int, optional
        Left, upper, right, lower bound of the part that is meshed, from the picture's upper left corner.
    frame : int, optional
        Which picture of a stack, counted from 0.
    periodic : "none", "x", "y" or "xy"
        Opposite sides get nodes at the same places, for a periodic cell; see `match_opposite_sides`.
    max_pixels : int
        Larger pictures are refused.
    effort : "fast", "normal" or "best"
        How far the mesh is optimised.
    threads : int
        Number of threads of the meshing stage; the mesh does not depend on it.
    triangulator : "auto", "triangle" or "cdt"
        Who makes the Delaunay triangles that quads come from; `auto` is Triangle where it is installed, else CDT.
    """

    size: float = 4.0
    boundary_size: float | None = None
    material_sizes: Mapping[str | int, float] = field(default_factory=lambda: MappingProxyType({}))
    growth: float = 1.3
    colors: Any = "auto"
    min_pixels: int | Literal["auto"] = "auto"
    min_length: float | Literal["auto"] = "auto"
    policy: str = "minority"
    edge_ratio: float = 1.2
    max_shift: float = 1.0
    pixel_size: float = 1.0
    drop: tuple[str | int, ...] = ()
    drop_transparent: bool = False
    crop: Box | None = None
    periodic: str = "none"
    frame: int | None = None
    max_pixels: int = ReadOptions.max_pixels
    effort: str = "normal"
    threads: int = 1
    triangulator: str = "auto"

    def __post_init__(self) -> None:
        if not (isfinite(self.pixel_size) and self.pixel_size > 0):
            raise InputError(f"pixel_size is {self.pixel_size}: give a length above 0")
        if self.periodic not in ("none", *DIRECTIONS):
            raise InputError(f"periodic is '{self.periodic}': give none, x, y or xy")
        # each stage checks its own options: now, not after minutes of work
        self.meshing(None)
        self.smoothing(None)
        self.segmentation()
        self.noise(True, (1, 1))
        ReadOptions(self.max_pixels, self.frame)
        ExtractionOptions(self.policy)

    def segmentation(self) -> SegmentationOptions:
        """Return the options of segmentation."""
        return SegmentationOptions(colors=self.colors, drop_transparent=self.drop_transparent)

    def noise(self, quantised: bool, shape: tuple[int, int]) -> DenoiseOptions:
        """Return the limits of noise in a picture of `shape`."""
        auto = automatic_limits(quantised, shape)
        asked = (self.min_pixels, self.min_length)
        if asked != ("auto", "auto") and "auto" in asked and not auto.removes:
            auto = automatic_limits(True, shape)  # one limit asked for switches noise removal on
        return DenoiseOptions(
            min_pixels=auto.min_pixels if self.min_pixels == "auto" else self.min_pixels,
            min_length=auto.min_length if self.min_length == "auto" else self.min_length,
            policy=self.policy,
        )

    def smoothing(self, materials: Materials | None) -> SmoothingOptions:
        """Return the options of smoothing."""
        return SmoothingOptions(
            size=self.size,
            boundary_size=self.boundary_size,
            growth=self.growth,
            edge_ratio=self.edge_ratio,
            max_shift=self.max_shift,
            material_sizes=self._sizes(materials),
            in_twelves=EFFORTS[self.effort].in_nine,
        )

    def meshing(self, materials: Materials | None) -> MeshingOptions:
        """Return the options of meshing."""
        return MeshingOptions(
            size=self.size,
            growth=self.growth,
            material_sizes=self._sizes(materials),
            effort=self.effort,
            threads=self.threads,
            triangulator=self.triangulator,
        )

    def _sizes(self, materials: Materials | None) -> dict[int, float]:
        if materials is None:  # only the values are checked
            return dict(enumerate(self.material_sizes.values()))
        return {material_number(materials, name): size for name, size in self.material_sizes.items()}
