"""The mesh of a tile: again where its pieces are on too wide a stride, and where shared edges are to be halved."""

from __future__ import annotations

from typing import Any

import numpy as np

from imgquad_core.arrays import Ints
from imgquad_core.errors import TopologyError
from imgquad_core.mesher import WIDEST, MeshingOptions

from .files import load_arrays, save_arrays
from .halving import all_edges, edges_of, no_edges, wished_edges, with_edges_halved
from .job import Job
from .meshes import Made, TileMesh, mesh_outlines
from .outlines import EdgesOf, Outlines, settled
from .windows import regions_of

ATTEMPTS = 3  #: at a tile
NOTHING = -1  # the attempt that made its mesh, where there is none


def mesh(job: Job, t: int, attempt: int, *_: Any) -> None:
    """Mesh the faces of a tile, with the edges of shared chains halved that it or a neighbour has wished for before.

    All pieces of a region get the stride that the region as a whole would: the one that none of them is poor on. A
    tile that is on such strides already is only filled anew near edges that are halved.

    Raises
    ------
    TopologyError
        In the last attempt, faces cannot be filled.
    """
    path = job.path("wish", t, attempt)
    if path.exists():
        return
    mine = outlines_there(job, t)
    halved = [_wished_for(job, t, mine, k) for k in range(attempt)]
    before = _kept(job, t, attempt - 1) if attempt > 0 else None
    if before and not halved[-1]:
        save_arrays(path, **before | {"edges": no_edges()})
        return
    found = _settled(job, t, mine, halved)
    made = _mended(job, t, before, _settled(job, t, mine, halved[:-1]), halved[-1]) if before else None
    made = made or _made_anew(job, mine, found, attempt)
    if made is not None:
        save_arrays(job.path("mesh", t, attempt), **made.mesh._asdict())
        edges = wished_edges(made.mesh, found, _options(job).tuning.worst, attempt)
        save_arrays(path, edges=edges, made=attempt, region=mine.region, stride=made.stride, fell=made.fell)
        return
    if attempt == ATTEMPTS - 1 or not mine.shared.any():
        raise TopologyError(f"tile {job.grid.place(t)} cannot be filled between its neighbours")
    none = np.zeros(len(mine.region), np.int64)
    save_arrays(path, edges=all_edges(found), made=NOTHING, region=mine.region, stride=none, fell=none > 0)


def _kept(job: Job, t: int, attempt: int) -> dict[str, Any] | None:
    """Return what an attempt left, if there is a mesh and no face of it is on too wide a stride."""
    found = load_arrays(job.path("wish", t, attempt))
    return found if found["made"] != NOTHING and _is_on_its_strides(job, found) else None


def _mended(job: Job, t: int, before: dict[str, Any], outlines: Outlines, halved: EdgesOf) -> Made | None:
    """Return the mesh that was made before, with edges halved; None where that does not do."""
    mesh = TileMesh(**load_arrays(job.path("mesh", t, int(before["made"]))))
    mended = with_edges_halved(mesh, edges_of(outlines, halved), outlines, _options(job))
    return Made(mended, before["stride"], before["fell"]) if mended else None


def _made_anew(job: Job, mine: Outlines, found: Outlines, attempt: int) -> Made | None:
    """Return the mesh of a tile; None where faces cannot be filled."""
    widest = _widest(job, mine.region) if attempt > 0 else np.full(len(mine.region), WIDEST)
    return mesh_outlines(found, job.grid.shape[0], _options(job), widest, regions_of(job).is_cut[mine.region])


def strides(job: Job, *_: Any) -> None:
    """Find the stride that all pieces of each region can be meshed on."""
    path = job.path("strides")
    if path.exists():
        return
    is_cut = regions_of(job).is_cut
    found = np.full(len(is_cut), WIDEST)
    for t in range(job.grid.n_tiles):
        made = load_arrays(job.path("wish", t, 0))
        here = made["fell"] & is_cut[made["region"]]
        np.minimum.at(found, made["region"][here], made["stride"][here])
    narrow = np.flatnonzero(found < WIDEST)
    save_arrays(path, region=narrow, widest=found[narrow])


def last_mesh(job: Job, t: int) -> TileMesh:
    """Return the mesh of a tile after all attempts."""
    made = int(load_arrays(job.path("wish", t, ATTEMPTS - 1))["made"])
    return TileMesh(**load_arrays(job.path("mesh", t, made)))


def outlines_there(job: Job, t: int) -> Outlines:
    """Return the smoothed chains around the faces of a tile, as it found them."""
    return Outlines(**load_arrays(job.path("outlines", t)))


def _settled(job: Job, t: int, mine: Outlines, halved: list[EdgesOf]) -> Outlines:
    return settled(t, mine, lambda other: outlines_there(job, other), halved)


def _options(job: Job) -> MeshingOptions:
    rules = job.rules()
    return rules.options.meshing(rules.legend.materials)


def _wished_for(job: Job, t: int, mine: Outlines, attempt: int) -> EdgesOf:
    """Return the edges of a tile's shared chains that somebody wished to be halved in an attempt.

    What is meshed again on other strides wishes anew.
    """
    keys = {tuple(key) for key in mine.key[mine.shared].tolist()}
    found: dict[tuple[int, ...], set[int]] = {}
    for other in job.grid.around(t):
        wish = load_arrays(job.path("wish", other, attempt))
        if _is_on_its_strides(job, wish):
            for *key, edge in wish["edges"].tolist():
                if tuple(key) in keys:
                    found.setdefault(tuple(key), set()).add(edge)
    return found


def _is_on_its_strides(job: Job, wish: dict[str, Any]) -> bool:
    """Tell whether no face of a tile is on a wider stride than its region can be meshed on."""
    return bool((wish["stride"] <= _widest(job, wish["region"])).all())


def _widest(job: Job, region: Ints) -> Ints:
    """Return the stride that faces of some regions are meshed on at most, once that is known."""
    known = load_arrays(job.path("strides"))
    limits = dict(zip(known["region"].tolist(), known["widest"].tolist(), strict=True))
    return np.array([limits.get(number, WIDEST) for number in region.tolist()], np.int64)
