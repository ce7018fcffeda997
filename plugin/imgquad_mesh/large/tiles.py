"""A picture larger than one machine, meshed tile by tile to one conforming mesh."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.model import QuadMesh
from imgquad_core.options import MeshOptions
from imgquad_core.reading import Calibration
from imgquad_core.tiles import ROUNDS, Job, Source, attempts, grid_of, groups_of, source_of, stamp_of
from imgquad_core.tiles import tasks as work
from imgquad_core.tiles.files import save_plane
from imgquad_core.tiles.grid import least_tile
from imgquad_core.tiles.meshes import TileMesh, welded
from imgquad_mesh import outputs

from .cluster import opened, run_steps
from .decks import Deck
from .graph import Failed, Result, Step, Told, as_delayed, call
from .plan import digest_of_text, options_as_json, start_plan
from .tile_files import write_collected, write_piece
from .tile_report import report_of

FORMATS = ("pvtu", "vtkhdf")


@dataclass(frozen=True)
class TiledMesh:
    """A mesh in tiles, of which parts are read when they are asked for.

    Parameters
    ----------
    path : Path
        What shows the whole: ``mesh.pvtu`` or ``mesh.vtkhdf``.
    report : mapping
        All figures, as in ``report.json`` beside it.
    job : Job
        What was done to what.
    """

    path: Path
    report: Mapping[str, Any]
    job: Job

    def __getitem__(self, place: tuple[int, int]) -> QuadMesh:
        """Return the mesh of the tile in a row and column of the grid."""
        row, column = place
        grid = self.job.grid
        if not (0 <= row < grid.down and 0 <= column < grid.across):
            raise InputError(
                f"there is no tile {row}, {column}: rows are 0 to {grid.down - 1}, columns 0 to {grid.across - 1}"
            )
        return self._traced(_read_tile(self.job, row * grid.across + column))

    def box(self, left: int, upper: int, right: int, lower: int) -> QuadMesh:
        """Return the quads whose middle is in a part of the picture: bounds in pixels from its upper left corner."""
        grid = self.job.grid
        reach = grid.clipped((left, upper, right, lower), max(grid.keep, grid.reach))
        parts = []
        for t in grid.tiles_in(reach):
            part, label = _read_tile(self.job, t)
            x, y = part.points[part.quads].mean(axis=1).T if len(part.quads) else np.empty((2, 0))
            y = grid.shape[0] - y
            inside = (x >= left) & (x < right) & (y >= upper) & (y < lower)
            parts.append((part._replace(quads=part.quads[inside], region=part.region[inside]), label[inside]))
        return self._traced(_together(parts))

    def mesh(self) -> QuadMesh:
        """Return the whole mesh: of some 200 bytes a quad, in memory."""
        return self._traced(_together([_read_tile(self.job, t) for t in range(self.job.grid.n_tiles)]))

    def _traced(self, part: tuple[TileMesh, Any]) -> QuadMesh:
        """Return quads as a mesh with its boundaries, in the unit of the options."""
        mesh, label = part
        if len(mesh.quads) == 0:
            raise InputError("there is nothing to mesh in this part: give another one")
        options = self.job.options
        made = core.tracing.trace_mesh(mesh.points, mesh.quads, label, self.job.rules().legend.materials)
        return made.scaled(options.pixel_sides).moved(options.corner)


def _read_tile(job: Job, t: int) -> tuple[TileMesh, Any]:
    found = work.final_mesh(job, t)
    seam = np.zeros(len(found["points"]), bool)
    return TileMesh(found["points"], found["quads"], found["region"], seam), found["label"]


def _together(parts: Sequence[tuple[TileMesh, Any]]) -> tuple[TileMesh, Any]:
    """Put tiles together, one node at each place."""
    shift = np.cumsum([0, *(len(part.points) for part, _ in parts)])
    columns = zip(*(part for part, _ in parts), strict=True)
    points, _, region, seam = (np.concatenate(column) for column in columns)
    quads = np.concatenate([part.quads + s for (part, _), s in zip(parts, shift, strict=False)])
    return welded(TileMesh(points, quads, region, seam)), np.concatenate([label for _, label in parts])


def mesh_tiles(
    source: Any,
    output: str | Path,
    options: MeshOptions | None = None,
    *,
    tile: int = 4096,
    keep_whole: int = 256,
    form: str = "pvtu",
    deck: str | Path | None = None,
    deck_options: Mapping[str, Any] | None = None,
    workers: int = 1,
    scheduler: str | None = None,
    client: Any = None,
    restart: bool = False,
    compute: bool = True,
    told: Told = lambda kind: None,
) -> Any:
    """Mesh a picture tile by tile to one conforming mesh.

    Parameters
    ----------
    source : path or array
        A file (.npy, .zarr, tiled TIFF, pyramid; others are decoded as a whole), or an array of NumPy or Dask,
        (rows, columns) or (rows, columns, 3).
    output : path
        A folder for all files.
    options : MeshOptions, optional
        As for one picture, without tolerance, periodic, marks, colours "regions", and with square pixels.
    tile : int
        Side of a tile, px.
    keep_whole : int
        Regions in a box of this side belong to one tile, px; only larger ones are cut where they leave a tile.
    form : "pvtu" or "vtkhdf"
        How the whole is written.
    deck : path, optional
        File for a solver, of the whole mesh with all sets, in a format that its extension names. It can be asked for
        when the mesh is there already.
    deck_options : mapping, optional
        Of its writer, as of `imgquad_core.writers.write_abaqus`.
    workers, scheduler, client, restart, compute, told
        As for `mesh_stack`.

    Returns
    -------
    TiledMesh or dask.delayed.Delayed

    Raises
    ------
    InputError
        The picture or an option cannot be used, the folder is of another plan, or memory does not do for a tile.

    Notes
    -----
    The mesh hangs on the picture, the options and the grid (`tile`, `keep_whole`), not on the workers.
    """
    folder, options = Path(output), options or MeshOptions()
    made_for = Deck.of(deck, deck_options)
    _check(options, form)
    keep = int(keep_whole)
    plan = {
        "what": "tiles",
        "source": _named(source),
        "tile": tile,
        "keep-whole": keep,
        "format": form,
        "options": options_as_json(options),
    }
    start_plan(folder, plan, restart)
    job, stored = _job_of(source, folder, options, tile, keep)
    steps = [*_steps(job, stored, form), *(_set_steps(job) if made_for and made_for.is_mapped else ())]
    rows, pieces = ([Result(f"{kind}-{t}") for t in range(job.grid.n_tiles)] for kind in ("finish", "piece"))
    needs = [Result(step.key) for step in steps if step.key.startswith("sets-")]
    end = Step("end", _finished, (job, rows, pieces, form, made_for, Result("counts"), needs))
    if not compute:
        return as_delayed([*steps, end])[end.key]
    with opened(workers, scheduler, client) as used:
        done = run_steps(steps, used, told)
    _assert_done(job, steps, done)
    return call(end, done)


def _check(options: MeshOptions, form: str) -> None:
    """Refuse what only a picture as a whole can be given, before any work is done."""
    if form not in FORMATS:
        raise InputError(f"format is {form}: give {' or '.join(FORMATS)}")
    refused = {
        "tolerance": options.tolerance > 0.0,
        "periodic": options.periodic != "none",
        "frame": options.frame is not None,
    }
    for name, is_given in refused.items():
        if is_given:
            raise InputError(f"{name} is {getattr(options, name)}, which tiles do not have: leave it out")
    sides = options.pixel_sides
    if sides[0] != sides[1]:
        raise InputError(f"pixel_size is {sides}, but tiles need square pixels: resample the picture")


def _named(source: Any) -> Any:
    """Return what tells a source from others in a plan."""
    if isinstance(source, (str, Path)):
        path = Path(source)
        if not path.exists():
            raise InputError(f"there is no picture {path}: give a file, or a folder of Zarr")
        return [str(path.resolve()), stamp_of(path)]
    if hasattr(source, "__dask_graph__"):
        return ["dask", str(source.name)]
    values = np.ascontiguousarray(source)
    return ["array", digest_of_text(str(values.shape), values.dtype.str, values.tobytes().hex())]


def _job_of(source: Any, folder: Path, options: MeshOptions, tile: int, keep: int) -> tuple[Job, Any]:
    """Return the job, and what must be computed before its source can be read."""
    inside = folder / "work"
    inside.mkdir(exist_ok=True)
    found, stored = _source_of(source, inside, options)
    if options.crop is not None:
        found = found.cropped(options.crop)
    placed = options.placed(found.calibration, found.name)
    _check(placed, FORMATS[0])
    return Job(str(inside), found, grid_of(found.shape, tile, keep, work.largest_size(options)), placed), stored


def _source_of(source: Any, inside: Path, options: MeshOptions) -> tuple[Source, Any]:
    reading = replace(options, crop=None).reading()  # windows of the crop are read
    if isinstance(source, (str, Path)):
        return source_of(Path(source), reading, inside / "source.npy"), None
    shape = tuple(source.shape)
    if len(shape) not in (2, 3) or (len(shape) == 3 and shape[2] > 4):
        raise InputError(f"the array has the shape {shape}: give (rows, columns) or (rows, columns, 1 to 4)")
    is_dask = hasattr(source, "__dask_graph__")
    path = inside / ("source.zarr" if is_dask else "source.npy")
    made = Source(str(path), (int(shape[0]), int(shape[1])), "the array", reading, Calibration())
    if not is_dask:
        if not path.exists():
            save_plane(path, np.asarray(source))
        return made, None
    if (inside / "rules.json").exists():  # whoever has looked at it, had all of it
        return made, None
    even = source.rechunk((1024, 1024, *shape[2:]))
    return made, even.to_zarr(str(path), overwrite=True, compute=False)


def _steps(job: Job, stored: Any, form: str) -> Iterator[Step]:
    """Give all steps, each behind those that it needs."""
    grid, every = job.grid, range(job.grid.n_tiles)

    def after(kind: str, tiles: Sequence[int]) -> list[Result]:
        return [Result(f"{kind}-{t}") for t in tiles]

    yield Step("look", _look, (job, stored))
    for t in every:
        yield Step(f"tally-{t}", Guarded(work.tally), (job, t, Result("look")))
    yield Step("rules", work.decide, (job, Result("look"), after("tally", every)))
    for t in every:
        yield Step(f"labels-{t}", Guarded(work.labels), (job, t, Result("rules")))
    for t in every:
        yield Step(f"regions-{t}", Guarded(work.regions), (job, t, after("labels", grid.around(t))))
    yield Step("join", work.join, (job, after("regions", every)))
    for t in every:
        yield Step(f"route-{t}", Guarded(work.route), (job, t, Result("join")))
    for t in every:
        yield Step(f"outlines-{t}", Guarded(work.outlines), (job, t, after("route", grid.seen_by(t))))
    for t in every:
        yield Step(f"mesh-{t}-0", Guarded(attempts.mesh), (job, t, 0, after("outlines", grid.around(t))))
    yield Step("strides", attempts.strides, (job, [Result(f"mesh-{t}-0") for t in every]))
    for k in range(1, attempts.ATTEMPTS):
        for t in every:
            needs = [Result("strides"), *(Result(f"mesh-{other}-{k - 1}") for other in grid.around(t))]
            yield Step(f"mesh-{t}-{k}", Guarded(attempts.mesh), (job, t, k, needs))
    yield from _band_steps(job)
    for t in every:
        bands = [Result(_band_key(*band)) for band in work.bands_of(grid, t, len(ROUNDS))]
        yield Step(f"finish-{t}", Guarded(work.finish), (job, t, [Result(_meshed_key(t)), *bands]))
    for t in every:
        yield Step(f"number-{t}", Guarded(work.number), (job, t, after("finish", grid.around(t))))
    yield Step("counts", list, (after("number", every),))
    for t in every:
        yield Step(f"piece-{t}", Guarded(write_piece), (job, t, Result("counts"), form))


def _set_steps(job: Job) -> Iterator[Step]:
    """Give the steps that find all sets for a solver's file."""
    for t in range(job.grid.n_tiles):
        yield Step(f"ring-{t}", Guarded(work.ring), (job, t, Result("counts")))
    for t in range(job.grid.n_tiles):
        rings = [Result(f"ring-{other}") for other in job.grid.around(t)]
        yield Step(f"sets-{t}", Guarded(work.sets), (job, t, Result("counts"), rings))


