"""From the names in scripts to pymeshlab's: no interface of pymeshlab gives the display names."""

from __future__ import annotations

import difflib
import importlib.util
from collections.abc import Collection, Iterable
from functools import cache
from pathlib import Path

from imgquad_mesh.spec import python_name

#: Display names (as `python_name` makes them) that pymeshlab's own table ``keys.txt`` lacks or has wrong. Found by
#: running all 281 filters of pymeshlab 2025.7; the four last ones need a graphics card.
_LATER_NAMES = {
    "cubic_stylization": "apply_coord_cubic_stylization",
    "make_mesh_developable": "apply_coord_developability_of_mesh",
    "per_face_normal_function": "compute_normal_by_function_per_face",
    "compute_ambient_occlusion": "compute_scalar_ambient_occlusion",
    "colorize_by_approximated_geodesic_distance_from_the_selected_points": (
        "compute_scalar_by_heat_geodesic_distance_from_selection_per_vertex"
    ),
    "compute_shape_diameter_function": "compute_scalar_by_shape_diameter_function_per_vertex",
    "compute_obscurance": "compute_scalar_by_volumetric_obscurance",
    "harmonic_parametrization": "compute_texcoord_parametrization_harmonic",
    "least_squares_conformal_maps_parametrization": "compute_texcoord_parametrization_least_squares_conformal_maps",
    "dodecahedron_symmetric": "create_dodecahedron_sym",
    "alpha_wrap": "generate_alpha_wrap",
    "reorient_face_normals_by_geometry": "meshing_re_orient_faces_by_geometry",
    "re_orient_all_faces_coherently": "meshing_re_orient_faces_coherently",
    "subdivision_surfaces_doo_sabin": "meshing_surface_subdivision_doo_sabin",
    "ambient_occlusion": "compute_scalar_ambient_occlusion_gpu",
    "shape_diameter_function": "compute_scalar_by_shape_diameter_function_per_vertex_gpu",
    "volumetric_obscurance": "compute_scalar_by_volumetric_obscurance_gpu",
    "gpu_filter_example": "save_snapshot",
}


def pymeshlab_folder() -> Path | None:
    """Return the folder of the pymeshlab package without importing it, or None where it is not installed."""
    found = importlib.util.find_spec("pymeshlab")
    return Path(found.origin).parent if found is not None and found.origin else None


@cache
def _display_names(folder: Path | None) -> dict[str, str]:
    table = folder / "keys.txt" if folder else None
    lines = table.read_text().splitlines() if table and table.is_file() else []
    pairs = (line.split() for line in lines)
    return {pair[0]: pair[1] for pair in pairs if len(pair) == 2} | _LATER_NAMES


def meshlab_function(name: str, known: Collection[str]) -> str | None:
    """Return pymeshlab's name of a filter.

    Parameters
    ----------
    name : str
        Display name (``Laplacian Smooth``) or Python name (``apply_coord_laplacian_smoothing``).
    known : collection of str
        ``pymeshlab.filter_list()``.

    Returns
    -------
    str or None
        One of `known`; None where there is no such filter.
    """
    if name in known:
        return name
    bare = python_name(name)
    function = _display_names(pymeshlab_folder()).get(bare, bare)
    if function in known:
        return function
    # a pymeshlab that has not yet got a filter under its later name keeps the older one
    return bare if bare in known else None


def nearest(name: str, known: Iterable[str]) -> str:
    """Return ``; did you mean X?`` for the nearest of `known` names, or nothing where none is near."""
    by_bare = {python_name(each): each for each in known}
    close = difflib.get_close_matches(python_name(name), by_bare, n=1, cutoff=0.6)
    return f"; did you mean {by_bare[close[0]]!r}?" if close else ""


def all_meshlab_names(known: Collection[str]) -> list[str]:
    """Return what a user may have meant: pymeshlab's names and what is left of the display names."""
    return [
        *known,
        *(name.replace("_", " ") for name, function in _display_names(pymeshlab_folder()).items() if function in known),
    ]
