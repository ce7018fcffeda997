"""What a run tells its user to change: too many quads for the sizes asked for, materials that a tolerance took."""

from __future__ import annotations

import numpy as np

from .boundary import true_shape
from .model import LabelImage, QuadMesh
from .options import MeshOptions
from .picture import sizes_by_number, widest_part
from .pipeline import Run

MUCH, MATTERS = 0.5, 0.01  #: share of a material that is lost, and of the picture that it had, from which it is told
_REMEDIES = "remove noise (min-pixels, min-length), ask for a smaller size or for another tolerance"
_FIRST_REMEDY = (
    "remove noise (min-pixels, min-length), ask for a smaller size, set tolerance {:g} (half the size), which gives "
    "what is thinner to its neighbours"
)
MANY_TIMES, MANY_QUADS = 4.0, 1000  #: quads over area / size^2, and in all, from which thin features are told


def thin_features(labels: LabelImage, mesh: QuadMesh, options: MeshOptions) -> str | None:
    """Say how many more quads there are than the sizes asked for would give, with the remedies; None if few.

    Parameters
    ----------
    labels : LabelImage
        The materials as meshed.
    mesh : QuadMesh
        Its mesh.
    options : MeshOptions
        Sizes in pixels.
    """
    sizes = dict.fromkeys(labels.materials.labels.tolist(), options.size)
    sizes |= sizes_by_number(labels.materials, options.material_sizes)
    true = true_shape(labels.shape, options.pixel_sides).shape
    expected = (
        true[0]
        * true[1]
        / labels.labels.size
        * sum(
            np.count_nonzero(labels.labels == number) / min(size, options.boundary_size or size) ** 2
            for number, size in sizes.items()
        )
    )
    if mesh.n_quads <= max(MANY_TIMES * expected, MANY_QUADS):
        return None
    return (
        f"thin features force {mesh.n_quads} quads, {mesh.n_quads / expected:.1f} times area / size^2: "
        f"{_REMEDIES if options.tolerance else _FIRST_REMEDY.format(0.5 * options.size)}, or drop or merge materials"
    )


def lost_materials(done: Run) -> tuple[str, ...]:
    """Name the materials that a tolerance took half or more of, or say that it is too wide, with the remedies."""
    names, n_pixels = done.clean.materials.name_of, done.clean.labels.size
    if done.too_wide and len(done.pixel_boundary.region_label) > 1:
        return (_too_wide(done),)
    return tuple(
        f"material {names(row.material)} loses {row.lost / row.pixels:.0%} of its area: it is thinner than "
        f"{done.options.tolerance:g} px; keep it (keep {names(row.material)}) or lower the tolerance"
        for row in done.absorbed
        if row.lost > MUCH * row.pixels and (row.pixels >= MATTERS * n_pixels or row.absorbed == row.regions)
    )


def _too_wide(done: Run) -> str:
    tolerance, widest = done.options.tolerance, widest_part(done.clean)
    found = (
        f"no part of the picture is that wide (the widest: {widest:.0f} px)"
        if widest <= tolerance
        else f"no region of the picture has its square, {tolerance**2:.0f} pixels"
    )
    return f"tolerance {tolerance:g} px: {found}, so it is meshed as without a tolerance; lower it"
