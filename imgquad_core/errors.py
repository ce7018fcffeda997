"""Errors of imgquad-mesh. A message names what is wrong, the value and the remedy."""

from __future__ import annotations

from typing import Any


class ImgquadError(Exception):
    """Base of every error that this library raises on purpose."""


class InputError(ImgquadError, ValueError):
    """The caller gave something that cannot be used."""


class TopologyError(ImgquadError):
    """An invariant of a mesh or a boundary graph broke: a bug here, never the caller's fault."""


class QualityError(ImgquadError):
    """An asked-for limit was not met.

    Parameters
    ----------
    message : str
        What was asked, what was reached, and where.
    mesh : QuadMesh, optional
        The mesh all the same, so that nothing is lost.
    worst : sequence, optional
        Ids of the worst quads, worst first.
    """

    def __init__(self, message: str, mesh: Any = None, worst: Any = ()) -> None:
        super().__init__(message)
        self.mesh = mesh
        self.worst = worst


class ScriptError(InputError):
    """A filter script is wrong, or one of its filters failed.

    Parameters
    ----------
    message : str
        What is wrong and the remedy.
    file : str, optional
        The script.
    line : int, optional
        Line in the script, counted from 1.
    """

    def __init__(self, message: str, file: str | None = None, line: int | None = None) -> None:
        place = f"{file or 'script'}:{line}: " if line is not None else (f"{file}: " if file else "")
        super().__init__(place + message)
        self.file = file
        self.line = line
