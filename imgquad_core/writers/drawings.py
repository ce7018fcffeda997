"""Drawings of the boundaries: SVG and DXF, a layer for each border and interface."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import InputError
from imgquad_core.fe.femesh import FEMesh

from .common import refuse_3d, rows, safe_names, write_text


def write_svg(mesh: FEMesh, path: str | Path, *, stroke: float = 1.0) -> None:
    """Write the boundaries as a drawing (``.svg``), y downwards, a group for each border and interface.

    Parameters
    ----------
    mesh : FEMesh
        A plane mesh whose interfaces were not split.
    path : path
        File to write; replaced only when all of it was written.
    stroke : float
        Width of lines on the screen, in its pixels.
    """
    layers = _layers(mesh, "SVG")
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    width, height = high - low
    write_text(path, _svg(mesh, layers, (float(low[0]), float(high[1])), (float(width), float(height)), stroke))


def write_dxf(mesh: FEMesh, path: str | Path) -> None:
    """Write the boundaries as a drawing (``.dxf``, R12 polylines), a layer for each border and interface."""
    layers = _layers(mesh, "DXF")
    write_text(path, _dxf(mesh, layers))


def _layers(mesh: FEMesh, form: str) -> dict[str, list[Ints]]:
    """Polylines of each side set; an interface is drawn once."""
    refuse_3d(mesh, form)
    if not len(mesh.chain_points):
        raise InputError(
            f"{form} draws the boundaries of a mesh whose interfaces were not split: leave out the cohesive elements"
        )
    edges = {name: np.sort(mesh.side_nodes(sides)[:, :2], axis=1) for name, sides in mesh.side_sets.items()}
    owner: dict[tuple[int, int], str] = {}
    for name, pairs in edges.items():
        for a, b in pairs.tolist():
            owner.setdefault((a, b), name)
    layers: dict[str, list[Ints]] = {}
    names = safe_names(edges, 255)
    for chain in np.split(mesh.chain_points, mesh.chain_offsets[1:-1]):
        of = [owner[min(a, b), max(a, b)] for a, b in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True)]
        turns = [i for i in range(1, len(of)) if of[i] != of[i - 1]]
        for start, end in zip([0, *turns], [*turns, len(of)], strict=True):
            layers.setdefault(names[of[start]], []).append(chain[start : end + 1])
    return layers


def _svg(
    mesh: FEMesh, layers: dict[str, list[Ints]], corner: tuple[float, float], size: tuple[float, float], stroke: float
) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>\n'
    yield f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]:.9g} {size[1]:.9g}">\n'
    flipped = np.column_stack([mesh.points[:, 0] - corner[0], corner[1] - mesh.points[:, 1]])
    for name, polylines in layers.items():
        yield f'<g id="{name}" fill="none" stroke="black" stroke-width="{stroke:g}">\n'
        for line in polylines:
            closed = line[0] == line[-1]
            points = "L".join(f"{x:.9g} {y:.9g}" for x, y in flipped[line[:-1] if closed else line].tolist())
            yield f'<path vector-effect="non-scaling-stroke" d="M{points}{"Z" if closed else ""}"/>\n'
        yield "</g>\n"
    yield "</svg>\n"


def _dxf(mesh: FEMesh, layers: dict[str, list[Ints]]) -> Iterator[str]:
    yield "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1009\n0\nENDSEC\n"
    yield f"0\nSECTION\n2\nTABLES\n0\nTABLE\n2\nLAYER\n70\n{len(layers)}\n"
    for i, name in enumerate(layers):
        yield f"0\nLAYER\n2\n{name}\n70\n0\n62\n{i % 7 + 1}\n6\nCONTINUOUS\n"
    yield "0\nENDTAB\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n"
    for name, polylines in layers.items():
        for line in polylines:
            closed = line[0] == line[-1]
            yield f"0\nPOLYLINE\n8\n{name}\n66\n1\n10\n0.0\n20\n0.0\n30\n0.0\n70\n{int(closed)}\n"
            vertices = mesh.points[line[:-1] if closed else line]
            yield from rows(f"0\nVERTEX\n8\n{name}\n10\n%.12g\n20\n%.12g\n30\n0.0\n", vertices)
            yield f"0\nSEQEND\n8\n{name}\n"
    yield "0\nENDSEC\n0\nEOF\n"
