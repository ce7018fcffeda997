"""How good a mesh is: shape of its quads, order of its nodes, area of its materials.

The measures are those of Verdict and VTK: the scaled Jacobian of a quad is the least sine of its four corner angles
(negative where a corner is concave or the quad runs clockwise); see C. J. Stimpson et al., "The Verdict Geometric
Quality Library", SAND2007-1751.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import DTypeLike, NDArray

from imgquad_core.arrays import Flags, Floats, Ints
from imgquad_core.declared import Declaration
from imgquad_core.errors import QualityError
from imgquad_core.geometry.halfedge import twins_of
from imgquad_core.grouping import linked
from imgquad_core.jit import kernel
from imgquad_core.model import QuadMesh

MIN_QUALITY = Declaration(0.0, "least scaled Jacobian that is asked for", float, least=-1.0, most=1.0)

GOOD_ANGLES = (45.0, 135.0)  #: range of a corner's angle, in degrees, that Verdict calls acceptable


@dataclass(frozen=True)
class QualityReport:
    """Figures of a mesh's shape. Angles in degrees, shares from 0 to 1.

    Parameters
    ----------
    n_points, n_quads : int
        Size of the mesh.
    min_sj, sj_0_1_percent, sj_1_percent, mean_sj : float
        Least, 0.1 % quantile, 1 % quantile and mean scaled Jacobian.
    inverted : int
        Quads that are concave, degenerate or clockwise: none in a valid mesh.
    min_angle, max_angle : float
        Of all corners.
    good_angles : float
        Share of quads whose angles all lie in [45, 135] degrees.
    inner_nodes : int
        Nodes on neither the border nor an interface.
    irregular : float
        Share of inner nodes that have other than four quads.
    max_valence : int
        Most quads at one node.
    aspect_99_percent, max_aspect : float
        Longest by shortest edge of a quad: 99 % quantile and maximum.
    """

    n_points: int
    n_quads: int
    min_sj: float
    sj_0_1_percent: float
    sj_1_percent: float
    mean_sj: float
    inverted: int
    min_angle: float
    max_angle: float
    good_angles: float
    inner_nodes: int
    irregular: float
    max_valence: int
    aspect_99_percent: float
    max_aspect: float


class BadPlace(NamedTuple):
    """A quad of low quality and what the picture forces there."""

    quad: int  #: its id
    x: float  #: its centre
    y: float
    scaled_jacobian: float
    material: int
    neighbours: tuple[int, ...]  #: other materials at its corners
    sector_angle: float  #: narrowest sector of material between two boundary lines at a corner, degrees; 360 if none
    forced: bool  #: whether no mesh of that sector could meet the limit


def quality_report(mesh: QuadMesh) -> QualityReport:
    """Measure `mesh`.

    Parameters
    ----------
    mesh : QuadMesh
        With at least one quad.

    Returns
    -------
    QualityReport
    """
    corners = _corners(mesh.points, mesh.quads)
    sj, angles, ratio = scaled_jacobian(mesh.points, mesh.quads), _angles(corners), _aspects(corners)
    low, high = GOOD_ANGLES
    return QualityReport(
        n_points=mesh.n_points,
        n_quads=mesh.n_quads,
        min_sj=float(sj.min()),
        sj_0_1_percent=float(np.quantile(sj, 0.001)),
        sj_1_percent=float(np.quantile(sj, 0.01)),
        mean_sj=float(sj.mean()),
        inverted=int(np.count_nonzero(sj <= 0.0)),
        min_angle=float(angles.min()),
        max_angle=float(angles.max()),
        good_angles=float(((angles >= low) & (angles <= high)).all(axis=0).mean()),
        inner_nodes=int(np.count_nonzero(inner_nodes(mesh))),
        irregular=irregular_share(mesh),
        max_valence=int(mesh.valence.max()),
        aspect_99_percent=float(np.quantile(ratio, 0.99)),
        max_aspect=float(ratio.max()),
    )


def scaled_jacobian(points: Floats, quads: Ints) -> Floats:
    """Return the least sine of each quad's corner angles, shape (n_quads,); 0 where an edge has no length."""
    return _least_sines(_to_read(points, np.float64), _to_read(quads, np.int64))


def _to_read(values: NDArray[Any], dtype: DTypeLike) -> NDArray[Any]:
    """Return a view of one kind, for which one version of the kernel is compiled."""
    view = np.ascontiguousarray(values, dtype).view()
    view.flags.writeable = False
    return view


