"""How boundaries are extracted and smoothed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from imgquad_core.declared import GROWTH, MATERIAL_SIZES, POLICY, SIZE, check, option


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
    """

    policy: str = POLICY.field()

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
        The same on boundaries, `size` where not given.
    growth : float
        Largest ratio of the sizes of neighbouring elements.
    edge_ratio : float
        Largest ratio of the lengths of neighbouring edges of a chain.
    max_shift : float
        How far a point of the boundary moves at most, in pixels.
    material_sizes : mapping of int to float
        Length of final edges per material label; a boundary takes the least of its two sides'.
    edge_multiple : {4, 12}
        Very long pieces between corners get a multiple of this many edges, up to 10 % longer or shorter than asked.
    """

    size: float = SIZE.field()
    boundary_size: float | None = option(
        None,
        "length of the final edges on boundaries, in pixels",
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
        "how far smoothing moves a boundary at most, in pixels",
        what="a length",
        least=0.0,
        most=10.0,
        unit="px",
        topic="boundaries",
    )
    material_sizes: Mapping[int, float] | None = MATERIAL_SIZES.field()
    edge_multiple: Literal[4, 12] = option(
        4,
        "very long boundaries get a multiple of this many edges, up to 10 % longer or shorter than asked",
        choices=(4, 12),
        topic="boundaries",
    )

    def __post_init__(self) -> None:
        check(self)
