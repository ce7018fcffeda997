"""One file for a solver of a picture in tiles: made of files that are read as if they were in memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

import imgquad_core as core
from imgquad_core.errors import InputError
from imgquad_core.model import Materials, QuadMesh
from imgquad_core.tiles import Job
from imgquad_core.tiles.tasks import elements
from imgquad_core.whole_files import scratch_folder
from imgquad_core.writers.abaqus.decks import DECKS
from imgquad_mesh import outputs

DRAWINGS = (".dxf", ".svg")  #: of boundaries from junction to junction, which no tile has as a whole


@dataclass(frozen=True)
class Deck:
    """A file for a solver, and the options of its writer."""

    path: Path
    options: Mapping[str, Any] = field(default_factory=dict)

    @staticmethod
    def of(path: str | Path | None, options: Mapping[str, Any] | None) -> Deck | None:
        """Return the file that is asked for, if any; raise `InputError` where it cannot be written."""
        if path is None:
            if options:
                raise InputError(
                    f"{', '.join(options)}: of a solver's file, but none is asked for: say which, with deck"
                )
            return None
        made = Deck(Path(path), dict(options or {}))
        outputs.check_target(made.path, outputs.mesh_extensions())
        if made.options or made.is_mapped:
            core.writers.check_options(made.path, made.options)
        if made.options and made.is_mapped:
            made._try_values()
        return made

    def _try_values(self) -> None:
        """Write one quad with the options, so that values that no writer takes are told before any work is done.

        What a file of properties says of materials is left out: these are not known yet.
        """
        options = {name: value for name, value in self.options.items() if name != "properties"}
        if "properties" in self.options and options.get("deck") in DECKS:
            options["properties"] = {"*": dict.fromkeys(DECKS[options["deck"]], 0.25)}
        corners, quad = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]), np.arange(4).reshape(1, 4)
        name = Materials(np.zeros(1, np.int32), ("any",), np.zeros((1, 3), np.uint8))
        mesh = core.tracing.trace_mesh(corners, quad, np.zeros(1, np.int32), name)
        with TemporaryDirectory() as folder:
            core.writers.write_mesh(mesh, Path(folder) / f"quad{self.path.suffix}", **options)

    @property
    def is_mapped(self) -> bool:
        """Whether it is written without the whole mesh in memory."""
        extension = self.path.suffix.lower()
        return extension in core.writers.WRITERS and extension not in DRAWINGS

    def write(self, job: Job, counts: Sequence[tuple[int, int]], whole: Callable[[], QuadMesh]) -> None:
        """Write it: `counts` are those of nodes and quads of the tiles, `whole` gives the mesh in memory."""
        if not self.is_mapped:
            outputs.write_mesh_file(whole(), self.path, **self.options)
            return
        try:
            with scratch_folder(Path(job.folder)) as folder:
                core.writers.write_mesh(elements(job, counts, folder), self.path, **self.options)
        except OSError as error:
            reason = error.strerror or str(error)
            raise InputError(f"cannot write {self.path}: {reason}; free some space, and start again") from error
