"""The steps of a picture in tiles: pure functions of files with fixed names, each written whole or not at all.

    look       once          labels or shades, from a sample
    tally      tile          distinct values, if they are labels
    rules      once          the legend, the limits of noise, the width of data points
    labels     tile          materials without noise
    regions    tile          its regions, and once more: those of the picture, whole or cut
    route      tile          where it and the next ones part the latter
    outlines   tile          smoothed chains around its faces
    mesh       tile          quads; again where shared edges are to be halved, or a piece is on too wide a stride
    strides    once          after the first time: the widest that no piece of a cut region is poor on
    band       2, 4 tiles    clean-up across seams, in three rounds
    finish     tile          all patches in, its share of the report
    number     tile          which nodes are its own
    ring       tile          for a solver's file: the quads around its rim, for its neighbours
    sets       tile          the same: sets of its own nodes and quads

What is there already is kept, so a run that was stopped goes on. Whoever is asked first for what another step leaves
must be given it: steps take what must be done before as arguments that they do not look at.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from imgquad_core.arrays import Floats, Ints, Labels
from imgquad_core.cleanup.strips import pieces_at
from imgquad_core.errors import InputError
from imgquad_core.fe import FEMesh
from imgquad_core.measures.quality import quad_areas, scaled_jacobian
from imgquad_core.model import VOID
from imgquad_core.options import MeshOptions
from imgquad_core.picture import (
    counts_labels,
    drop_materials,
    label_by,
    legend_of,
    remove_in_order,
    sample_of,
    tally_labels,
)
from imgquad_core.whole_files import replacing

from .attempts import last_mesh
from .bands import ROUNDS, cleaned_band, groups_of, seam_places
from .elements import COLUMNS, Mapped, Ring, as_arrays, joined_sets, named_elements, ring_of, tile_sets
from .files import load_arrays, save_arrays, save_plane
from .grid import Box, Grid
from .job import Job
from .meshes import Patch, TileMesh, open_nodes, patched
from .numbering import Own, Rim, first_numbers, numbers_of, owned
from .outlines import Outlines, outlines_of
from .regions import Table, joined_regions, keys_of, tile_regions
from .routes import Ends, side_of_route
from .rules import rules_of, save_rules
from .sources import sample_boxes
from .windows import labels_in, numbers_in, parts_with_routes, regions_of

NOISE_REACH = 64  #: px around a tile that noise removal sees, beside the shortest length that stays
CORNER_REACH = 5  #: data points around a tile that tell what is joined over corners
BINS = 1000  #: of scaled Jacobians from 0 to 1


# ------------------------------------------------------------------------------------------------------- labels


def look(job: Job) -> int:
    """Return how many values the picture may have to be labels, 0 if it holds shades or that is decided already."""
    if (Path(job.folder) / "rules.json").exists():
        return 0
    return counts_labels(_sample(job), job.options.segmentation())


def tally(job: Job, t: int, most: int) -> Any:
    """Count the values of a tile; an empty text where there is nothing to count."""
    if most == 0:
        return ""
    return tally_labels(job.source.read(job.grid.box(t)), most, job.options.segmentation())


def decide(job: Job, most: int, tallies: Sequence[Any]) -> None:
    """Decide what holds for all tiles."""
    path = Path(job.folder) / "rules.json"
    if path.exists():
        return
    sample, how = _sample(job), job.options.segmentation()
    legend = legend_of(sample, list(tallies) if most else [], how)
    image = label_by(job.source.read(sample_boxes(job.grid.shape)[0]), legend, how).image
    save_rules(path, "", rules_of(legend, image, job.grid.shape, job.options))


def _sample(job: Job) -> Any:
    return sample_of([job.source.read(box) for box in sample_boxes(job.grid.shape)])


def labels(job: Job, t: int, *_: Any) -> None:
    """Find the materials of a tile, without noise."""
    path = job.path("labels", t).with_suffix(".npy")
    if path.exists() and job.path("pixels", t).exists():
        return
    rules, box = job.rules(), job.grid.box(t)
    noise = rules.noise
    window = job.grid.box(t, NOISE_REACH + int(noise.min_length) if noise.removes else 4)
    how = rules.options.segmentation()
    raw = label_by(job.source.read(window), rules.legend, how, may_be_void=True).image
    clean = drop_materials(remove_in_order(raw, noise), rules.options.drop).labels
    before, after = _inside(raw.labels, window, box), _inside(clean, window, box)
    numbers = rules.legend.materials.labels
    save_plane(path, np.ascontiguousarray(after))
    save_arrays(job.path("pixels", t), before=_counts(before, numbers), after=_counts(after, numbers))


def _inside(values: Labels, window: Box, box: Box) -> Labels:
    left, upper = window[:2]
    return values[box[1] - upper : box[3] - upper, box[0] - left : box[2] - left]


def _counts(values: Labels, numbers: Labels) -> Ints:
    return np.bincount(np.searchsorted(numbers, values[values != VOID]), minlength=len(numbers))


# ------------------------------------------------------------------------------------------------------ regions


def regions(job: Job, t: int, *_: Any) -> None:
    """Number the regions of a tile."""
    path = job.path("ids", t).with_suffix(".npy")
    if path.exists() and job.path("regions", t).exists():
        return
    rules, box = job.rules(), job.grid.box(t)
    extended = job.grid.clipped((box[0], box[1], box[2] + 1, box[3] + 1))
    reach = int(CORNER_REACH * max(rules.step)) + 1
    window = job.grid.clipped((extended[0] - reach, extended[1] - reach, extended[2] + reach, extended[3] + reach))
    found = tile_regions(labels_in(job, window), window, box, extended, job.grid.shape[1], rules.extraction)
    save_plane(path, found.ids)
    save_arrays(job.path("regions", t), **found.table._asdict())


def join(job: Job, *_: Any) -> None:
    """Find the regions of the picture."""
    path = job.path("regions")
    if path.exists():
        return
    tiles = [Table(**load_arrays(job.path("regions", t))) for t in range(job.grid.n_tiles)]
    save_arrays(path, **joined_regions(job.grid, tiles)._asdict())


def route(job: Job, t: int, *_: Any) -> None:
    """Find where a tile and those below and beside it part regions that are cut."""
    path = job.path("route", t)
    if path.exists():
        return
    grid, every, found = job.grid, regions_of(job), {}
    for axis in (0, 1):
        box = grid.corridor(t, axis)
        if box is not None:
            numbers = numbers_in(job, box, every)
            line = grid.box(grid.next_to(t, axis))[1 - axis] - box[1 - axis]
            ends, size = Ends(*grid.meets_others(t, 1 - axis)), largest_size(job.options)
            beyond = side_of_route(numbers.T if axis == 0 else numbers, every.is_cut, line, ends, size)
            found[f"beyond-{axis}"] = beyond.T if axis == 0 else beyond
    save_arrays(path, **found)


# ---------------------------------------------------------------------------------------------- chains and quads


def outlines(job: Job, t: int, *_: Any) -> None:
    """Smooth the chains around the faces of a tile."""
    path = job.path("outlines", t)
    if path.exists():
        return
    rules, grid, every = job.rules(), job.grid, regions_of(job)
    window = grid.window(every.box_of(t))
    parts = parts_with_routes(job, window)
    keys = keys_of((window[3] - window[1], window[2] - window[0]), parts, grid, every)
    if not (keys.tile == t).any():
        save_arrays(path, **_no_outlines()._asdict())
        return
    smoothing = rules.options.smoothing(rules.legend.materials, rules.step)
    found = outlines_of(t, keys, window, grid.shape[0], every, rules.extraction, smoothing)
    save_arrays(path, **found._asdict())


def _no_outlines() -> Outlines:
    none = np.empty(0, np.int64)
    flags = np.empty(0, bool)
    return Outlines(
        points=np.empty((0, 2)), kind=np.empty(0, np.uint8), offsets=np.zeros(1, np.int64), ids=none,
        sides=none.reshape(0, 2), owner=none, shared=flags, closed=flags, seam=flags, key=none.reshape(0, 4),
        node=none.reshape(0, 4), region=none, label=np.empty(0, np.int32), pixels=none, window=np.zeros(4, np.int64),
    )  # fmt: skip


def band(job: Job, kind: str, group: tuple[int, ...], *_: Any) -> None:
    """Clean up across the seams of a group of tiles."""
    path = job.path(f"band-{kind}", *group)
    if path.exists():
        return
    before = ROUNDS.index(kind)
    places = seam_places(job.grid, kind, group, largest_size(job.options))
    patches = cleaned_band(job.grid, group, [_state(job, t, before) for t in group], places)
    named = {f"{name}-{k}": value for k, patch in enumerate(patches) for name, value in patch._asdict().items()}
    save_arrays(path, **named)


def largest_size(options: MeshOptions) -> float:
    """Return the largest edge length that is asked for."""
    return max(options.size, *options.material_sizes.values()) if options.material_sizes else options.size


def bands_of(grid: Grid, t: int, rounds: int) -> list[tuple[str, tuple[int, ...]]]:
    """Return the bands of the first rounds that a tile is part of, in their order."""
    return [(kind, group) for kind in ROUNDS[:rounds] for group in groups_of(grid, kind) if t in group]


def _state(job: Job, t: int, rounds: int) -> TileMesh:
    """Return the mesh of a tile after some rounds of bands."""
    found = last_mesh(job, t)
    for kind in ROUNDS[:rounds]:
        patches = []
        for group in (group for each, group in bands_of(job.grid, t, rounds) if each == kind):
            arrays, k = load_arrays(job.path(f"band-{kind}", *group)), group.index(t)
            patches.append(Patch(*(arrays[f"{name}-{k}"] for name in Patch._fields)))
        found = patched(found, [patch for patch in patches if len(patch.gone) or len(patch.quads)])
    return found


# ------------------------------------------------------------------------------------------------------- the end


def finish(job: Job, t: int, *_: Any) -> dict[str, Any]:
    """Put all patches in; return the tile's share of the report."""
    path = job.path("final", t)
    report = Path(job.folder) / f"final-{t}.json"
    if not (path.exists() and report.exists()):
        made = _state(job, t, len(ROUNDS))
        label = regions_of(job).label[made.region]
        rim = open_nodes(made)
        areas = quad_areas(made.points, made.quads) if len(made.quads) else np.empty(0)
        ids, at = np.unique(made.region, return_inverse=True)
        in_regions = np.bincount(at.ravel(), areas, len(ids)) if len(ids) else np.empty(0)
        save_arrays(
            path, points=made.points, quads=made.quads, region=made.region, label=label, rim=rim,
            regions=ids, areas=in_regions,
        )  # fmt: skip
        with replacing(report) as temporary:
            temporary.write_text(json.dumps(_share(job, t, made, label, rim, areas)), encoding="utf-8")
    found: dict[str, Any] = json.loads(report.read_text(encoding="utf-8"))
    return found