@kernel
def _least_sines(points: Floats, quads: Ints) -> Floats:
    least = np.full(len(quads), np.inf)
    for q in range(len(quads)):
        p = quads[q, 3]
        ax, ay = points[quads[q, 0], 0] - points[p, 0], points[quads[q, 0], 1] - points[p, 1]
        before = np.hypot(ax, ay)
        for k in range(4):  # at corner p, edge a comes in and edge b goes out
            p, n = quads[q, k], quads[q, (k + 1) & 3]
            bx, by = points[n, 0] - points[p, 0], points[n, 1] - points[p, 1]
            length = np.hypot(bx, by)
            product = length * before
            least[q] = min(least[q], (ax * by - ay * bx) / product if product > 0.0 else 0.0)
            ax, ay, before = bx, by, length
    return least


def corner_angles(points: Floats, quads: Ints) -> Floats:
    """Return the angle inside each corner, in degrees from 0 to 360, shape (n_quads, 4)."""
    return np.ascontiguousarray(_angles(_corners(points, quads)).T)


def aspect(points: Floats, quads: Ints) -> Floats:
    """Return longest by shortest edge of each quad, shape (n_quads,); infinite where an edge has no length."""
    return _aspects(_corners(points, quads))


def quad_areas(points: Floats, quads: Ints) -> Floats:
    """Return the signed area of each quad, positive if counter-clockwise, shape (n_quads,)."""
    x, y = points[quads, 0], points[quads, 1]
    return np.asarray(0.5 * ((x[:, 2] - x[:, 0]) * (y[:, 3] - y[:, 1]) - (x[:, 3] - x[:, 1]) * (y[:, 2] - y[:, 0])))


def region_areas(mesh: QuadMesh) -> Floats:
    """Return the area of each region, shape (n_regions,)."""
    areas = quad_areas(mesh.points, mesh.quads)
    return np.asarray(np.bincount(mesh.quad_region, weights=areas, minlength=len(mesh.region_label)), float)


def material_areas(mesh: QuadMesh) -> dict[int, float]:
    """Return the area of each material that occurs, by number, ascending."""
    areas = region_areas(mesh)
    return {int(label): float(areas[mesh.region_label == label].sum()) for label in np.unique(mesh.quad_material)}


def inner_nodes(mesh: QuadMesh) -> Flags:
    """Tell of each node whether it is used and lies on neither the border nor an interface, shape (n_points,)."""
    inner = mesh.valence > 0
    inner[mesh.constraints.ravel()] = False
    return inner


def irregular_share(mesh: QuadMesh) -> float:
    """Return the share of inner nodes that have other than four quads, 0 where there are none."""
    inner = inner_nodes(mesh)
    return float(np.mean(mesh.valence[inner] != 4)) if inner.any() else 0.0


def sectors_of(mesh: QuadMesh) -> Ints:
    """Return the number of the sector that each corner is in, shape (n_quads, 4).

    A sector is all of a node's corners that follow one another without a boundary line between them.
    """
    #   q's corner at v |/  h runs from v to w, its twin from w to v:
    #     v ---- h ---> w   corner h lies left of it at v,
    #   <---- twin -----    the corner after the twin lies right of it at v
    twins = twins_of(mesh.quads, mesh.n_points)
    h = np.flatnonzero((twins >= 0) & ~_on_constraint(mesh))
    beside = twins[h] // 4 * 4 + (twins[h] + 1) % 4
    return linked(h, beside, 4 * mesh.n_quads)[0].reshape(-1, 4)


def sector_angles(mesh: QuadMesh) -> Floats:
    """Return for each corner the angle of its sector of material between two boundary lines, shape (n_quads, 4).

    It is what the boundary forces on the mesh, and 360 degrees at an inner node.
    """
    sector = sectors_of(mesh)
    angles = corner_angles(mesh.points, mesh.quads)
    return np.asarray(np.bincount(sector.ravel(), weights=angles.ravel())[sector])


def best_sine(sector: Floats) -> Floats:
    """Return the best scaled Jacobian that quads in sectors of the given angles (degrees) can reach."""
    fewest = np.maximum(np.floor(sector / 90.0), 1.0)
    sines = [np.sin(np.radians(np.minimum(sector / pieces, 180.0))) for pieces in (fewest, fewest + 1.0)]
    return np.asarray(np.maximum(*sines))


def forced_quads(mesh: QuadMesh, limit: float) -> Flags:
    """Tell of each quad whether the boundary's own angle keeps it below `limit`, shape (n_quads,)."""
    return np.asarray((best_sine(sector_angles(mesh)) < limit).any(axis=1))


