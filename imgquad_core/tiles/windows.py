"""What windows see of the planes that tiles have left, and of the routes between these."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from imgquad_core.arrays import Flags, Ints, Labels

from .files import load_arrays
from .grid import Box, common
from .job import Job
from .regions import Part, Regions


def regions_of(job: Job) -> Regions:
    """Return the regions of the picture; they must be joined."""
    return Regions(**load_arrays(job.path("regions")))


def parts_of(job: Job, kind: str, box: Box) -> list[Part]:
    """Return what tiles have left of a window."""
    found = []
    for t in job.grid.tiles_in(box):
        if (seen := common(job.grid.box(t), box)) is not None:
            found.append(Part(t, _place(seen, box), _plane(job, kind, t, seen), t))
    return found


def _plane(job: Job, kind: str, t: int, box: Box) -> Labels:
    """Return a part of what a tile has left."""
    plane = np.load(job.path(kind, t).with_suffix(".npy"), mmap_mode="r")
    return np.asarray(plane[_place(box, job.grid.box(t))])


def _place(part: Box, box: Box) -> tuple[slice, slice]:
    """Return rows and columns of a part of a box."""
    left, upper = box[:2]
    return slice(part[1] - upper, part[3] - upper), slice(part[0] - left, part[2] - left)


def labels_in(job: Job, box: Box) -> Labels:
    """Put the labels of a window together."""
    whole = np.empty((box[3] - box[1], box[2] - box[0]), np.int32)
    for part in parts_of(job, "labels", box):
        whole[part.place] = part.ids
    return whole


def numbers_in(job: Job, box: Box, regions: Regions) -> Ints:
    """Return the number of each pixel's region in a window, -1 for void."""
    whole = np.empty((box[3] - box[1], box[2] - box[0]), np.int64)
    for part in parts_of(job, "ids", box):
        here = slice(regions.offsets[part.tile], regions.offsets[part.tile + 1])
        whole[part.place] = np.append(regions.number[here], -1)[part.ids]
    return whole


def parts_with_routes(job: Job, box: Box) -> list[Part]:
    """Return what a window is made of, the pixels that routes have given to other tiles at last."""
    found = parts_of(job, "ids", box)
    around = job.grid.clipped(box, job.grid.reach)
    for t in job.grid.tiles_in(around):
        for axis in (0, 1):
            corridor = job.grid.corridor(t, axis)
            if corridor is not None and common(corridor, box) is not None:
                found += _moved(job, t, axis, corridor, box)
    return found


def _moved(job: Job, t: int, axis: int, corridor: Box, box: Box) -> Iterator[Part]:
    """Give the pixels of a window that a route has given to another tile."""
    other = job.grid.next_to(t, axis)
    beyond: Flags = load_arrays(job.path("route", t))[f"beyond-{axis}"]
    for tile, owner, given in ((t, other, beyond), (other, t, ~beyond)):
        seen = common(job.grid.box(tile), common(corridor, box))
        if seen is not None and (where := given[_place(seen, corridor)]).any():
            yield Part(tile, _place(seen, box), _plane(job, "ids", tile, seen), owner, where)
