"""A process that works for one page: it takes recipes from a pipe and answers with lines of JSON and arrays.

A recipe says all, so a new worker in the place of a dead one needs no history; what takes long is kept in `Memory`.
"""

from __future__ import annotations

import io
import json
import pickle
import re
import sys
import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from PIL import Image

from imgquad_core.declared import declarations
from imgquad_core.errors import ImgquadError, InputError
from imgquad_core.fe.properties import read_properties
from imgquad_core.ledger import material_ledger
from imgquad_core.measures import scaled_jacobian
from imgquad_core.measures.quality import bad_places, irregular_share
from imgquad_core.model import LabelImage, Materials
from imgquad_core.options import MeshOptions
from imgquad_core.picture import Segmentation, SegmentationOptions, area_shares
from imgquad_core.pipeline import STAGES, Memory, Run, run
from imgquad_core.reading import Picture, ReadOptions, read_picture
from imgquad_core.reading.formats import OF_VTK
from imgquad_core.writers.neighbours import files_of
from imgquad_mesh import outputs
from imgquad_mesh.memory import give_large_blocks_back, limit_memory

from . import packing
from .recipe import PROPERTIES, Recipe, recipe_of

WORST, LOW = 12, 0.3  #: quads that the page lists, and the scaled Jacobian below which it tells whether they must be so
Answer = tuple[dict[str, Any], bytes]
Tell = Callable[[dict[str, Any]], None]


@dataclass
class Desk:
    """What a worker has: its folder, the pixels it may read, and what it remembers of the picture."""

    folder: Path
    pixels: int
    rest: float = 0.4  #: seconds between two figures of a stage: the browser draws each, 30 ms of a core without GPU
    memory: Memory = field(default_factory=Memory)
    raw: dict[tuple[str, ReadOptions], Picture] = field(default_factory=dict)
    kept: Segmentation | None = None  #: the one that is in the folder, too

    def picture(self, task: Mapping[str, Any], options: MeshOptions) -> Picture:
        """Return the page's picture, read once; the last one only is kept."""
        reading = replace(options.reading(), crop=None, max_pixels=self.pixels)
        key = task["file"], reading
        if key not in self.raw:
            _assert_whole(self.folder / task["file"], task["name"])
            self.raw = {key: _read(self.folder / task["file"], reading, task["name"])}
        return self.raw[key]

    def recall(self, task: Mapping[str, Any], options: MeshOptions) -> None:
        """Take the segmentation from the folder, where a worker that was killed has left one of the same."""
        if self.kept is None and self._segmentation.exists():
            kept = pickle.loads(self._segmentation.read_bytes())  # our own: uploads have other names
            if kept[:2] == (task["file"], options):
                self.memory("segmentation", lambda *_: kept[2], self.picture(task, options), options.segmentation())
                self.kept = self.memory["segmentation"]

    def keep(self, task: Mapping[str, Any], options: MeshOptions) -> None:
        """Leave the segmentation in the folder: it takes most of the time that a picture takes."""
        found = self.memory["segmentation"]
        if found is not self.kept:
            kept = pickle.dumps((task["file"], options, found), pickle.HIGHEST_PROTOCOL)
            outputs.replace_file(self._segmentation, lambda temporary: temporary.write_bytes(kept))
            self.kept = found

    @property
    def _segmentation(self) -> Path:
        return self.folder / "segmentation"


def _read(path: Path, options: ReadOptions, name: str) -> Picture:
    if path.suffix not in OF_VTK:
        return read_picture(path, options, name)
    from imgquad_mesh.datasets.pictures import read_any  # loads VTK, which no other picture needs

    return read_any(path, options, name)


#: how headers name the file of their data; an upload has none beside it, and must not reach for others
_ELSEWHERE = {".nrrd": rb"(?im)^data ?file *:", ".mha": rb"(?im)^ElementDataFile *= *(?!LOCAL)"}


def _assert_whole(path: Path, name: str) -> None:
    pattern = _ELSEWHERE.get(path.suffix)
    if pattern and re.search(pattern, path.read_bytes()[:100_000].split(b"\n\n")[0]):
        raise InputError(f"{name} names another file for its data: give one that holds all")


def work(pipe: Connection, folder: str, pixels: int, memory: int) -> None:
    """Answer tasks until the pipe is closed."""
    limit_memory(memory, "RLIMIT_DATA")
    give_large_blocks_back()
    desk = Desk(Path(folder), pixels)
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        _answer(desk, task, pipe)


