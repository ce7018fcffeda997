"""What became of each material: its pixels in the picture, its area in the mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .boundary.areas import enclosed_areas
from .measures.quality import region_areas
from .model import VOID, BoundaryGraph, LabelImage, QuadMesh

#: regions of this many pixels or more keep their area
LARGE_REGION = 50


@dataclass(frozen=True)
class MaterialAccount:
    """One line of the ledger. Areas are in pixels.

    Parameters
    ----------
    material : int
        Number of the material.
    name : str
        Its name.
    pixels : int
        In the picture.
    clean_pixels : int
        After noise removal; 0 if it is dropped.
    boundary_area, mesh_area : float
        Enclosed by the smoothed boundaries, and by the quads.
    error : float
        ``mesh_area / clean_pixels - 1``; 0 where it is not meshed.
    quads : int
        Number of quads.
    """

    material: int
    name: str
    pixels: int
    clean_pixels: int
    boundary_area: float
    mesh_area: float
    error: float
    quads: int


@dataclass(frozen=True)
class RegionErrors:
    """How far areas of single regions are from their pixels, as shares; and how many regions there are.

    Parameters
    ----------
    regions, small_regions : int
        All regions, and those of fewer than `LARGE_REGION` pixels.
    worst_error, worst_small_error : float
        Of the regions of `LARGE_REGION` pixels or more, and of the smaller ones.
    worst_small_material, worst_small_pixels : int
        Of the region with `worst_small_error`; `VOID` and 0 if there is none.
    """

    regions: int
    small_regions: int
    worst_error: float
    worst_small_error: float
    worst_small_material: int
    worst_small_pixels: int


def material_ledger(
    picture: LabelImage,
    clean: LabelImage,
    boundary: BoundaryGraph,
    mesh: QuadMesh,
    pixel_sides: tuple[float, float] = (1.0, 1.0),
) -> tuple[MaterialAccount, ...]:
    """Account for every material of `picture`, in the order of its numbers.

    Parameters
    ----------
    picture, clean : LabelImage
        Before noise removal, and as meshed.
    boundary : BoundaryGraph
        The smoothed boundaries.
    mesh : QuadMesh
        The mesh.
    pixel_sides : tuple of float
        Width and height of a pixel in the mesh's unit.
    """
    pixels_in_square = clean.labels.size / (boundary.shape[0] * boundary.shape[1])
    enclosed = enclosed_areas(boundary) * pixels_in_square
    meshed = region_areas(mesh) / (pixel_sides[0] * pixel_sides[1])
    left = clean.pixels
    rows = []
    for label, before in picture.pixels.items():
        pixels = left.get(label, 0)
        area = float(meshed[mesh.region_label == label].sum())
        rows.append(
            MaterialAccount(
                material=label,
                name=picture.materials.name_of(label),
                pixels=before,
                clean_pixels=pixels,
                boundary_area=float(enclosed[boundary.region_label == label].sum()),
                mesh_area=area,
                error=area / pixels - 1.0 if pixels else 0.0,
                quads=int(np.count_nonzero(mesh.quad_material == label)),
            )
        )
    return tuple(rows)


def region_errors(boundary: BoundaryGraph) -> RegionErrors:
    """Compare the enclosed area of each region with its pixels."""
    error = enclosed_areas(boundary) / boundary.region_pixels - 1.0
    small = boundary.region_pixels < LARGE_REGION
    worst = int(np.argmax(np.where(small, np.abs(error), -1.0))) if small.any() else VOID
    return RegionErrors(
        regions=len(error),
        small_regions=int(np.count_nonzero(small)),
        worst_error=float(np.abs(error[~small]).max(initial=0.0)),
        worst_small_error=float(np.abs(error[small]).max(initial=0.0)),
        worst_small_material=int(boundary.region_label[worst]) if worst != VOID else VOID,
        worst_small_pixels=int(boundary.region_pixels[worst]) if worst != VOID else 0,
    )
