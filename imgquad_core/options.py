"""All options of a run in one flat value, and each stage's own options out of it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal

from . import picture
from .boundary import ExtractionOptions, SmoothingOptions
from .declared import check, option, same_as
from .errors import InputError
from .frozen import FrozenMapping
from .mesher import EFFORTS, MeshingOptions
from .picture import AbsorbOptions, DenoiseOptions, EditOptions, SegmentationOptions
from .reading import Calibration, ReadOptions, asked_placement, assert_placement

if TYPE_CHECKING:
    from .model import Materials
    from .picture import Box


@dataclass(frozen=True)
class MeshOptions:
    """How a picture is meshed. Lengths are in pixels.

    Parameters
    ----------
    size : float
        Length of the final edges.
    boundary_size : float, optional
        The same on boundaries inside the picture; `size` by default.
    frame_size : float, optional
        The same on the picture's border; `size` by default.
    material_sizes : mapping of (str or int) to float
        The same in single materials, by name or number.
    sizes_between : mapping of (str or int, str or int) to float
        The same on the boundaries between two materials, before all others.
    growth : float
        Largest ratio of the sizes of neighbouring elements; above 1.6 it counts as 1.6 inside regions.
    colors : "auto", "exact", "regions", int or sequence of RGB
        How colours become materials; see `SegmentationOptions`.
    flatten : "auto" or "off"
        Whether uneven light is taken out of grey pictures.
    marks : path or array_like, optional
        Pixels whose material is known, from which materials grow.
    learn : bool
        Whether what looks like the marks is a mark, too.
    no_data : float, optional
        Number of pixels that hold nothing, where the file does not say so.
    fill_void : int
        Void clusters of at most so many pixels go to the material around.
    merge : mapping of (str or int, ...) to str
        Materials that become one, and its name; see `merge_materials`.
    rename : mapping of (str or int) to str
        Other names of materials; all later options call them by these.
    recolor : mapping of (str or int) to RGB
        Other colours of materials.
    min_pixels : "auto" or int
        Clusters of fewer pixels are noise if they are also shorter than `min_length`.
    min_length : "auto" or float
        Characteristic length of the shortest cluster that stays. `auto` leaves exact label pictures as they are.
    policy : str
        Which pair is joined at an ambiguous corner of four pixels; see `ExtractionOptions`.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges on a boundary.
    max_shift : float
        How far smoothing moves a boundary at most, in data points.
    step : "auto", float or (float, float)
        Width of the picture's data points in pixels, or width and height: stairs of these are smoothed as those of
        pixels are. "auto" sees it, see `find_step`; 1 takes pixels as they are. Noise limits and `max_shift` count
        data points.
    tolerance : float
        Parts of the picture that are thinner go to their neighbours, boundaries shorter than this between two junctions
        are joined, and outlines smoothed over half of it; see `absorb_thin`. 0: the picture is taken at its word.
    keep : sequence of str or int
        Materials that `tolerance` takes no pixels from.
    join : float, optional
        Boundaries shorter than this between two junctions are joined to one, where sectors around it stay wide; twice
        `max_shift` or the tolerance by default, 0 for none.
    pixel_size : float, (float, float), "auto", "file" or "file:UNIT"
        Length of a pixel in the unit of the mesh; width and height where they differ. Lengths in pixels then mean the
        shorter side. "file": what the file says, in its own unit or in another; "auto": that of a map (GeoTIFF in a
        projected reference system), else 1.
    origin : (float, float), "auto" or "file"
        Place of the lower left corner of what is meshed. "auto": that of a map whose pixel size is taken, else 0, 0.
    drop : sequence of str or int
        Materials that are left out: their boundary becomes a free border.
    drop_transparent : bool
        Whether pixels of alpha 0 are left out too.
    crop : tuple of int, optional
        Left, upper, right, lower bound of the part that is meshed, from the picture's upper left corner.
    frame : int, optional
        Which picture of a stack, counted from 0; see `ReadOptions`.
    channel : int, optional
        Which channel of a picture that has several, counted from 0.
    level : int
        Which level of a pyramid: 0 is the finest.
    scalars : str, optional
        Which array of a file that holds several.
    info_bar : "keep" or "crop"
        What becomes of the bar with text below an electron micrograph.
    grain_angle : float
        Of an EBSD map: disorientation from which neighbours belong to two grains, degrees.
    periodic : "none", "x", "y" or "xy"
        Opposite sides get nodes at the same places, for a periodic cell; see `match_opposite_sides`.
    max_pixels : int
        Files of more pixels are refused before they are decoded; an array is in memory already.
    effort : "fast", "normal" or "best"
        How far the mesh is optimised.
    threads : int
        Number of threads, 0: one for each core that may be used; the mesh does not depend on it.
    triangulator : "auto", "triangle" or "cdt"
        Who makes the Delaunay triangles that quads come from; `auto` is Triangle where it is installed, else CDT.
    """

    size: float = same_as(SmoothingOptions, "size")
    boundary_size: float | None = same_as(SmoothingOptions, "boundary_size")
    frame_size: float | None = same_as(SmoothingOptions, "frame_size")
    material_sizes: Mapping[str | int, float] = same_as(SmoothingOptions, "material_sizes", default=FrozenMapping())
    sizes_between: Mapping[tuple[str | int, str | int], float] = same_as(
        SmoothingOptions, "sizes_between", default=FrozenMapping()
    )
    growth: float = same_as(SmoothingOptions, "growth")
    colors: Any = same_as(SegmentationOptions, "colors")
    flatten: str = same_as(SegmentationOptions, "flatten")
    marks: Any = same_as(SegmentationOptions, "marks")
    learn: bool = same_as(SegmentationOptions, "learn")
    no_data: float | None = same_as(SegmentationOptions, "no_data")
    fill_void: int = same_as(SegmentationOptions, "fill_void")
    merge: Mapping[tuple[str | int, ...], str] = same_as(EditOptions, "merge")
    rename: Mapping[str | int, str] = same_as(EditOptions, "rename")
    recolor: Mapping[str | int, Sequence[int]] = same_as(EditOptions, "recolor")
    min_pixels: int | Literal["auto"] = same_as(
        DenoiseOptions,
        "min_pixels",
        default="auto",
        word="auto",
        help="clusters of fewer pixels are noise if they are also too short; auto: none in label pictures, else the "
        "square of the least length; 0: none",
    )
    min_length: float | Literal["auto"] = same_as(
        DenoiseOptions,
        "min_length",
        default="auto",
        word="auto",
        help="least length (the longest way inside, also of bent ones) of clusters that stay, in pixels; auto: a "
        "hundredth of the picture's shorter side, from 4 to 16, in label pictures 0",
    )
    policy: str = same_as(ExtractionOptions, "policy")
    edge_ratio: float = same_as(SmoothingOptions, "edge_ratio")
    max_shift: float = same_as(SmoothingOptions, "max_shift")
    step: Literal["auto"] | float | tuple[float, float] = same_as(SmoothingOptions, "step")
    tolerance: float = same_as(AbsorbOptions, "tolerance")
    keep: tuple[str | int, ...] = same_as(AbsorbOptions, "keep")
    join: float | None = same_as(SmoothingOptions, "join")
    pixel_size: float | tuple[float, float] | str = option(
        "auto",
        "length of a pixel in the unit of the mesh, width and height where they differ (sizes in pixels then mean the "
        "shorter side); file: what the file says, file:mm: the same in millimetres; auto: that of a map in a projected "
        "reference system, else 1",
        kind=object,
        told="auto",
    )
    origin: tuple[float, float] | str = option(
        "auto",
        "place of the lower left corner of what is meshed; file: what the file says; auto: that of a map whose pixel "
        "size is taken, else 0,0",
        kind=object,
        told="auto",
    )
    drop: tuple[str | int, ...] = option(
        (), "materials that are left out, by name or number: their boundary becomes a free border", topic="picture"
    )
    drop_transparent: bool = same_as(SegmentationOptions, "drop_transparent")
    crop: Box | None = option(
        None,
        "mesh this part only: left, upper, right and lower bound in whole pixels from the picture's upper left corner",
        topic="picture",
    )
    periodic: str = option(
        "none",
        "directions in which opposite sides get nodes at the same places, for a periodic cell",
        choices=("none", "x", "y", "xy"),
    )
    frame: int | None = same_as(ReadOptions, "frame")
    channel: int | None = same_as(ReadOptions, "channel")
    level: int = same_as(ReadOptions, "level")
    scalars: str | None = same_as(ReadOptions, "scalars")
    info_bar: str = same_as(ReadOptions, "info_bar")
    grain_angle: float = same_as(ReadOptions, "grain_angle")
    max_pixels: int = same_as(ReadOptions, "max_pixels")
    effort: str = same_as(MeshingOptions, "effort")
    threads: int = same_as(MeshingOptions, "threads")
    triangulator: str = same_as(MeshingOptions, "triangulator")

    def __post_init__(self) -> None:
        check(self)
        assert_placement(self.pixel_size, self.origin)
        if self.crop is not None and not _is_box(self.crop):
            raise InputError(f"crop is {self.crop!r}; give left, upper, right and lower bound in whole pixels")
        edits = self.editing()
        for name, made in (
            ("material_sizes", FrozenMapping(self.material_sizes or {})),
            ("sizes_between", FrozenMapping(self.sizes_between or {})),
            ("merge", edits.merge),
            ("rename", edits.rename),
            ("recolor", edits.recolor),
            ("drop", _materials("drop", self.drop)),
            ("keep", _materials("keep", self.keep)),
            ("colors", _hashable(self.colors)),
            ("pixel_size", _hashable(self.pixel_size)),
            ("origin", _hashable(self.origin)),
            ("step", _hashable(self.step)),
            ("crop", self.crop and tuple(map(int, self.crop))),
        ):
            object.__setattr__(self, name, made)
        if not all(isinstance(pair, tuple) and len(pair) == 2 for pair in self.sizes_between):
            raise InputError(f"sizes_between has {list(self.sizes_between)!r}; give pairs of materials, as (1, 2)")
        # each stage checks its own options: now, not after minutes of work
        self.meshing(None)
        self.smoothing(None)
        self.absorbing(None)
        self.segmentation()
        self.reading()
        ExtractionOptions(self.policy)

    @property
    def pixel_sides(self) -> tuple[float, float]:
        """Width and height of a pixel, in the unit of the mesh: of options that were `placed`, or that gave them."""
        size = self.pixel_size
        if isinstance(size, str):
            return 1.0, 1.0
        return (size[0], size[1]) if isinstance(size, (tuple, list)) else (size, size)

    @property
    def corner(self) -> tuple[float, float]:
        """The origin as numbers: of options that were `placed`, or that gave them."""
        return (0.0, 0.0) if isinstance(self.origin, str) else self.origin

    def placed(self, found: Calibration, name: str) -> MeshOptions:
        """Return the options with the numbers that "auto" and "file" stand for.

        Parameters
        ----------
        found : Calibration
            What the file says of the part that is meshed.
        name : str
            What to call the picture.
        """
        size, origin = asked_placement(self.pixel_size, self.origin, found, name)
        return replace(self, pixel_size=size, origin=origin)

    def reading(self) -> ReadOptions:
        """Return the options of reading a file."""
        return ReadOptions(
            max_pixels=self.max_pixels,
            frame=self.frame,
            channel=self.channel,
            level=self.level,
            scalars=self.scalars,
            info_bar=self.info_bar,
            grain_angle=self.grain_angle,
            crop=self.crop,
        )

    def segmentation(self) -> SegmentationOptions:
        """Return the options of segmentation."""
        return SegmentationOptions(
            colors=self.colors,
            flatten=self.flatten,
            marks=self.marks,
            learn=self.learn,
            no_data=self.no_data,
            fill_void=self.fill_void,
            drop_transparent=self.drop_transparent,
        )

    def editing(self) -> EditOptions:
        """Return what the user makes of the materials."""
        return EditOptions(self.merge, self.rename, self.recolor)

    def noise(self, quantised: bool, shape: tuple[int, int]) -> DenoiseOptions:
        """Return the limits of noise in a picture of `shape`."""
        auto = picture.automatic_limits(quantised, shape)
        asked = (self.min_pixels, self.min_length)
        if asked != ("auto", "auto") and "auto" in asked and not auto.removes:
            auto = picture.automatic_limits(True, shape)  # one limit asked for switches noise removal on
        return DenoiseOptions(
            min_pixels=auto.min_pixels if self.min_pixels == "auto" else self.min_pixels,
            min_length=auto.min_length if self.min_length == "auto" else self.min_length,
            policy=self.policy,
        )

    def absorbing(self, materials: Materials | None, step: float = 1.0) -> AbsorbOptions:
        """Return the options of absorbing, for data points of a width."""
        keep = tuple(picture.material_number(materials, name) for name in self.keep) if materials else ()
        return AbsorbOptions(self.tolerance, keep, self.policy, step)

    def smoothing(
        self, materials: Materials | None, step: float | tuple[float, float] | None = None
    ) -> SmoothingOptions:
        """Return the options of smoothing, for the data points that were seen."""
        return SmoothingOptions(
            size=self.size,
            boundary_size=self.boundary_size,
            frame_size=self.frame_size,
            growth=self.growth,
            edge_ratio=self.edge_ratio,
            max_shift=self.max_shift,
            material_sizes=self._sizes(materials),
            sizes_between=self._sizes_between(materials),
            step=self.step if step is None else step,
            tolerance=self.tolerance,
            join=self.join,
            edge_multiple=EFFORTS[self.effort].edge_multiple,
            threads=self.threads,
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
            return {}
        return picture.sizes_by_number(materials, self.material_sizes)

    def _sizes_between(self, materials: Materials | None) -> dict[tuple[int, int], float]:
        if materials is None:
            return {}
        return picture.sizes_by_numbers(materials, self.sizes_between)


def _is_box(box: Any) -> bool:
    return isinstance(box, (tuple, list)) and len(box) == 4 and all(isinstance(bound, Integral) for bound in box)


def _materials(name: str, given: object) -> tuple[Any, ...]:
    """Return names or numbers of materials as a tuple; one may stand alone."""
    made = (given,) if isinstance(given, (str, Integral)) else tuple(given) if isinstance(given, Iterable) else (None,)
    if not all(isinstance(each, (str, Integral)) for each in made):
        raise InputError(f"{name} is {given!r}; give names or numbers of materials")
    return made


def _hashable(given: Any) -> Any:
    """Return rows as tuples; all else as it is, for its stage to check."""
    if isinstance(given, str) or not isinstance(given, Iterable):
        return given
    return tuple(map(_hashable, given))