def _answer(desk: Desk, task: Mapping[str, Any], pipe: Connection) -> None:
    def tell(line: dict[str, Any]) -> None:
        pipe.send_bytes(json.dumps(line).encode())

    try:
        done, data = TASKS[task["do"]](desk, task, tell)
    except MemoryError:
        desk.memory, desk.raw = Memory(), {}
        tell({"error": "out of memory: crop the picture, or ask for larger elements"})
    except ImgquadError as error:
        tell({"error": " ".join(str(error).split())})
    except Exception:  # a bug: its text may hold what is none of the page's business
        traceback.print_exc(file=sys.stderr)
        tell({"error": "internal error, told in the terminal of the studio: please report it"})
    else:
        tell({"done": done, "bytes": len(data)})
        if data:
            pipe.send_bytes(data)


#: options that reading and segmentation hang on
_EARLY = [name for of in (ReadOptions, SegmentationOptions) for name in declarations(of)]


class _Enough(Exception):
    """The last stage that was asked for is done."""


def _run(desk: Desk, task: Mapping[str, Any], tell: Tell, until: str) -> Run | None:
    """Run the pipeline through a stage; None where it is not the last: the values are in the memory."""
    recipe = _recipe(desk, task)
    early = MeshOptions(**{name: getattr(recipe.options, name) for name in _EARLY})
    last = "", 0.0

    def progress(stage: str, number: float, total: int) -> None:
        nonlocal last
        if stage == "denoise":
            desk.keep(task, early)
        if STAGES.index(stage) > STAGES.index(until):
            raise _Enough
        if stage != last[0] or perf_counter() - last[1] > desk.rest:
            tell({"stage": stage, "number": number, "of": STAGES.index(until) + 1})
            last = stage, perf_counter()

    progress("read", 0, len(STAGES))
    desk.recall(task, early)
    try:
        return run(desk.picture(task, recipe.options), recipe.options, progress, desk.memory)
    except _Enough:
        return None


def _recipe(desk: Desk, task: Mapping[str, Any]) -> Recipe:
    recipe = recipe_of(task["recipe"])
    if recipe.options.marks is None:
        return recipe
    if not task.get("marks"):
        raise InputError("there are no marks: paint on the picture")
    return replace(recipe, options=replace(recipe.options, marks=desk.folder / task["marks"]))