def _share(job: Job, t: int, made: TileMesh, label: Labels, rim: Ints, areas: Floats) -> dict[str, Any]:
    """Return the figures of a tile."""
    sj = scaled_jacobian(made.points, made.quads) if len(made.quads) else np.empty(0)
    valence = np.bincount(made.quads.ravel(), minlength=len(made.points))
    inner = np.ones(len(made.points), bool)
    inner[rim] = inner[_between(made, label)] = False
    pixels, numbers = load_arrays(job.path("pixels", t)), job.rules().legend.materials.labels
    return {
        "tile": list(job.grid.place(t)),
        "quads": len(made.quads),
        "nodes": len(made.points),
        "min_sj": float(sj.min(initial=1.0)),
        "sum_sj": float(sj.sum()),
        "bins": np.bincount(np.clip(sj * BINS, 0, BINS - 1).astype(int), minlength=BINS).tolist(),
        "inner_nodes": int(inner.sum()),
        "irregular": int((inner & (valence != 4)).sum()),
        "pixels": pixels["before"].tolist(),
        "clean_pixels": pixels["after"].tolist(),
        "areas": [float(areas[label == number].sum()) for number in numbers],
        "quads_of": [int(np.count_nonzero(label == number)) for number in numbers],
    }


def _between(made: TileMesh, label: Labels) -> Ints:
    """Return the nodes that quads of several materials have."""
    return np.flatnonzero(pieces_at(label.astype(np.int64), made.quads, len(made.points))[1])


