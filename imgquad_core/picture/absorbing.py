"""Parts of a picture that are thinner than a tolerance go to their neighbours, so that boundaries stay shared.

With r half the tolerance, a disc of radius r fits around every pixel of a CORE, inside its own region and the picture.
What is within 2 r of a core stays: corners of more than 60 degrees do. The rest is thin, and flooded from all sides::

      ############                ############      # one region: its arm and the bay are thin
      ############                ############
      ##########.............     ############      the arm goes to the dots, and the bay to the region,
      ####   ####                 ############      whatever else it holds
      ####   ####                 ############

Where much was changed outlines are rounded. A picture of specks all over has no cores to flood from: there materials
are given places by their local density first, each with a weight that leaves it its area.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.ndimage import gaussian_filter

from imgquad_core.arrays import Flags, Floats, Ints, Labels
from imgquad_core.geometry.corner_rule import corner_rule
from imgquad_core.jit import kernel, verb
from imgquad_core.model import VOID, LabelImage
from imgquad_core.orientation import turn_of_image

from .clusters import labelled_clusters
from .options import AbsorbOptions

FINEST = 6.0  #: px; with a smaller tolerance the picture is enlarged first: discs of 1 or 2 px eat the stairs
MOST_TIMES = 3  #: as wide
ROUNDS = 6
CORNER = 2.0  # radii from a core that stay
BLUNT = 0.5  # width of the bell over the radius, where outlines are rounded
TILE = 64  # px, of the picture at once
BELL_ENDS = 3.0  # widths
SPECKS, FAR = 0.02, 0.75  # share of the picture that is farther than that many tolerances from what stays: it is noisy
BALANCES, POWER, CALMER = 12, 0.7, 0.85  # rounds in which weights are set, how far at once, and how far in the next
MOST_BYTES = 2_000_000_000  # of densities; a picture with more is flooded
DIAGONAL = np.sqrt(2.0)


@dataclass(frozen=True)
class Absorption:
    """What one material lost and gained.

    Parameters
    ----------
    material, regions, absorbed : int
        Number of the material, of its regions, and of those that are gone.
    pixels, lost, gained : int
        Its pixels, those that went to others, and those of others that came to it.
    """

    material: int
    regions: int
    absorbed: int
    pixels: int
    lost: int
    gained: int


class Absorbed(NamedTuple):
    """A picture without thin parts."""

    image: LabelImage  #: of the size it had
    enlarged: LabelImage  #: what is meshed: enlarged `times`
    times: int
    materials: tuple[Absorption, ...]  #: none where nothing was asked for
    is_noisy: bool = False  #: materials were given places by their density: regions are the rest of nothing


def absorb_thin(image: LabelImage, options: AbsorbOptions) -> Absorbed:
    """Give what is thinner than a tolerance to its neighbours.

    Parameters
    ----------
    image : LabelImage
        The picture; void pixels stay void.
    options : AbsorbOptions
        What is absorbed.

    Returns
    -------
    Absorbed
        The picture without thin parts.
    """
    times = int(np.clip(np.ceil(FINEST / max(options.tolerance, 1.0)), 1, MOST_TIMES))
    if not options.tolerance:
        return Absorbed(image, image, 1, ())
    turn = turn_of_image(image, options.policy)
    image = turn.image(image)
    before = enlarged_labels(image.labels, times)
    radius, rule = 0.5 * options.tolerance * times, corner_rule(options.policy, options.step * times)
    after, is_noisy = _absorbed(before, np.isin(before, [VOID, *options.keep]), radius, rule)
    middle = after[times // 2 :: times, times // 2 :: times]
    enlarged = LabelImage(after, image.materials)
    small = enlarged if times == 1 else LabelImage(middle, image.materials)
    accounts = _accounts(before, after, times, options)
    return Absorbed(turn.image_back(small), turn.image_back(enlarged), times, accounts, is_noisy)


def widest_part(image: LabelImage) -> float:
    """Return the width of the widest part of a picture, in pixels: of a larger tolerance nothing is left to stay."""
    return 2.0 * float(np.where(image.labels == VOID, 0.0, distances(image.labels)).max(initial=0.0))


def enlarged_labels(labels: Labels, times: int) -> Labels:
    """Return a picture with each pixel `times` as wide and high."""
    return np.ascontiguousarray(np.repeat(np.repeat(labels, times, axis=0), times, axis=1))


def areas_of_origin(before: Labels, after: Labels, rule: int) -> Floats:
    """Return the area that each region of the new picture is to have: that of what it is the rest of.

    Parameters
    ----------
    before, after : int32, shape (n_rows, n_cols)
        Labels.
    rule : int
        Of the ambiguous corner, see `corner_rule`.

    Returns
    -------
    float64, shape (n_regions,)
        In pixels; regions are numbered in the order of their first pixels. Those of the old picture give their area
        to their rests, by overlap; where nothing is left of one, its pixels count for the regions that they are in.
    """
    old = _roots(labelled_clusters(before, rule).parent.astype(np.int64).ravel())
    solid = after.ravel() != VOID
    first, region = np.unique(
        _roots(labelled_clusters(after, rule).parent.astype(np.int64).ravel())[solid], return_inverse=True
    )
    same = solid & (before == after).ravel()
    total = np.bincount(old[solid], minlength=len(old))
    rest = np.bincount(old[same], minlength=len(old))
    share = np.where(same, (total / np.maximum(rest, 1))[old], np.where(rest[old] == 0, 1.0, 0.0))
    areas = np.bincount(region, share[solid], len(first))
    pixels = np.bincount(region, minlength=len(first))
    return np.asarray(np.maximum(areas, 0.5 * pixels))


def _roots(parent: Ints) -> Ints:
    while True:
        above = parent[parent]
        if np.array_equal(above, parent):
            return parent
        parent = above


def _absorbed(labels: Labels, stays: Flags, radius: float, rule: int) -> tuple[Labels, bool]:
    """Absorb what is thin; also tell whether the picture is noisy."""
    is_noisy = False
    for attempt in range(ROUNDS):
        kept = _kept(labels, stays, radius, rule)
        if kept.all() or not (kept & (labels != VOID)).any():
            break
        new, gone = flood(labels, kept)
        stays = stays | (~kept & (gone == 0.0))  # between void pixels, with nothing in reach that is kept
        if attempt == 0 and np.mean(gone > FAR * 2.0 * radius) > SPECKS:
            is_noisy = True
            labels = _balanced(labels, stays, radius)
            kept = _kept(labels, stays, radius, rule)
            if kept.all() or not (kept & (labels != VOID)).any():
                break
            new, _ = flood(labels, kept)
        labels = rounded(new, (new != labels) & ~stays, stays, radius, BLUNT * radius)
    else:  # what the last rounding left thin may not be seen in the picture that is not enlarged
        labels, _ = flood(labels, _kept(labels, stays, radius, rule))
    return labels, is_noisy


def _kept(labels: Labels, stays: Flags, radius: float, rule: int) -> Flags:
    """Tell which pixels stay: near a core of a region that is large enough."""
    clusters = labelled_clusters(labels, rule)
    root = _roots(clusters.parent.astype(np.int64).ravel())
    small = (clusters.pixels.ravel()[root] < 4.0 * radius * radius).reshape(labels.shape)
    kept = near_core(labels, distances(labels), radius, CORNER * radius)
    return np.asarray((kept & ~small) | stays)


@kernel
def distances(labels: Labels) -> Floats:
    """Distance of each pixel to the nearest one of another label, or outside the picture.

    Exact: in each row, within a run of one label, the squared distance is the lower envelope of parabolas, whose
    heights are distances within columns; beyond its ends there is another label at height 0.
    """
    rows, cols = labels.shape
    up = np.empty((rows, cols))
    for j in range(cols):
        gone = 0.0
        for i in range(rows):
            gone = 1.0 if i == 0 or labels[i, j] != labels[i - 1, j] else gone + 1.0
            up[i, j] = gone
        for i in range(rows - 1, -1, -1):
            gone = 1.0 if i == rows - 1 or labels[i, j] != labels[i + 1, j] else gone + 1.0
            up[i, j] = min(up[i, j], gone)
    height, found = np.empty(cols + 2), np.empty(cols + 2)
    top, ends = np.empty(cols + 2, np.int64), np.empty(cols + 3)
    for i in range(rows):
        begin = 0
        while begin < cols:
            end = begin + 1
            while end < cols and labels[i, end] == labels[i, begin]:
                end += 1
            n = end - begin + 2
            height[0] = height[n - 1] = 0.0
            for k in range(1, n - 1):
                height[k] = up[i, begin + k - 1] ** 2
            _lower_envelope(height, n, top, ends, found)
            for k in range(1, n - 1):
                up[i, begin + k - 1] = np.sqrt(found[k])
            begin = end
    return up


@verb
def _lower_envelope(height: Floats, n: int, top: Ints, ends: Floats, found: Floats) -> None:
    """Least of height[k] + (x - k)^2 over k, at x = 0 .. n - 1 (Felzenszwalb & Huttenlocher 2012)."""
    count = 0
    top[0], ends[0], ends[1] = 0, -np.inf, np.inf
    for q in range(1, n):
        while True:
            p = top[count]
            s = (height[q] + q * q - height[p] - p * p) / (2.0 * (q - p))
            if s > ends[count]:
                break
            count -= 1
        count += 1
        top[count], ends[count], ends[count + 1] = q, s, np.inf
    count = 0
    for x in range(n):
        while ends[count + 1] < x:
            count += 1
        found[x] = height[top[count]] + (x - top[count]) ** 2


@kernel
def near_core(labels: Labels, distance: Floats, radius: float, reach: float) -> Flags:
    """Tell which pixels are within reach of one farther than `radius` from other labels, on a way in their region."""
    rows, cols = labels.shape
    gone = np.empty((rows, cols))
    queue = np.empty(rows * cols, np.int64)
    waits = np.zeros((rows, cols), np.bool_)
    count = 0
    for i in range(rows):
        for j in range(cols):
            gone[i, j] = 0.0 if distance[i, j] > radius else np.inf
            if distance[i, j] > radius and distance[i, j] <= radius + 2.0:
                queue[count] = i * cols + j
                waits[i, j] = True
                count += 1
    _spread(labels, gone, queue, waits, count, reach, True, labels)
    kept = np.empty((rows, cols), np.bool_)
    for i in range(rows):
        for j in range(cols):
            kept[i, j] = gone[i, j] <= reach
    return kept


@verb
def _spread(
    labels: Labels, gone: Floats, queue: Ints, waits: Flags, count: int, reach: float, inside: bool, out: Labels
) -> None:
    """Carry lengths of ways on from the pixels in the queue, first come first served, until none gets shorter.

    `inside`: ways stay in their region. Else the label of a way's begin goes into `out`.
    """
    rows, cols = labels.shape
    head, size = 0, len(queue)
    while count > 0:
        p = queue[head]
        head = (head + 1) % size
        count -= 1
        i, j = p // cols, p % cols
        waits[i, j] = False
        for di in range(-1, 2):
            for dj in range(-1, 2):
                a, b = i + di, j + dj
                if (di == 0 and dj == 0) or a < 0 or b < 0 or a >= rows or b >= cols:
                    continue
                way = gone[i, j] + (DIAGONAL if di != 0 and dj != 0 else 1.0)
                if way >= gone[a, b] - 1e-9 or way > reach or (inside and labels[a, b] != labels[i, j]):
                    continue
                gone[a, b] = way
                if not inside:
                    out[a, b] = out[i, j]
                if not waits[a, b]:
                    waits[a, b] = True
                    queue[(head + count) % size] = a * cols + b
                    count += 1


@kernel
def flood(labels: Labels, kept: Flags) -> tuple[Labels, Floats]:
    """Give pixels that are not kept to the nearest that are, over those that are not; also return how far that is."""
    rows, cols = labels.shape
    out = labels.copy()
    gone = np.empty((rows, cols))
    queue = np.empty(rows * cols, np.int64)
    waits = np.zeros((rows, cols), np.bool_)
    count = 0
    for i in range(rows):
        for j in range(cols):
            gone[i, j] = 0.0 if kept[i, j] else np.inf
            if kept[i, j] and labels[i, j] != VOID and _is_beside(kept, i, j):
                queue[count] = i * cols + j
                waits[i, j] = True
                count += 1
    _spread(labels, gone, queue, waits, count, np.inf, False, out)
    for i in range(rows):
        for j in range(cols):
            if gone[i, j] == np.inf:
                gone[i, j] = 0.0  # out of reach: between void pixels
    return out, gone


@verb
def _is_beside(kept: Flags, i: int, j: int) -> bool:
    """Whether one of the eight pixels around is not kept."""
    for a in range(max(i - 1, 0), min(i + 2, kept.shape[0])):
        for b in range(max(j - 1, 0), min(j + 2, kept.shape[1])):
            if not kept[a, b]:
                return True
    return False


@kernel
def rounded(labels: Labels, changed: Flags, stays: Flags, reach: float, width: float) -> Labels:
    """Give pixels within reach of changed ones to the label that is densest there, in a bell of a width."""
    rows, cols = labels.shape
    out = labels.copy()
    margin = int(np.ceil(BELL_ENDS * width))
    bell = np.empty(margin + 1)
    for k in range(margin + 1):
        bell[k] = np.exp(-0.5 * (k / width) ** 2)
    near = _widened(changed, int(np.ceil(reach)))
    side = TILE + 2 * margin
    rowwise, dense, best = np.empty((side, TILE)), np.empty((TILE, TILE)), np.empty((TILE, TILE))
    present = np.empty(side * side, np.int32)
    for top in range(0, rows, TILE):
        for left in range(0, cols, TILE):
            low, high = min(top + TILE, rows), min(left + TILE, cols)
            if not _any_in(near, top, low, left, high):
                continue
            n = _labels_in(
                labels,
                max(top - margin, 0),
                min(low + margin, rows),
                max(left - margin, 0),
                min(high + margin, cols),
                present,
            )
            if n < 2:
                continue
            for a in range(low - top):
                for b in range(high - left):
                    best[a, b] = -1.0
            for k in range(n):
                _density(labels, present[k], top, low, left, high, margin, bell, rowwise, dense)
                for a in range(low - top):
                    for b in range(high - left):
                        i, j = top + a, left + b
                        value = dense[a, b] * (1.0 + 1e-9 * (present[k] == labels[i, j]))
                        if near[i, j] and not stays[i, j] and value > best[a, b]:
                            best[a, b] = value
                            out[i, j] = present[k]
    return out


@verb
def _widened(flags: Flags, reach: int) -> Flags:
    """Flag the squares around flagged pixels."""
    rows, cols = flags.shape
    flat, along, wide = flags.ravel(), np.zeros(rows * cols, np.bool_), np.zeros(rows * cols, np.bool_)
    for i in range(rows):
        _widen_line(flat, i * cols, 1, cols, reach, along)
    for j in range(cols):
        _widen_line(along, j, cols, rows, reach, wide)
    return wide.reshape(rows, cols)


@verb
def _widen_line(flags: Flags, first: int, step: int, n: int, reach: int, out: Flags) -> None:
    """Flag what is within `reach` of a flagged one, among the n pixels from `first` on, `step` apart."""
    last = -(reach + 1)
    for k in range(n):
        if flags[first + k * step]:
            last = k
        out[first + k * step] = k - last <= reach
    last = n + reach + 1
    for k in range(n - 1, -1, -1):
        if flags[first + k * step]:
            last = k
        out[first + k * step] |= last - k <= reach


@verb
def _any_in(flags: Flags, top: int, low: int, left: int, high: int) -> bool:
    for i in range(top, low):
        for j in range(left, high):
            if flags[i, j]:
                return True
    return False


@verb
def _labels_in(labels: Labels, top: int, low: int, left: int, high: int, present: Labels) -> int:
    """List the labels of a part of the picture but `VOID`, ascending."""
    n, last = 0, VOID
    for i in range(top, low):
        for j in range(left, high):
            value = labels[i, j]
            if value == last or value == VOID:
                continue
            last = value
            at = 0
            while at < n and present[at] < value:
                at += 1
            if at == n or present[at] != value:
                for k in range(n, at, -1):
                    present[k] = present[k - 1]
                present[at] = value
                n += 1
    return n


@verb
def _density(
    labels: Labels,
    label: int,
    top: int,
    low: int,
    left: int,
    high: int,
    margin: int,
    bell: Floats,
    rowwise: Floats,
    dense: Floats,
) -> None:
    """Weigh the pixels of a label around each pixel of a tile; the picture goes on beyond its border as a mirror."""
    rows, cols = labels.shape
    for i in range(top - margin, low + margin):
        r = -1 - i if i < 0 else (2 * rows - 1 - i if i >= rows else i)
        r = min(max(r, 0), rows - 1)
        for j in range(left, high):
            total = 0.0
            for k in range(-margin, margin + 1):
                c = j + k
                c = -1 - c if c < 0 else (2 * cols - 1 - c if c >= cols else c)
                c = min(max(c, 0), cols - 1)
                if labels[r, c] == label:
                    total += bell[abs(k)]
            rowwise[i - top + margin, j - left] = total
    for i in range(low - top):
        for j in range(high - left):
            total = 0.0
            for k in range(-margin, margin + 1):
                total += bell[abs(k)] * rowwise[i + margin + k, j]
            dense[i, j] = total


def _balanced(labels: Labels, stays: Flags, width: float) -> Labels:
    """Give each pixel to the material that is densest around it, with weights that leave each its area.

    Where densities are flat a little more weight takes all of them: the weights whose areas are nearest count.
    """
    materials, number = np.unique(labels[labels != VOID], return_counts=True)
    if 4 * len(materials) * labels.size > MOST_BYTES or len(materials) < 2:
        return labels
    density = np.stack(
        [gaussian_filter((labels == m).astype(np.float32), width, truncate=BELL_ENDS) for m in materials]
    )
    free = ~stays
    held = np.array([np.count_nonzero(stays & (labels == m)) for m in materials])
    weight, best, least = np.ones(len(materials), np.float32), np.zeros(labels.shape, np.int64), np.inf
    for power in POWER * CALMER ** np.arange(BALANCES):
        winner = (density * weight[:, None, None]).argmax(axis=0)
        present = np.bincount(winner[free], minlength=len(materials)) + held
        if (off := np.abs(present - number).sum()) < least:
            best, least = winner, off
        weight *= ((number / np.maximum(present, 1)) ** power).astype(np.float32)
        weight /= weight.max()
    return np.where(free, materials[best], labels).astype(np.int32)


def _accounts(before: Labels, after: Labels, times: int, options: AbsorbOptions) -> tuple[Absorption, ...]:
    """Tell for each material what it lost and gained."""
    root = _roots(
        labelled_clusters(before, corner_rule(options.policy, options.step * times)).parent.astype(np.int64).ravel()
    )
    stays = (before == after).ravel() & (before != VOID).ravel()
    is_left = np.zeros(before.size, bool)
    is_left[root[stays]] = True
    first = np.unique(root[(before != VOID).ravel()])
    label = before.ravel()[first]
    rows = []
    for m in np.unique(label).tolist():
        mine = label == m
        was, now = before == m, after == m
        rows.append(
            Absorption(
                m,
                int(np.count_nonzero(mine)),
                int(np.count_nonzero(mine & ~is_left[first])),
                *(int(np.count_nonzero(x)) // times**2 for x in (was, was & ~now, now & ~was)),
            )
        )
    return tuple(rows)
