"""How boundaries are extracted and smoothed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from imgquad_core.declared import (
    GROWTH,
    MATERIAL_SIZES,
    POLICY,
    SIZE,
    SIZES_BETWEEN,
    THREADS,
    Declaration,
    check,
    option,
)
from imgquad_core.errors import InputError


@dataclass(frozen=True)
class ExtractionOptions:
    """How boundaries are extracted.

    Parameters
    ----------
    policy : {"minority", "majority", "lower", "diagonal", "junction"}
        What happens where two colours form a checkerboard block of 2 x 2 pixels. "minority": the colour with fewer
        pixels within 3 px is joined, the lower label on a tie (keeps thin lines whole and gives the fewest regions);
        "majority": the other one; "lower": the lower label; "diagonal": the pixels upper left and lower right;
        "junction": none, four chains meet. Where one diagonal only has one colour it is joined, except by
        "junction".
    step : float
        Width of the picture's data points in pixels: the window counts these.
    """

    policy: str = POLICY.field()
    step: float = field(default=1.0, metadata={"internal": True})  # seen in the picture: no filter has it

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True)
class SmoothingOptions:
    """How boundaries are smoothed and cut into edges.

    Parameters
    ----------
    size : float
        Length of final edges, in pixels.
    boundary_size : float, optional
        The same on boundaries inside the picture, `size` where not given.
    frame_size : float, optional
        The same on the picture's border, `size` where not given.
    growth : float
        Largest ratio of the sizes of neighbouring elements.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges of a chain.
    max_shift : float
        How far a point of the boundary moves at most, in data points.
    material_sizes : mapping of int to float
        Length of final edges per material label; a boundary takes the least of its two sides'.
    sizes_between : mapping of (int, int) to float
        Length of final edges on the boundaries between two materials, before all others.
    step : "auto", float or (float, float)
        Width of the data points in pixels, or width and height: stairs of these are smoothed as those of pixels are.
        "auto": as they are seen, see `find_step`.
    tolerance : float
        Outlines are smoothed over half of it, in pixels, and chains shorter than it joined. Parts of the picture that
        are thinner are to be absorbed before, see `absorb_thin`; if they are not they stay as they are.
    join : float, optional
        Chains shorter than this, in pixels, go where the chains around allow: their ends become one junction. Twice
        `max_shift` or the tolerance where not given; 0 for none.
    edge_multiple : {4, 12}
        Very long pieces between corners get a multiple of this many edges, up to 10 % longer or shorter than asked.
    threads : int
        Number of threads, 0: one for each core that may be used; the boundary does not depend on it.
    """

    size: float = SIZE.field()
    boundary_size: float | None = option(
        None,
        "length of the final edges on boundaries inside the picture, in pixels",
        kind=float,
        what="a length",
        least=0.05,
        unit="px",
        told="as inside",
    )
    frame_size: float | None = option(
        None,
        "length of the final edges on the picture's border, in pixels",
        kind=float,
        what="a length",
        least=0.05,
        unit="px",
        told="as inside",
    )
    growth: float = GROWTH.field()
    edge_ratio: float = option(
        1.2,
        "largest ratio of the lengths of neighbouring edges on a boundary",
        what="a ratio",
        least=1.01,
        most=10.0,
        topic="boundaries",
    )
    max_shift: float = option(
        1.0,
        "how far smoothing moves a boundary at most, in data points",
        what="a length",
        least=0.0,
        most=10.0,
        unit="px",
        topic="boundaries",
    )
    material_sizes: Mapping[int, float] | None = MATERIAL_SIZES.field()
    sizes_between: Mapping[tuple[int, int], float] | None = SIZES_BETWEEN.field()
    step: Literal["auto"] | float | tuple[float, float] = option(
        "auto",
        "width of the picture's data points in pixels, or width and height: stairs of these are smoothed as those of "
        "pixels are; auto sees it, 1 keeps them",
        kind=object,
        told="auto",
        topic="boundaries",
    )
    tolerance: float = option(
        0.0,
        "outlines are smoothed over half of it, in pixels, and boundaries shorter than it joined; thinner parts stay",
        what="a length",
        least=0.0,
        unit="px",
        topic="boundaries",
    )
    join: float | None = option(
        None,
        "boundaries shorter than this between two junctions are joined, where sectors around stay wide, in pixels; 0: "
        "none are",
        kind=float,
        what="a length",
        least=0.0,
        unit="px",
        told="auto: two data points, or the tolerance",
        topic="boundaries",
    )
    edge_multiple: Literal[4, 12] = option(
        4,
        "very long boundaries get a multiple of this many edges, up to 10 % longer or shorter than asked",
        choices=(4, 12),
        topic="boundaries",
    )
    threads: int = THREADS.field()

    def __post_init__(self) -> None:
        check(self)
        if self.step != "auto" and not _is_step(self.step):
            raise InputError(f"step is {self.step!r}; give auto, or a width (and a height) from 1 to 1000 px")


_SIDE = Declaration(1.0, "", float, least=1.0, most=1000.0)


def _is_step(step: Any) -> bool:
    sides = step if isinstance(step, (tuple, list)) else (step, step)
    return len(sides) == 2 and all(_SIDE.allows(side) for side in sides)
