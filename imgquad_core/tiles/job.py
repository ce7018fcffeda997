"""What all steps of a picture in tiles are told."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from imgquad_core.options import MeshOptions

from .files import path_of
from .grid import Grid
from .rules import Rules, load_rules
from .sources import Source


@dataclass(frozen=True)
class Job:
    """A picture in tiles: what is done to what, and where.

    Parameters
    ----------
    folder : str
        What steps leave for each other.
    source : Source
        The picture.
    grid : Grid
        Its tiles.
    options : MeshOptions
        As asked.
    """

    folder: str
    source: Source
    grid: Grid
    options: MeshOptions

    def path(self, kind: str, *places: int) -> Path:
        """Return where a kind of arrays of a tile is kept."""
        return path_of(Path(self.folder), kind, *places)

    def rules(self) -> Rules:
        """Return what holds for all tiles; it must be decided."""
        found = load_rules(Path(self.folder) / "rules.json", "", self.options)
        assert found is not None
        return found
