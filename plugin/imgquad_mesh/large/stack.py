"""A stack of pictures of one thing, meshed slice by slice by one rule: materials are alike in all.

look     each slice        a fingerprint of what it holds, or why it cannot be read
sample   once              labels or shades?
tally    each slice        its distinct values, if they are labels
rules    once              the legend, the limits of noise, the width of data points
mesh     each slice        its mesh and its share of the report, in files; kept if it is there already
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple
from xml.sax.saxutils import quoteattr

import pyvista as pv

import imgquad_core as core
from imgquad_core.errors import ImgquadError, InputError
from imgquad_core.options import MeshOptions
from imgquad_core.picture import counts_labels, crop_image, label_by, legend_of, sample_of, tally_labels
from imgquad_core.reading import Picture
from imgquad_core.reading.picture import part_of
from imgquad_core.tiles import Rules, legend_as_json, load_rules, rules_of, save_rules
from imgquad_core.tiles.sources import MOST_SAMPLED, SPREAD, WINDOWS
from imgquad_mesh import datasets, outputs

from .cluster import opened, run_steps
from .graph import Failed, Result, Step, Told, as_delayed, call
from .plan import digest_of, digest_of_text, options_as_json, start_plan
from .slices import Slice, read_slice, slices_of

RULES = "rules.json"


@dataclass(frozen=True)
class StackResult:
    """What became of a stack.

    Parameters
    ----------
    path : Path
        The collection of all meshes, ``.pvd``.
    report : mapping
        All figures, as in the ``.json`` beside it.
    """

    path: Path
    report: Mapping[str, Any]

    @property
    def failed(self) -> tuple[tuple[str, str], ...]:
        """Slices that have no mesh, and why."""
        return tuple((row["slice"], row["error"]) for row in self.report["slices"] if "error" in row)

    def __len__(self) -> int:
        return len(self.report["slices"])

    def __getitem__(self, k: int) -> pv.UnstructuredGrid:
        """Return the mesh of a slice, read from its file."""
        row = self.report["slices"][k]
        if "error" in row:
            raise InputError(f"slice {row['slice']} has no mesh: {row['error']}")
        grid = pv.read(self.path.parent / row["output"])
        assert isinstance(grid, pv.UnstructuredGrid)
        return grid


def mesh_stack(
    source: Any,
    output: str | Path,
    options: MeshOptions | None = None,
    *,
    spacing: float = 1.0,
    workers: int = 1,
    scheduler: str | None = None,
    client: Any = None,
    restart: bool = False,
    compute: bool = True,
    told: Told = lambda kind: None,
) -> Any:
    """Mesh the slices of a stack, each by itself, by one rule for all.

    Parameters
    ----------
    source : str, path, sequence of these, or array
        A pattern of files, files, one file that holds a stack, or an array of NumPy or Dask; see `slices_of`.
    output : path
        The collection, ``.pvd``; the meshes and the report lie in a folder of its name beside it.
    options : MeshOptions, optional
        As for one picture, without `frame`, `marks` and colours "regions".
    spacing : float
        Distance of slices, in the unit of the mesh: slice k lies at z = k * spacing, and at that time.
    workers : int
        Processes on this machine; 1 is this process.
    scheduler : str, optional
        Address of a scheduler of Dask, whose workers see the same files.
    client : distributed.Client, optional
        By default the current one, if there is one and `workers` is 1.
    restart : bool
        Give up what the folder holds of another plan, or of this one.
    compute : bool
        False: return a `dask.delayed` of the result, for a graph of the user's own.
    told : callable, optional
        Called with the kind of each step that ends.

    Returns
    -------
    StackResult or dask.delayed.Delayed

    Raises
    ------
    InputError
        Nothing is found, the folder is of another plan, or no slice can be read.

    Notes
    -----
    A slice is meshed anew only if its pixels, the options or the rule are others than those of its file. What is
    wrong with one slice is told in the report; the others are meshed.
    """
    output, options = Path(output), options or MeshOptions()
    _check(output, options, spacing)
    found = slices_of(source, options.reading())
    folder = output.with_suffix("")
    plan = {
        "what": "stack",
        "slices": [which.path or which.name for which in found.of],
        "spacing": spacing,
        "options": options_as_json(options),
    }
    start_plan(folder, plan, restart)
    steps = list(_steps(found.of, found.planes, options, spacing, folder))
    rows = [Result(f"mesh-{k}") for k in range(len(found.of))]
    finish = Step("finish", _finished, (rows, Result("rules"), output, found.of))
    if not compute:
        return as_delayed([*steps, finish])[finish.key]
    with opened(workers, scheduler, client) as used:
        return call(finish, run_steps(steps, used, told))


def _check(output: Path, options: MeshOptions, spacing: float) -> None:
    outputs.check_target(output, (".pvd",))
    if options.frame is not None:
        raise InputError(f"frame is {options.frame}, but all pictures of a stack are meshed: leave it out")
    if not spacing > 0.0:
        raise InputError(f"spacing is {spacing:g}: give a distance above 0")


class Look(NamedTuple):
    """What a first look at a slice says."""

    digest: str
    shape: tuple[int, int]
    error: str = ""


class Sampled(NamedTuple):
    """Parts of all slices, and how many distinct values they may have to be labels."""

    sample: Picture | None  #: None if the rules are there already
    most: int


def _steps(
    slices: Sequence[Slice], planes: Sequence[Any], options: MeshOptions, spacing: float, folder: Path
) -> Iterator[Step]:
    """Give all steps, each behind those that it needs."""
    every = range(len(slices))
    looks, tallies = ([Result(f"{kind}-{k}") for k in every] for kind in ("look", "tally"))
    for k in every:
        yield Step(f"look-{k}", _look, (slices[k], planes[k], options))
    yield Step("sample", _sample, (slices, list(planes), looks, options, folder))
    for k in every:
        yield Step(f"tally-{k}", _tally, (slices[k], planes[k], looks[k], Result("sample"), options))
    yield Step("rules", _rules, (slices, list(planes), looks, Result("sample"), tallies, options, folder))
    for k in every:
        path = folder / f"slice_{k:04d}.vtu"
        yield Step(f"mesh-{k}", _mesh, (slices[k], planes[k], looks[k], Result("rules"), k * spacing, path))


def _look(which: Slice, plane: Any, options: MeshOptions) -> Look:
    try:
        picture = read_slice(which, plane, options.reading())
        return Look(digest_of(picture), picture.shape)
    except (ImgquadError, OSError) as error:
        return Look("", (0, 0), str(error))


def _sample(
    slices: Sequence[Slice], planes: list[Any], looks: list[Look], options: MeshOptions, folder: Path
) -> Sampled:
    if load_rules(folder / RULES, _key_of(looks, options), options) is not None:
        return Sampled(None, 0)
    good = [k for k, look in enumerate(looks) if not look.error]
    if not good:
        raise InputError(f"no slice can be read: {looks[0].error}")
    boxes = _boxes([looks[k].shape for k in good])
    parts = [part_of(read_slice(slices[good[i]], planes[good[i]], options.reading()), box) for i, box in boxes.items()]
    sample = sample_of(parts)
    return Sampled(sample, counts_labels(sample, options.segmentation()))


def _boxes(shapes: Sequence[tuple[int, int]]) -> dict[int, tuple[int, int, int, int]]:
    """Return the part of each slice that belongs to the sample: all of it, or windows evenly spread in the stack."""
    if sum(rows * cols for rows, cols in shapes) <= MOST_SAMPLED:
        return {k: (0, 0, cols, rows) for k, (rows, cols) in enumerate(shapes)}
    n = min(len(shapes), WINDOWS)
    side = int((MOST_SAMPLED // n) ** 0.5)
    boxes = {}
    for i in range(n):
        k = i * len(shapes) // n
        height, width = (min(side, length) for length in shapes[k])
        top, left = (
            int((0.5 + i * SPREAD[axis]) % 1.0 * (shapes[k][axis] - (height, width)[axis] + 1)) for axis in (0, 1)
        )
        boxes[k] = (left, top, left + width, top + height)
    return boxes


def _tally(which: Slice, plane: Any, look: Look, sampled: Sampled, options: MeshOptions) -> Any:
    """Count the values of a slice; an empty text where there is nothing to count."""
    if look.error or sampled.most == 0:
        return ""
    return tally_labels(read_slice(which, plane, options.reading()), sampled.most, options.segmentation())


def _rules(
    slices: Sequence[Slice],
    planes: list[Any],
    looks: list[Look],
    sampled: Sampled,
    tallies: list[Any],
    options: MeshOptions,
    folder: Path,
) -> Rules:
    """Decide what holds for all slices, and write it down."""
    if sampled.sample is None:
        found = load_rules(folder / RULES, _key_of(looks, options), options)
        assert found is not None
        return found
    counted = [tally for tally in tallies if tally != ""] if sampled.most else []
    legend = legend_of(sampled.sample, counted, options.segmentation())
    first = next(k for k, look in enumerate(looks) if not look.error)
    image = label_by(read_slice(slices[first], planes[first], options.reading()), legend, options.segmentation()).image
    rules = rules_of(legend, crop_image(image, options.crop) if options.crop else image, image.shape, options)
    save_rules(folder / RULES, _key_of(looks, options), rules)
    return rules


def _key_of(looks: list[Look], options: MeshOptions) -> str:
    return digest_of_text(repr(options_as_json(options)), *(look.digest for look in looks))


def _mesh(which: Slice, plane: Any, look: Look, rules: Rules, z: float, path: Path) -> dict[str, Any]:
    """Mesh a slice, write it, and return its row of the report; what is there already is kept."""
    if look.error:
        return {"slice": which.name, "error": look.error}
    key = digest_of_text(look.digest, json.dumps(legend_as_json(rules.legend)), repr(rules.options), repr(z))
    kept = _row_in(path, key)
    if kept is not None:
        return kept
    try:
        return _meshed(which, plane, look, rules, z, path, key)
    except (ImgquadError, OSError) as error:
        return {"slice": which.name, "error": str(error)}
    except MemoryError:
        return {"slice": which.name, "error": "out of memory: crop the slices, or ask for larger elements"}


def _row_in(path: Path, key: str) -> dict[str, Any] | None:
    """Return the row of a slice whose mesh is there, made of the same pixels by the same rules."""
    try:
        row = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        is_whole = row["key"] == key and row["bytes"] == path.stat().st_size
    except (OSError, ValueError, KeyError):
        return None
    return dict(row) if is_whole else None


def _meshed(which: Slice, plane: Any, look: Look, rules: Rules, z: float, path: Path, key: str) -> dict[str, Any]:
    start = perf_counter()
    options = rules.options
    picture = read_slice(which, plane, options.reading())
    if digest_of(picture) != look.digest:
        raise InputError(f"{which.name} has changed since the run began: start again")
    calibration = picture.calibration.cropped(options.crop, picture.shape[0]) if options.crop else picture.calibration
    options = options.placed(calibration, which.name)
    done = core.pipeline.run(label_by(picture, rules.legend, options.segmentation()), options)
    grid = datasets.to_grid(done.mesh)
    grid.translate((0.0, 0.0, z), inplace=True)
    outputs.replace_file(path, lambda temporary: outputs.save_dataset(grid, temporary))
    seconds = {**done.seconds, "total": perf_counter() - start}
    report = outputs.build_report(done, Path(which.path or which.name), path, seconds)
    made = {"slice": which.name, "key": key, "bytes": path.stat().st_size, "z": z} | report
    made["output"] = f"{path.parent.name}/{path.name}"
    outputs.write_json(made, path.with_suffix(".json"))
    return made


def _finished(rows: list[Any], rules: Any, output: Path, slices: Sequence[Slice]) -> StackResult:
    """Write the collection and the report of what there is."""
    if isinstance(rules, Failed):
        raise InputError(f"the stack cannot be looked at: {rules.reason}; give workers more memory")
    told = [
        {"slice": which.name, "error": f"{row.reason}: give workers more memory, or crop the slices"}
        if isinstance(row, Failed)
        else row
        for which, row in zip(slices, rows, strict=True)
    ]
    good: list[dict[str, Any]] = [row for row in told if "error" not in row]
    if not good:
        raise InputError(f"no slice was meshed: {told[0]['error']}")
    report = {
        "output": str(output),
        "legend": rules.legend.note,
        "warnings": list(rules.legend.warnings),
        "noise": {"min_pixels": rules.options.min_pixels, "min_length": rules.options.min_length},
        "step": list(rules.options.step),
        "materials": _materials(good),
        "quality": _quality(good),
        "slices": told,
    }
    text = collection_of([(row["z"], row["output"]) for row in good])
    outputs.replace_file(output, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    outputs.write_json(report, output.with_suffix("") / "report.json")
    return StackResult(output, report)


def collection_of(pieces: Sequence[tuple[float, str]]) -> str:
    """Return a ParaView collection (.pvd) of files, each with its time."""
    lines = [f'    <DataSet timestep="{time!r}" part="0" file={quoteattr(file)}/>' for time, file in pieces]
    head = (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n  <Collection>\n'
    )
    return head + "\n".join(lines) + "\n  </Collection>\n</VTKFile>\n"


def _materials(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Add the ledgers of all slices up."""
    total: dict[int, dict[str, Any]] = {}
    for row in rows:
        for account in row["materials"]:
            known = total.setdefault(account["material"], {"material": account["material"], "name": account["name"]})
            for name in ("pixels", "clean_pixels", "boundary_area", "mesh_area", "quads"):
                known[name] = known.get(name, 0) + account[name]
    return [total[number] for number in sorted(total)]


def _quality(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    figures = [row["quality"] for row in rows]
    quads = sum(each["n_quads"] for each in figures)
    worst = min(range(len(rows)), key=lambda k: figures[k]["min_sj"])
    return {
        "n_quads": quads,
        "n_points": sum(each["n_points"] for each in figures),
        "min_sj": figures[worst]["min_sj"],
        "worst_slice": rows[worst]["slice"],
        "mean_sj": sum(each["mean_sj"] * each["n_quads"] for each in figures) / quads,
    }