def _band_steps(job: Job) -> Iterator[Step]:
    for k, kind in enumerate(ROUNDS):
        for group in groups_of(job.grid, kind):
            before = dict.fromkeys(_band_key(*band) for t in group for band in work.bands_of(job.grid, t, k))
            needs = [Result(key) for key in (*map(_meshed_key, group), *before)]
            yield Step(_band_key(kind, group), Guarded(work.band), (job, kind, group, needs))


def _band_key(kind: str, group: tuple[int, ...]) -> str:
    return "-".join(["band", kind, *map(str, group)])


def _meshed_key(t: int) -> str:
    return f"mesh-{t}-{attempts.ATTEMPTS - 1}"


def _look(job: Job, _stored: Any) -> int:
    return work.look(job)


class Guarded:
    """A step of a tile that says which one it was where memory does not do for it. Pickled by what it calls."""

    def __init__(self, call: Any) -> None:
        self.call = call

    def __call__(self, job: Job, *args: Any) -> Any:
        """Do the step."""
        try:
            return self.call(job, *args)
        except MemoryError as error:
            where = args[0] if isinstance(args[0], int) else args[1][0]
            raise InputError(out_of_memory(job, where)) from error


def out_of_memory(job: Job, t: int) -> str:
    """Say for which tile memory does not do, and what would."""
    grid = job.grid
    smaller = max(grid.tile // 2, least_tile(grid.keep, work.largest_size(job.options)))
    row, column = grid.place(t)
    remedy = f"--tile {smaller} (about {smaller**2 / grid.tile**2:.0%} of it), or " if smaller < grid.tile else ""
    return f"memory does not do for tile {row}, {column} of {grid.tile} px: give {remedy}fewer workers"


def _assert_done(job: Job, steps: Sequence[Step], done: Mapping[str, Any]) -> None:
    """Raise for the first step whose worker was killed."""
    for step in steps:
        if isinstance(done[step.key], Failed):
            tiles = [int(part) for part in step.key.split("-") if part.isdigit()]
            raise InputError(f"{out_of_memory(job, tiles[0] if tiles else 0)} ({step.key}: {done[step.key].reason})")


def _finished(
    job: Job,
    rows: Sequence[Mapping[str, Any]],
    pieces: Sequence[Any],
    form: str,
    deck: Deck | None,
    counts: Sequence[tuple[int, int]],
    _sets: Sequence[Any],
) -> TiledMesh:
    """Write what shows the whole, the report, and the deck."""
    folder = Path(job.folder).parent
    path = folder / f"mesh.{form}"
    report = report_of(job, rows, path)
    write_collected(job, pieces, path)
    made = TiledMesh(path, report, job)
    if deck is not None:
        deck.write(job, counts, made.mesh)
        report["deck"] = str(deck.path)
    outputs.write_json(report, folder / "report.json")
    return made