def final_mesh(job: Job, t: int) -> dict[str, Any]:
    """Return points, quads, region and label of a tile as it is in the end."""
    return load_arrays(job.path("final", t))


def number(job: Job, t: int, *_: Any) -> tuple[int, int]:
    """Find a tile's own nodes; return how many there are, and its number of quads."""
    path = job.path("own", t)
    found = final_mesh(job, t)
    if not path.exists():
        rims = {other: _rim(job, other) for other in job.grid.around(t) if other <= t}
        save_arrays(path, **owned(t, len(found["points"]), rims)._asdict())
    return int(np.count_nonzero(load_arrays(path)["is_own"])), len(found["quads"])


def _rim(job: Job, t: int) -> Rim:
    found = final_mesh(job, t)
    return Rim(found["rim"], found["points"][found["rim"]])


def node_numbers(job: Job, t: int, first: Ints) -> Ints:
    """Return the number of each node of a tile in the whole picture."""
    lower = [other for other in job.grid.around(t) if other <= t]
    owns = {other: Own(**load_arrays(job.path("own", other))) for other in lower}
    return numbers_of(t, owns[t], {other: _rim(job, other) for other in lower}, owns, first)


# ------------------------------------------------------------------------------------------- for a solver's file


def ring(job: Job, t: int, counts: Sequence[tuple[int, int]]) -> None:
    """Leave the quads around the rim of a tile to its neighbours, with numbers of the whole picture."""
    path = job.path("ring", t)
    if not path.exists():
        whole = _numbered(job, t, counts)
        rim = np.zeros(len(whole.node), bool)
        rim[final_mesh(job, t)["rim"]] = True
        save_arrays(path, **ring_of(whole, rim)._asdict())


