"""Types of arrays, and values made of them. Ids are int64, labels int32, -1 stands for none; coordinates float64."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Flags: TypeAlias = NDArray[np.bool_]
Labels: TypeAlias = NDArray[np.int32]
Bytes: TypeAlias = NDArray[np.uint8]
Singles: TypeAlias = NDArray[np.float32]

#: what a field of a value that is written so holds
_DTYPES: Mapping[str, DTypeLike] = {"Floats": np.float64, "Ints": np.int64, "Labels": np.int32, "Bytes": np.uint8}


def read_only(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any]:
    """Return a copy that cannot be changed, row after row in memory; what is mapped from a file to read, as it is."""
    if isinstance(values, np.memmap) and values.dtype == dtype and values.flags.c_contiguous and values.mode == "r":
        return values
    array = np.array(values, dtype=dtype, order="C")
    array.flags.writeable = False
    return array


class Value:
    """Base of frozen dataclasses of arrays: read-only ones, of the types that the fields name, in every copy of it."""

    def __post_init__(self) -> None:
        for field in fields(self):  # type: ignore[arg-type]
            dtype, values = _DTYPES.get(str(field.type).removesuffix(" | None")), getattr(self, field.name)
            if dtype is not None and values is not None:
                object.__setattr__(self, field.name, read_only(values, dtype))

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), tuple(getattr(self, field.name) for field in fields(self))  # type: ignore[arg-type]