def bad_places(mesh: QuadMesh, limit: float, most: int = 10) -> list[BadPlace]:
    """Describe the quads whose scaled Jacobian is below `limit`, worst first, at most `most`."""
    sj = scaled_jacobian(mesh.points, mesh.quads)
    below = np.flatnonzero(sj < limit)
    worst = below[np.argsort(sj[below], kind="stable")[:most]]
    if not len(worst):
        return []
    around, near = _around(mesh, worst)
    sectors = sector_angles(near)
    forced = (best_sine(sectors) < limit).any(axis=1)
    centres = mesh.points[mesh.quads[worst]].mean(axis=1)
    return [
        BadPlace(
            quad=int(q),
            x=float(centre[0]),
            y=float(centre[1]),
            scaled_jacobian=float(sj[q]),
            material=int(mesh.quad_material[q]),
            neighbours=_materials_around(near, int(at)),
            sector_angle=float(sectors[at].min()),
            forced=bool(forced[at]),
        )
        for q, at, centre in zip(worst, np.searchsorted(around, worst), centres, strict=True)
    ]


def _around(mesh: QuadMesh, quads: Ints) -> tuple[Ints, QuadMesh]:
    """Return the quads that share a node with some, ascending, and a mesh of them: whole sectors at these nodes."""
    is_theirs = np.zeros(mesh.n_points, bool)
    is_theirs[mesh.quads[quads]] = True
    around = np.flatnonzero(is_theirs[mesh.quads].any(axis=1))
    return around, replace(mesh, quads=mesh.quads[around], quad_region=mesh.quad_region[around])


def require_quality(mesh: QuadMesh, limit: float, most: int = 5) -> None:
    """Raise `QualityError` where a quad's scaled Jacobian is below `limit`.

    The message says how many quads are, how many of them the picture forces, and names at most `most` of the worst.
    """
    MIN_QUALITY.check("min_quality", limit)
    below = scaled_jacobian(mesh.points, mesh.quads) < limit
    if not below.any():
        return
    places = bad_places(mesh, limit, most)
    forced = int(np.count_nonzero(below & forced_quads(mesh, limit)))
    message = (
        f"{np.count_nonzero(below)} of {mesh.n_quads} quads have a scaled Jacobian below {limit:g}, "
        f"{forced} of them in sectors too narrow for more; lower the limit, or the size. The worst: "
    )
    raise QualityError(message + "; ".join(_told(mesh, place) for place in places), mesh, [p.quad for p in places])


def _told(mesh: QuadMesh, place: BadPlace) -> str:
    names = " | ".join(mesh.materials.name_of(m) for m in (place.material, *place.neighbours))
    angle = f", sector of {place.sector_angle:.1f} degrees" if place.sector_angle < 360.0 - 1e-6 else ""
    return f"{place.scaled_jacobian:.3f} at ({place.x:.6g}, {place.y:.6g}) in {names}{angle}"


class _Corners(NamedTuple):
    """Of all quads, shape (4, n_quads): NumPy reduces few long rows many times faster than many short ones."""

    cross: Floats  # product of the two edges at each corner
    dot: Floats
    lengths: Floats  # of the edge that leaves it


def _angles(corners: _Corners) -> Floats:
    angles = np.degrees(np.arctan2(corners.cross, corners.dot))
    angles[angles < 0.0] += 360.0
    return np.asarray(angles)


def _aspects(corners: _Corners) -> Floats:
    with np.errstate(divide="ignore"):
        return np.asarray(corners.lengths.max(axis=0) / corners.lengths.min(axis=0))


def _corners(points: Floats, quads: Ints) -> _Corners:
    x, y = (np.ascontiguousarray(points[:, k])[quads.T] for k in (0, 1))
    along, up = np.roll(x, -1, axis=0) - x, np.roll(y, -1, axis=0) - y
    back, down = -np.roll(along, 1, axis=0), -np.roll(up, 1, axis=0)
    dot = along * back + up * down + 0.0  # no -0, whose angle would be 180 degrees
    return _Corners(along * down - up * back, dot, np.hypot(along, up))


def _on_constraint(mesh: QuadMesh) -> Flags:
    """Tell of each half-edge whether it lies on a chain, shape (4 * n_quads,)."""
    starts = mesh.quads.ravel()
    ends = np.roll(mesh.quads, -1, axis=1).ravel()
    a, b = mesh.constraints.T
    return np.isin(_edge_keys(starts, ends, mesh.n_points), _edge_keys(a, b, mesh.n_points))


def _edge_keys(a: Ints, b: Ints, n_points: int) -> Ints:
    return np.asarray(np.minimum(a, b) * n_points + np.maximum(a, b))


def _materials_around(mesh: QuadMesh, q: int) -> tuple[int, ...]:
    touching = np.isin(mesh.quads, mesh.quads[q]).any(axis=1)
    others = np.unique(mesh.quad_material[touching])
    return tuple(int(m) for m in others if m != mesh.quad_material[q])