def _numbered(job: Job, t: int, counts: Sequence[tuple[int, int]]) -> Ring:
    """Return all quads of a tile, with numbers of the whole picture."""
    found = final_mesh(job, t)
    node = node_numbers(job, t, first_numbers(counts))
    return Ring(node[found["quads"]], found["region"], found["label"], node, found["points"])


def sets(job: Job, t: int, counts: Sequence[tuple[int, int]], *_: Any) -> None:
    """Find the sets of a tile's own nodes and quads."""
    path = job.path("sets", t)
    if path.exists():
        return
    others = [Ring(**load_arrays(job.path("ring", other))) for other in job.grid.around(t) if other != t]
    first = first_numbers(counts)
    own_nodes, first_quad = range(first[t], first[t + 1]), sum(quads for _, quads in counts[:t])
    box = np.array([(0.0, 0.0), job.grid.shape[::-1]])
    save_arrays(path, **as_arrays(tile_sets(_numbered(job, t, counts), others, own_nodes, first_quad, box)))


def elements(job: Job, counts: Sequence[tuple[int, int]], folder: Path) -> FEMesh:
    """Return the elements of the whole picture in the unit of the options, of arrays that are mapped in a folder.

    Raises
    ------
    InputError
        There are no quads.
    """
    if not sum(quads for _, quads in counts):
        raise InputError("the mesh has no quads: nothing to write; was every material dropped?")
    mapped = Mapped(folder, COLUMNS)
    for t in range(job.grid.n_tiles):
        whole, is_own = _numbered(job, t, counts), load_arrays(job.path("own", t))["is_own"]
        mapped.append(
            points=whole.points[is_own] * job.options.pixel_sides + job.options.corner,
            cells=whole.quads, cell_material=whole.label, cell_region=whole.region,
            point_kind=load_arrays(job.path("sets", t))["kind"],
        )  # fmt: skip
    found = joined_sets(load_arrays(job.path("sets", t)) for t in range(job.grid.n_tiles))
    return named_elements(mapped, found, job.rules().legend.materials)
