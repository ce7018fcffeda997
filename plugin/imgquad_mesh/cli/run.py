"""`imgquad-mesh run`: from a picture to the file of its mesh."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_mesh import cli, datasets, meshlab, outputs
from imgquad_mesh.progress import progress_bar_if
from imgquad_mesh.texts import number

from .element_options import add_element_options, element_options, writer_options
from .interruption import promptly
from .mesh_options import add_mesh_options, mesh_options
from .script import print_crosscheck


def add_parser(subparsers: Any) -> None:
    """Add the subcommand."""
    parser = subparsers.add_parser("run", help="mesh a picture", description="Mesh a picture.")
    parser.add_argument("image", type=Path, metavar="IMAGE", help="PNG, JPEG, TIFF and many more: docs, Pictures")
    parser.add_argument("output", type=Path, metavar="OUTPUT", help="file of the mesh; its extension tells the format")
    add_mesh_options(parser)
    add_element_options(parser)
    group = parser.add_argument_group("output")
    group.add_argument("--labels-out", type=Path, metavar="FILE", help="materials as meshed: .npy or .png")
    group.add_argument("--boundaries-out", type=Path, metavar="FILE", help="smoothed boundaries: .vtp")
    group.add_argument("--report", type=Path, metavar="FILE", help="all figures: .json")
    group.add_argument("--picture", type=Path, metavar="FILE", help="the mesh coloured by material: .png .svg .pdf")
    group.add_argument("--min-quality", type=number, metavar="Q", help="code 3 if a quad's scaled Jacobian is below Q")
    group.add_argument("--save-script", type=Path, metavar="FILE", help="the run as a filter script: .mlx")
    group.add_argument("--crosscheck", action="store_true", help="code 3 if MeshLab or PyVista measure other figures")
    group.add_argument("--quiet", action="store_true", help="print nothing but errors")
    parser.set_defaults(execute=execute)


@dataclass(frozen=True)
class Outputs:
    """The files that a run writes; `None` for those that were not asked for."""

    mesh: Path
    labels: Path | None = None
    boundaries: Path | None = None
    report: Path | None = None
    picture: Path | None = None
    script: Path | None = None

    def check(self, *inputs: Path | None) -> None:
        """Raise `InputError` if one of them could not be written or is one of `inputs`, before any work is done."""
        allowed = {
            "mesh": outputs.mesh_extensions(),
            "labels": (".npy", ".png"),
            "boundaries": (".vtp",),
            "report": (".json",),
            "picture": (".png", ".svg", ".pdf"),
            "script": (".mlx",),
        }
        targets = {name: path for name in allowed if (path := getattr(self, name)) is not None}
        for name, path in targets.items():
            outputs.check_target(path, allowed[name])
        outputs.check_files(inputs, targets.values())


@dataclass(frozen=True)
class Writing:
    """Which elements the mesh is made of, the options of its writer, and the files that these were read from."""

    elements: core.fe.ElementOptions | None = None
    options: Mapping[str, Any] = field(default_factory=dict)
    inputs: tuple[Path | None, ...] = ()


def execute(args: argparse.Namespace) -> int:
    """Mesh the picture that `args` names; return the exit code."""
    to = Outputs(args.output, args.labels_out, args.boundaries_out, args.report, args.picture, args.save_script)
    writing = Writing(element_options(args), writer_options(args), (args.properties,))
    return mesh_to_files(
        args.image,
        mesh_options(args),
        to,
        writing,
        quiet=args.quiet,
        min_quality=args.min_quality,
        crosscheck=args.crosscheck,
    )


def mesh_to_files(
    image: Path,
    options: core.MeshOptions,
    to: Outputs,
    writing: Writing | None = None,
    *,
    quiet: bool = False,
    min_quality: float | None = None,
    crosscheck: bool = False,
) -> int:
    """Mesh a picture, write what is asked for, print the report; return the exit code.

    Raises
    ------
    InputError
        The picture cannot be used or a file cannot be written.
    QualityError
        A quad is below `min_quality`, or with `crosscheck` another program measures other figures; all files are
        written.
    """
    start = perf_counter()
    writing = writing or Writing()
    marks = Path(options.marks) if isinstance(options.marks, (str, Path)) else None
    to.check(image, marks, *writing.inputs)
    if min_quality is not None:
        core.measures.MIN_QUALITY.check("min_quality", min_quality)
    if crosscheck:
        meshlab.pymeshlab_filters.meshlab_filters()  # where pymeshlab is missing, that is said before any work is done
    if not quiet:
        cli.console.announce_compiling()
    with progress_bar_if(not quiet) as progress:
        run = _run(image, options, progress)
        wrote = perf_counter()
        progress("write", len(run.seconds), len(run.seconds) + 1)
        made = outputs.write_run(run, to.mesh, writing.elements, **writing.options)
    now = perf_counter()
    seconds = {**run.seconds, "write": now - wrote, "total": now - start}
    report = outputs.build_report(run, image, to.mesh, seconds, min_quality)
    report["notes"] += outputs.element_notes(made, to.mesh, writing.options.get("version"))
    _write_others(run, to, report)
    if not quiet:
        cli.console.print_report(report)
    if crosscheck:
        print_crosscheck(run.mesh, quiet)
    if min_quality is not None:
        core.measures.require_quality(run.mesh, min_quality)
    return 0


def _run(image: Path, options: core.MeshOptions, progress: Callable[[str, float, int], None]) -> core.Run:
    is_vtk = image.suffix.lower() in datasets.VTK_EXTENSIONS
    source = datasets.read_vtk(image, options.reading()) if is_vtk else image
    return promptly(lambda: core.run(source, options, progress))


def _write_others(run: core.Run, to: Outputs, report: dict[str, Any]) -> None:
    """Write all but the mesh, which is there whatever happens now: what is needed most first."""
    try:
        if to.report:
            outputs.write_json(report, to.report)
        if to.picture:
            outputs.write_picture(run.mesh, to.picture)
        if to.labels:
            outputs.write_labels(run.labels, to.labels)
        if to.boundaries:
            outputs.write_boundaries(run, to.boundaries)
        if to.script:
            _write_script(run.options, to.script)
    except InputError as error:
        raise InputError(f"{error} (the mesh is in {to.mesh})") from error


def _write_script(options: core.MeshOptions, path: Path) -> None:
    """Write a filter script that makes the same mesh of the same picture."""
    text = meshlab.templates.run_as_script(options)
    outputs.replace_file(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
