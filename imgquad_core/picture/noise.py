"""Step 1 of the paper: noise is removed, long thin features stay.

A cluster is a connected set of pixels of one material. It is noise when it has fewer than `min_pixels` pixels AND its
characteristic length is below `min_length`; both together spare veins and cracks that are thin but long.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from imgquad_core.arrays import Flags, Ints, Labels
from imgquad_core.errors import InputError
from imgquad_core.geometry.corner_rule import PAIR_AD, PAIR_BC, corner_rule, joined_pair
from imgquad_core.grouping import root_of
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, LabelImage
from imgquad_core.orientation import turn_of_image

from .clusters import Clusters, join, labelled_clusters
from .options import DenoiseOptions


@dataclass(frozen=True)
class Removal:
    """What noise removal took from one material.

    Parameters
    ----------
    material : int
        Number of the material.
    name : str
        Its name.
    clusters : int
        Clusters that were given to a neighbour.
    pixels : int
        Pixels of these clusters.
    """

    material: int
    name: str
    clusters: int
    pixels: int


def automatic_limits(quantised: bool, shape: tuple[int, int]) -> DenoiseOptions:
    """Return the noise limits that suit a picture.

    Parameters
    ----------
    quantised : bool
        Whether the labels were found by quantising colours. Exact label pictures are taken at their word.
    shape : tuple of int
        (n_rows, n_cols) of the picture.

    Returns
    -------
    DenoiseOptions
        Off for exact labels. Otherwise `min_length` is a hundredth of the picture's shorter side, at least 4 and at
        most 16 pixels, and `min_pixels` its square, so that a square blob of that side is the smallest that stays.
    """
    if not quantised:
        return DenoiseOptions()
    length = int(np.clip(round(min(shape) / 100), 4, 16))
    return DenoiseOptions(min_pixels=length**2, min_length=float(length))


def remove_noise(image: LabelImage, options: DenoiseOptions | None = None) -> LabelImage:
    """Give each noise cluster to a neighbour, the smallest first, until none is left.

    Parameters
    ----------
    image : LabelImage
        Labels, int32, shape (n_rows, n_cols).
    options : DenoiseOptions, optional
        Limits in pixels; by default nothing is removed.

    Returns
    -------
    LabelImage
        New labels of the same shape with the same materials (a material may have lost all its pixels).

    Notes
    -----
    Pixels are connected over their sides, and over a corner where the boundary stage joins them too, by
    `imgquad_core.geometry.corner_rule`. A one-pixel vein is one cluster in every direction (not with "junction").

    The characteristic length is the number of pixels on the longest of the shortest paths inside the cluster
    (geodesic diameter, found by two breadth-first sweeps): 60 for a one-pixel vein of 60 pixels however bent, 8 for a
    block of 8 x 8.

    A cluster goes to the material with the longest common border (pixel sides; all neighbours of one material
    count together, for they become one cluster with it). Ties: the material with the largest neighbouring cluster,
    then the lower number. Among clusters of the same number of pixels the first in reading order goes first, in
    the one of the picture's positions that `imgquad_core.orientation` picks: a turned picture loses the same.
    Merged clusters are measured anew, and labelled anew until nothing changes. `VOID` is neither noise nor a
    neighbour, and a cluster without a neighbour stays. Time is linear in the number of pixels for given limits.

    References
    ----------
    The paper's step 1 (doi:10.1063/2.1106101).
    """
    options = options or DenoiseOptions()
    turn = turn_of_image(image, options.policy)
    return turn.image_back(remove_in_order(turn.image(image), options)) if options.removes else image


def remove_in_order(image: LabelImage, options: DenoiseOptions) -> LabelImage:
    """Do what `remove_noise` does in the picture as it lies: windows of a large one then lose the same."""
    if not options.removes or image.labels.size == 0:
        return image
    values, colors = _ranked(image)
    while _remove_once(colors, len(values), options):
        pass
    return LabelImage(_unranked(values, colors), image.materials)


def list_removed(
    before: LabelImage, after: LabelImage, policy: str = "minority", step: float = 1.0
) -> tuple[Removal, ...]:
    """List by material what noise removal took away.

    Parameters
    ----------
    before, after : LabelImage
        What `remove_noise` took and gave.
    policy, step
        As in the options of the removal.

    Returns
    -------
    tuple of Removal
        One for each material that lost pixels, in the order of their numbers.
    """
    if before.shape != after.shape:
        raise InputError(f"before is {before.shape}, after is {after.shape} pixels: give the two ends of one removal")
    if before.labels is after.labels:
        return ()
    changed = (before.labels != after.labels).ravel()
    materials, pixels = np.unique(before.labels.ravel()[changed], return_counts=True)
    values, colors = _ranked(before)
    # all of a cluster counts, even if some is kept: what is recoloured first may part others at a corner
    counts = _touched(colors, changed, len(values), corner_rule(policy, step))
    clusters = dict(zip(values.tolist(), counts.tolist(), strict=True))
    return tuple(
        Removal(m, before.materials.name_of(m), clusters[m], n)
        for m, n in zip(materials.tolist(), pixels.tolist(), strict=True)
    )


class Queue(NamedTuple):
    """Clusters by their number of pixels: those of the picture sorted once, merged ones in linked lists."""

    roots: Labels
    starts: Ints
    merged: Labels  #: by number of pixels: a pixel in the cluster merged last, -1 for none
    earlier: Labels  #: by pixel: the one merged before


class Scratch(NamedTuple):
    """Work arrays, zero between uses."""

    distance: Labels  #: by pixel
    front: Labels  #: pixels of a breadth-first sweep
    border: Ints  #: by colour: common pixel sides
    largest: Ints  #: by colour: pixels of the largest neighbour


def _ranked(image: LabelImage) -> tuple[Labels, Labels]:
    """Return the materials that occur, and colours 0, 1, ... in their place (`VOID` stays)."""
    values = np.array(list(image.pixels), np.int32)
    if len(values) and values[-1] == len(values) - 1:
        return values, image.labels.copy()
    colors = np.searchsorted(values, image.labels).astype(np.int32)
    colors[image.labels == VOID] = VOID
    return values, colors


def _unranked(values: Labels, colors: Labels) -> Labels:
    return np.append(values, np.int32(VOID))[colors]  # colour -1 takes the last one


def _remove_once(colors: Labels, n_colors: int, options: DenoiseOptions) -> int:
    """Recolour noise in place; return the number of clusters that went."""
    min_pixels, rule = min(int(options.min_pixels), colors.size + 1), corner_rule(options.policy, options.step)
    clusters = labelled_clusters(colors, rule)
    queue = _queued(colors, clusters, min_pixels)
    scratch = Scratch(
        np.zeros(colors.size, np.int32),
        np.empty(min_pixels, np.int32),
        np.zeros(n_colors, np.int64),
        np.zeros(n_colors, np.int64),
    )
    merged = np.empty(colors.size, np.int32)
    gone = 0
    for size in range(1, min_pixels):
        first, last = queue.starts[size], queue.starts[size + 1]
        roots = queue.roots[first:last]
        if queue.merged[size] >= 0:
            n = merged_roots(clusters, queue, size, merged)
            roots = np.unique(np.concatenate([roots, merged[:n]]))
        if len(roots):
            gone += recolour_noise(colors, clusters, queue, scratch, roots, size, options.min_length, rule)
    return gone


def _queued(colors: Labels, clusters: Clusters, min_pixels: int) -> Queue:
    small = (clusters.parent == np.arange(colors.size)) & (clusters.pixels < min_pixels) & (colors.ravel() != VOID)
    roots = np.flatnonzero(small).astype(np.int32)
    order = np.argsort(clusters.pixels[roots], kind="stable")
    starts = np.searchsorted(clusters.pixels[roots][order], np.arange(min_pixels + 1))
    return Queue(roots[order], starts, np.full(min_pixels, -1, np.int32), np.full(colors.size, -1, np.int32))


@kernel
def recolour_noise(
    colors: Labels,
    clusters: Clusters,
    queue: Queue,
    scratch: Scratch,
    roots: Labels,
    size: int,
    min_length: float,
    rule: int,
) -> int:
    """Recolour the noise among clusters of `size` pixels; return how many went."""
    gone = 0
    for root in roots:
        # an earlier one of this size may have grown into it meanwhile
        if clusters.parent[root] != root or clusters.pixels[root] != size:
            continue
        color = neighbour_color(colors, clusters, scratch, root)
        if color == VOID or characteristic_length(colors, clusters, scratch, root) >= min_length:
            continue
        give_away(colors, clusters, queue, root, color, rule)
        gone += 1
    return gone


@kernel
def merged_roots(clusters: Clusters, queue: Queue, size: int, roots: Labels) -> int:
    """Fill `roots` with the clusters that had `size` pixels when they were merged; return how many."""
    n = 0
    p = queue.merged[size]
    while p >= 0:
        roots[n] = root_of(clusters.parent, p)
        n += 1
        p = queue.earlier[p]
    return n


@kernel
def _touched(colors: Labels, changed: Flags, n_colors: int, rule: int) -> Ints:
    """Count by colour the clusters that have changed pixels, each walked through once."""
    cols = colors.shape[1]
    count, seen = np.zeros(n_colors, np.int64), np.zeros(colors.size, np.bool_)
    front = np.empty(colors.size, np.int32)
    for start in range(colors.size):
        if not changed[start] or seen[start]:
            continue
        count[colors[start // cols, start % cols]] += 1
        front[0], seen[start] = start, True
        n, k = 1, 0
        while k < n:
            p = front[k]
            k += 1
            for q in sides(p, colors.shape[0], cols):
                if q >= 0 and not seen[q] and colors[q // cols, q % cols] == colors[p // cols, p % cols]:
                    front[n], seen[q] = q, True
                    n += 1
            for q in over_corners(colors, p, rule):
                if q >= 0 and not seen[q]:
                    front[n], seen[q] = q, True
                    n += 1
    return count


@verb
def over_corners(colors: Labels, p: int, rule: int) -> tuple[int, int, int, int]:
    """Return the pixels that pixel `p` is joined with over its corners, -1 where it is not."""
    rows, cols = colors.shape
    r, c = p // cols, p % cols
    up, down, left, right = r > 0, r < rows - 1, c > 0, c < cols - 1
    return (
        p - cols - 1 if up and left and joined_pair(colors, r, c, rule) == PAIR_AD else -1,
        p - cols + 1 if up and right and joined_pair(colors, r, c + 1, rule) == PAIR_BC else -1,
        p + cols - 1 if down and left and joined_pair(colors, r + 1, c, rule) == PAIR_BC else -1,
        p + cols + 1 if down and right and joined_pair(colors, r + 1, c + 1, rule) == PAIR_AD else -1,
    )


@verb
def neighbour_color(colors: Labels, clusters: Clusters, scratch: Scratch, root: int) -> int:
    """Return the colour with the longest border to a cluster, `VOID` where it has no neighbour."""
    border, largest = scratch.border, scratch.largest
    flat = colors.ravel()
    p = root
    while p >= 0:
        for q in sides(p, colors.shape[0], colors.shape[1]):
            if q >= 0 and flat[q] != flat[root] and flat[q] != VOID:
                border[flat[q]] += 1
                largest[flat[q]] = max(largest[flat[q]], clusters.pixels[root_of(clusters.parent, q)])
        p = clusters.follower[p]
    best = VOID
    p = root
    while p >= 0:
        for q in sides(p, colors.shape[0], colors.shape[1]):
            if q >= 0 and flat[q] != flat[root] and flat[q] != VOID:
                if best == VOID or precedes(border, largest, flat[q], best):
                    best = flat[q]
        p = clusters.follower[p]
    p = root
    while p >= 0:
        for q in sides(p, colors.shape[0], colors.shape[1]):
            if q >= 0 and flat[q] != VOID:
                border[flat[q]] = 0
                largest[flat[q]] = 0
        p = clusters.follower[p]
    return best


@verb
def precedes(border: Ints, largest: Ints, a: int, b: int) -> bool:
    """Return whether colour `a` is the better taker: longer border, larger neighbour, lower number."""
    if border[a] != border[b]:
        return bool(border[a] > border[b])
    if largest[a] != largest[b]:
        return bool(largest[a] > largest[b])
    return a < b


@kernel
def sides(p: int, rows: int, cols: int) -> tuple[int, int, int, int]:
    """Return the pixels above, left, right and below of pixel `p`, -1 outside."""
    r, c = p // cols, p % cols
    above, below = p - cols if r > 0 else -1, p + cols if r < rows - 1 else -1
    return above, p - 1 if c > 0 else -1, p + 1 if c < cols - 1 else -1, below


@verb
def characteristic_length(colors: Labels, clusters: Clusters, scratch: Scratch, root: int) -> int:
    """Return the number of pixels on the longest shortest path in a cluster, by two sweeps."""
    if clusters.pixels[root] < 3:
        return int(clusters.pixels[root])
    far, _ = farthest(colors, clusters, scratch, root)
    forget_distances(clusters, scratch, root)
    _, length = farthest(colors, clusters, scratch, far)
    forget_distances(clusters, scratch, root)
    return length


@verb
def farthest(colors: Labels, clusters: Clusters, scratch: Scratch, start: int) -> tuple[int, int]:
    """Return the pixel of a cluster that is the most steps from `start`, and the number of pixels on the way."""
    distance, front = scratch.distance, scratch.front
    rows, cols = colors.shape
    root = root_of(clusters.parent, start)
    flat = colors.ravel()
    front[0] = start
    distance[start] = 1
    n, k = 1, 0
    while k < n:
        p = front[k]
        r, c = p // cols, p % cols
        for i in range(max(r - 1, 0), min(r + 2, rows)):
            for j in range(max(c - 1, 0), min(c + 2, cols)):
                q = i * cols + j
                if distance[q] == 0 and flat[q] == flat[p] and root_of(clusters.parent, q) == root:
                    distance[q] = distance[p] + 1
                    front[n] = q
                    n += 1
        k += 1
    return front[n - 1], distance[front[n - 1]]


@verb
def forget_distances(clusters: Clusters, scratch: Scratch, root: int) -> None:
    """Set the distances of a cluster back to zero."""
    p = root
    while p >= 0:
        scratch.distance[p] = 0
        p = clusters.follower[p]


@verb
def give_away(colors: Labels, clusters: Clusters, queue: Queue, root: int, color: int, rule: int) -> None:
    """Recolour a cluster and unite it, and what it kept apart, with what it now touches."""
    rows, cols = colors.shape
    flat = colors.ravel()
    end = clusters.last[root]
    p = root
    while p != -1:
        flat[p] = color
        p = clusters.follower[p] if p != end else -1
    p = root
    while p != -1:
        # uniting appends to the list behind `end`, so the way to it stays as it was
        following = clusters.follower[p] if p != end else -1
        for q in sides(p, colors.shape[0], colors.shape[1]):
            if q >= 0 and flat[q] == color:
                merge(clusters, queue, p, q)
        for i in range(p // cols, p // cols + 2):
            for j in range(p % cols, p % cols + 2):
                if 0 < i < rows and 0 < j < cols:
                    merge_diagonal(colors, clusters, queue, i, j, rule)
        p = following


@verb
def merge_diagonal(colors: Labels, clusters: Clusters, queue: Queue, i: int, j: int, rule: int) -> None:
    """Unite the pixels that are connected over one corner."""
    p = i * colors.shape[1] + j
    pair = joined_pair(colors, i, j, rule)
    if pair == PAIR_AD and colors[i, j] != VOID:
        merge(clusters, queue, p - colors.shape[1] - 1, p)
    elif pair == PAIR_BC and colors[i - 1, j] != VOID:
        merge(clusters, queue, p - colors.shape[1], p - 1)


@kernel
def merge(clusters: Clusters, queue: Queue, p: int, q: int) -> None:
    """Unite two clusters and queue the result while it is small."""
    given_up = join(clusters, p, q)
    if given_up < 0:
        return
    count = clusters.pixels[root_of(clusters.parent, given_up)]
    if count < len(queue.merged):
        queue.earlier[given_up] = queue.merged[count]
        queue.merged[count] = given_up
