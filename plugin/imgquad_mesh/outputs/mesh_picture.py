"""Pictures of a mesh, drawn by matplotlib without a screen."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from imgquad_core.model import Materials, QuadMesh

PIXELS = 1600  #: of the longer side
DISTINCT = 40  #: least difference between the colours of two materials, in one channel
LUMA = np.array([0.299, 0.587, 0.114])  #: of red, green and blue in brightness (ITU-R BT.601)
DARK = 0.2  #: brightness below which black lines are not seen


def draw_materials(mesh: QuadMesh, path: Path) -> None:
    """Draw the mesh coloured by material, with its edges where they are wide enough to be seen, and a legend."""
    low, high = mesh.points.min(axis=0), mesh.points.max(axis=0)
    width, height = high - low
    longest = max(width, height)
    figure = Figure(figsize=(16 * width / longest + 2.4, max(16 * height / longest, 1.0)), dpi=PIXELS / 16)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0, 0, 16 * width / longest / figure.get_figwidth(), 1))
    colors = material_colors(mesh.materials)
    used = np.unique(mesh.quad_material)
    faces = colors[np.searchsorted(mesh.materials.labels, mesh.quad_material)]
    edge = np.sqrt(width * height / mesh.n_quads) / longest * PIXELS  # length of an edge in the picture's pixels
    line = float(np.clip(edge / 20, 0.0, 0.8)) if edge > 3 else 0.0
    drawn = PolyCollection(
        list(mesh.points[mesh.quads]), facecolors=faces, edgecolors=_lines_on(faces), linewidths=line
    )
    drawn.set_antialiased(line > 0)
    axes.add_collection(drawn)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    axes.set_axis_off()
    keys = [Patch(facecolor=colors[np.searchsorted(mesh.materials.labels, m)], edgecolor="black") for m in used[:24]]
    names = [mesh.materials.name_of(int(m)) for m in used[:24]]
    figure.legend(keys, names, loc="center right", frameon=False, fontsize=11)
    whole = BytesIO()  # matplotlib's PDF has errors of its own on a full disk
    with rc_context({"svg.hashsalt": "imgquad-mesh"}):  # names of shapes that hang on nothing else
        figure.savefig(
            whole, format=path.suffix.lstrip(".").lower() or "png", facecolor="white", metadata=_undated(path)
        )
    path.write_bytes(whole.getbuffer())


def material_colors(materials: Materials) -> NDArray[np.float64]:
    """Return RGB from 0 to 1 of each material: its own where it can be told from all others, else one that can."""
    own = materials.colors.astype(int)
    colors = own / 255
    alike = _differences(own, own)
    np.fill_diagonal(alike, 255)
    lost = np.flatnonzero(alike.min(axis=1, initial=255) < DISTINCT)
    table = colormaps["tab20" if len(own) > 10 else "tab10"]
    others = np.array([table(k)[:3] for k in range(table.N)])
    kept = np.delete(own, lost, axis=0)
    free = others[_differences(np.rint(others * 255).astype(int), kept).min(axis=1, initial=255) >= DISTINCT]
    free = free if len(free) else others
    colors[lost] = free[np.arange(len(lost)) % len(free)]
    return np.asarray(colors)


def _lines_on(faces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return black, or grey where black is not seen, for the lines on quads of these colours, shape (n, 3)."""
    is_dark = (faces * LUMA).sum(axis=1) < DARK
    return np.where(is_dark[:, None], 0.55, 0.0) * np.ones(3)


def _differences(some: NDArray[np.int64], others: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return how far colours are apart, in the channel in which they are farthest: shape (n_some, n_others)."""
    return np.asarray(np.abs(some[:, None] - others[None]).max(axis=2, initial=0))


def _undated(path: Path) -> dict[str, Any]:
    """Return metadata without a date, so that the same mesh gives the same bytes."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix.lower(), {})
