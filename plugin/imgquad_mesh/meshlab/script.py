"""Runs filter scripts that mix our filters with MeshLab's."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from math import inf
from pathlib import Path
from time import perf_counter
from typing import Any, TypeAlias

from imgquad_core.errors import ImgquadError, InputError, ScriptError
from imgquad_core.model import LabelImage, QuadMesh
from imgquad_core.whole_files import scratch_folder
from imgquad_mesh.outputs.files import GRID_EXTENSIONS, check_files, replace_file

from .checking import MeshLabStep, OwnStep, checked_steps, files_of_steps
from .layer import Layer, layer_of, write_ply
from .meshsets import add_to
from .mlx import read_script
from .own_filters import STEPS
from .process import DEADLINE, MeshLabError, MeshLabProcess, memory_limit
from .saving import check_saving, read_grid, save_current
from .state import LayerList, State

Progress: TypeAlias = Callable[[str, int, int], None]


@dataclass(frozen=True)
class StepResult:
    """What one filter of a script did.

    Parameters
    ----------
    name, function : str
        Display name and Python name.
    line : int
        Where it stands in the script.
    program : str
        ``imgquad-mesh`` or ``MeshLab``.
    seconds : float
        Time that it took.
    values : dict
        What it returned; MeshLab's own way of running scripts loses this.
    """

    name: str
    function: str
    line: int
    program: str
    seconds: float
    values: dict[str, Any]


@dataclass(frozen=True, eq=False)
class ScriptResult:
    """What a script has made.

    Parameters
    ----------
    steps : tuple of StepResult
        One a filter, in order.
    layers : tuple of Layer
        All layers at the end.
    current : Layer or None
        The current layer.
    mesh : QuadMesh or None
        The current layer as a mesh of quads; None where it is none.
    labels : LabelImage or None
        The labelled picture.
    """

    steps: tuple[StepResult, ...]
    layers: tuple[Layer, ...]
    current: Layer | None
    mesh: QuadMesh | None
    labels: LabelImage | None

    def values(self, function: str) -> dict[str, Any]:
        """Return what the last filter of this Python name returned."""
        return next(s.values for s in reversed(self.steps) if s.function == function)


def run_script(
    path: str | Path,
    meshset: Any = None,
    image: Any = None,
    *,
    mesh: str | Path | QuadMesh | None = None,
    output: str | Path | None = None,
    folder: str | Path | None = None,
    deadline: float = 120.0,
    memory: float | None = None,
    progress: Progress | None = None,
) -> ScriptResult:
    """Run a filter script.

    Parameters
    ----------
    path : path-like
        The script (``.mlx``), as MeshLab, pymeshlab or ``imgquad-mesh run --save-script`` write it. Filters have
        display names or Python names, ours and MeshLab's in any order.
    meshset : pymeshlab.MeshSet, optional
        Its layers are the input, and it gets the layers at the end instead; selections and textures stay behind.
    image : path, array or LabelImage, optional
        The picture that our filters work on.
    mesh : path or QuadMesh, optional
        A mesh that is the first layer.
    output : path-like, optional
        The current layer at the end is written there, in the format that the extension names.
    folder : path-like, optional
        Files that the script names must lie in it, and relative ones are taken from it; the script's own by default.
    deadline : float
        Seconds that one filter of MeshLab may take; infinity for no limit.
    memory : float, optional
        GB that MeshLab may use, at least 2; half of the machine's by default.
    progress : callable, optional
        Called with the name of each filter that starts, its number from 0, and the number of filters.

    Returns
    -------
    ScriptResult
        What each filter returned, and the layers.

    Raises
    ------
    ScriptError
        Something is wrong with the script: then nothing has run. Or a filter failed, hung or crashed: then it is named,
        and the last good mesh has been saved beside the output (or the script) as ``.last_good.ply``.
    InputError
        An input or the output cannot be used.

    Notes
    -----
    MeshLab's filters run in a child process, which loads while ours work: scripts of our filters alone need no
    pymeshlab.
    """
    script = read_script(path)
    if deadline != inf:
        DEADLINE.check("deadline", deadline)
    memory = memory_limit(memory)
    base = Path(folder) if folder is not None else Path(path).resolve().parent
    steps = checked_steps(script, base)
    target = Path(output) if output is not None else None
    if target is not None:
        check_saving(target)
    read, written = files_of_steps(steps, base)
    read += [Path(each) for each in (path, image, mesh) if isinstance(each, (str, Path))]
    check_files(read, [target, *written])
    with ExitStack() as stack:
        runner = _Runner(stack, State(LayerList(), image, base), deadline, memory, read)
        if any(isinstance(step, MeshLabStep) for step in steps):
            runner.start_meshlab()  # it loads while our filters work
        runner.load(meshset, mesh)
        results = [runner.step(step, script.file, target) for step in _announced(steps, progress)]
        if target is not None:
            save_current(runner.state, runner.process, target)
        result = runner.result(results)
    if meshset is not None:
        _replace_layers(meshset, result)
    return result


def _announced(steps: list[OwnStep | MeshLabStep], progress: Progress | None) -> Iterator[OwnStep | MeshLabStep]:
    for number, step in enumerate(steps):
        if progress:
            progress(step.name, number, len(steps))
        yield step


class _Runner:
    """Takes the steps one by one; MeshLab's process gets the layers at the first of its filters."""

    def __init__(self, stack: ExitStack, state: State, deadline: float, memory: float, inputs: Iterable[Path]) -> None:
        self._stack = stack
        self._inputs = inputs
        self._deadline = deadline
        self._memory = memory
        self.state = state
        self._started: MeshLabProcess | None = None
        self.process: MeshLabProcess | None = None  # the same, once it has the layers

    def load(self, meshset: Any, mesh: str | Path | QuadMesh | None) -> None:
        for each in meshset if meshset is not None else ():
            self.state.meshes.add(layer_of(each))
        if isinstance(mesh, QuadMesh):
            self.state.put_mesh(mesh)
        elif mesh is not None and Path(mesh).suffix.lower() in GRID_EXTENSIONS:
            self.state.meshes.add(read_grid(Path(mesh)))
        elif mesh is not None:
            if not Path(mesh).is_file():
                raise InputError(f"there is no mesh {mesh}; give the path of a file")
            try:
                self._meshlab().open(Path(mesh).resolve())
            except MeshLabError as error:
                raise InputError(f"mesh {mesh} cannot be read: {error}") from error

    def step(self, step: OwnStep | MeshLabStep, file: Path | None, target: Path | None) -> StepResult:
        start = perf_counter()
        try:
            if isinstance(step, OwnStep):
                program, values = "imgquad-mesh", STEPS[step.function].run(self.state, step.options)
            else:
                program, values = "MeshLab", self._meshlab().apply(step.function, step.parameters, step.script)
        except (ImgquadError, OSError) as error:
            saved = self._save_last_good(target or file)
            kept = f"; the mesh before it is in {saved}" if saved else ""
            raise ScriptError(f"filter {step.name!r}: {error}{kept}", str(file), step.line) from error
        return StepResult(step.name, step.function, step.line, program, perf_counter() - start, values)

    def start_meshlab(self) -> MeshLabProcess:
        if self._started is None:
            folder = self._stack.enter_context(scratch_folder())
            self._started = self._stack.enter_context(MeshLabProcess(folder, self._deadline, self._memory))
        return self._started

    def _meshlab(self) -> MeshLabProcess:
        if self.process is None:
            self.process = self.start_meshlab()
            self._move_layers(self.process)
        return self.process

    def _move_layers(self, process: MeshLabProcess) -> None:
        former = self.state.meshes
        ids, current = former.layers
        numbers = {mesh: process.add(former.layer(mesh)) for mesh in ids}
        made = {numbers[mesh]: quads for mesh, quads in self.state.made.items()}
        if current is not None:
            process.set_current(numbers[current])
        self.state.meshes, self.state.made = process, made

    def _last_good(self) -> Layer | None:
        if self.process is not None:
            return self.process.last_good()
        return self.state.meshes.layer() if self.state.meshes.layers[0] else None

    def _save_last_good(self, beside: Path | None) -> Path | None:
        layer = self._last_good()
        if layer is None or beside is None:
            return None
        path = beside.with_name(beside.stem + ".last_good.ply")
        if not os.access(path.parent, os.W_OK):
            path = Path(tempfile.gettempdir()) / path.name
        if any(path.exists() and each.exists() and path.samefile(each) for each in self._inputs):
            path = path.with_name(f"{beside.stem}.last_good_now.ply")  # the script went on from a last good mesh
        replace_file(path, lambda temporary: write_ply(layer, temporary))
        return path

    def result(self, results: list[StepResult]) -> ScriptResult:
        ids, current = self.state.meshes.layers
        try:
            mesh = self.state.mesh()
        except InputError:
            mesh = None
        layers = tuple(self.state.meshes.layer(number) for number in ids)
        last = layers[ids.index(current)] if current is not None else None
        return ScriptResult(tuple(results), layers, last, mesh, self.state.labels)


def _replace_layers(meshset: Any, result: ScriptResult) -> None:
    meshset.clear()
    numbers = [add_to(meshset, layer) for layer in result.layers]
    for number, layer in zip(numbers, result.layers, strict=True):
        if layer is result.current:
            meshset.set_current_mesh(number)