def _segment(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    _run(desk, task, tell, "segment")
    found, edited = desk.memory["segmentation"], desk.memory["edited"]
    listed, data = packing.packed({"labels": packing.label_places(edited.labels, edited.materials)})
    rows, cols = edited.shape
    told = {"note": found.note, "warnings": list(found.warnings), "rows": rows, "columns": cols}
    told["formats"] = list(outputs.mesh_extensions())
    told["notes"] = list(desk.picture(task, recipe_of(task["recipe"]).options).notes)
    return told | {"base": _base(found.image.materials), "materials": _table(edited), "arrays": listed}, data


def _base(materials: Materials) -> dict[str, str]:
    return {str(n): name for n, name in zip(materials.labels.tolist(), materials.names, strict=True)}


def _table(image: LabelImage) -> list[dict[str, Any]]:
    return packing.material_rows(image, area_shares(image), outputs.material_colors(image.materials))


def _denoise(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    _run(desk, task, tell, "denoise")
    recipe, clean, found = recipe_of(task["recipe"]), desk.memory["clean"], desk.memory["segmentation"]
    limits = recipe.options.noise(found.quantised, found.image.shape).scaled(desk.memory["step"])
    removed = desk.memory["removed"]
    listed, data = packing.packed({"labels": packing.label_places(clean.labels, clean.materials)})
    told = {"min_pixels": limits.min_pixels, "min_length": limits.min_length, "rows": clean.shape[0]}
    told |= {"clusters": sum(r.clusters for r in removed), "pixels": sum(r.pixels for r in removed)}
    return told | {"columns": clean.shape[1], "arrays": listed}, data


def _smooth(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    _run(desk, task, tell, "smooth")
    graph, image = desk.memory["boundary"], desk.memory["labels"]
    frame = packing.Frame(image.shape, graph.shape, recipe_of(task["recipe"]).options.crop)
    places = packing.label_places(image.labels, image.materials)
    listed, data = packing.packed({**packing.pack_lines(graph, frame), "labels": places})
    told = {"chains": graph.n_chains, "regions": len(graph.region_label), "arrays": listed}
    return told | {"rows": image.shape[0], "columns": image.shape[1]}, data


def _mesh(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    done = _run(desk, task, tell, "mesh")
    assert done is not None
    frame = packing.Frame(done.labels.shape, done.boundary.shape, done.options.crop)
    jacobians = scaled_jacobian(done.pixel_mesh.points, done.pixel_mesh.quads)
    listed, data = packing.packed(packing.pack_quads(done.pixel_mesh, jacobians, frame))
    ledger = material_ledger(done.picture, done.labels, done.boundary, done.mesh, done.options.pixel_sides)
    quality = {"n_quads": done.mesh.n_quads, "n_points": done.mesh.n_points, "min_sj": float(jacobians.min())}
    quality |= {"mean_sj": float(jacobians.mean()), "irregular": irregular_share(done.mesh)}
    told = {"quality": quality, "worst": _worst(done), "arrays": listed, "materials": _table(done.labels)}
    return told | {"errors": {row.name: row.error for row in ledger if row.clean_pixels}}, data


def _worst(done: Run) -> list[dict[str, Any]]:
    names = done.mesh.materials.name_of
    return [
        {"quad": place.quad, "forced": place.forced, "angle": place.sector_angle, "material": names(place.material)}
        for place in bad_places(done.pixel_mesh, LOW, WORST)
    ]


def _write(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    """Write one of the outputs of the command and hand over what was written."""
    start = perf_counter()
    done = _run(desk, task, tell, "mesh")
    assert done is not None
    tell({"stage": "write", "number": 1, "of": 1})
    recipe, what = recipe_of(task["recipe"]), task["what"]
    folder = desk.folder / "out"
    folder.mkdir(exist_ok=True)
    stem = Path(recipe.picture).stem
    path = folder / (recipe.file if what == "mesh" else f"{stem}{_OTHERS[what]}")
    if what == "mesh":
        outputs.check_target(path, outputs.mesh_extensions())
        outputs.write_run(done, path, recipe.output.elements, **_writer_options(recipe, folder))
    elif what == "report":
        seconds = {**done.seconds, "total": perf_counter() - start}
        outputs.write_json(outputs.build_report(done, Path(recipe.picture), Path(recipe.file), seconds), path)
    elif what == "picture":
        outputs.write_picture(done.mesh, path)
    else:
        outputs.write_labels(done.labels, path)
    return _handed_over([each for each in files_of(path) if each.exists()])


#: endings of what is written beside the mesh
_OTHERS = {"report": ".report.json", "picture": ".mesh.png", "labels": ".labels.npy", "labels_png": ".labels.png"}


def _writer_options(recipe: Recipe, folder: Path) -> dict[str, Any]:
    given: dict[str, Any] = dict(recipe.output.writer)
    if recipe.output.properties:
        (folder / PROPERTIES).write_text(recipe.output.properties, encoding="utf-8")
        given["properties"] = read_properties(folder / PROPERTIES)
    return given


def _handed_over(paths: list[Path]) -> Answer:
    parts = [path.read_bytes() for path in paths]
    for path in paths:
        path.unlink()
    listed = [{"name": path.name, "bytes": len(part)} for path, part in zip(paths, parts, strict=True)]
    return {"files": listed}, b"".join(parts)


def _look(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    """Show a picture that browsers cannot: its values from black to white, as PNG."""
    picture = desk.picture(task, recipe_of(task["recipe"]).options)
    step = -(-max(picture.shape) // packing.LARGEST)
    values = picture.values[::step, ::step]
    if picture.palette is not None:
        values = picture.palette[values]
    if values.dtype != np.uint8:
        low, high = np.quantile(values.astype(np.float64), (0.001, 0.999))
        values = np.clip((values - low) / max(high - low, 1e-30) * 255, 0, 255).astype(np.uint8)
    out = io.BytesIO()
    Image.fromarray(values).save(out, "PNG", compress_level=1)
    return {"files": [{"name": "look.png", "bytes": out.tell()}]}, out.getvalue()


def _rock(desk: Desk, task: Mapping[str, Any], tell: Tell) -> Answer:
    """Draw the rock of the demo."""
    out = io.BytesIO()
    outputs.draw_rock().save(out, "PNG")
    return {"files": [{"name": "rock.png", "bytes": out.tell()}]}, out.getvalue()


TASKS: Mapping[str, Callable[[Desk, Mapping[str, Any], Tell], Answer]] = {
    "segment": _segment,
    "denoise": _denoise,
    "smooth": _smooth,
    "mesh": _mesh,
    "write": _write,
    "look": _look,
    "rock": _rock,
}
