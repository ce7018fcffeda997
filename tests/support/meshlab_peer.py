"""What pymeshlab does by itself, for tests to compare with: always in a process of its own.

``write SCRIPT MESH``: applies some filters to a mesh of quads and saves the MeshSet's script.
``apply SCRIPT MESH POINTS``: runs a script in MeshLab's own way and saves the points at the end.
"""

from __future__ import annotations

import sys

import numpy as np
import pymeshlab


def write(script: str, mesh: str) -> None:
    meshes = pymeshlab.MeshSet(False)
    meshes.load_new_mesh(mesh)
    meshes.compute_selection_from_mesh_border()
    meshes.apply_selection_inverse(invfaces=True, invverts=True)
    meshes.apply_coord_laplacian_smoothing(stepsmoothnum=1, boundary=True, selected=True)
    meshes.set_selection_none()
    meshes.get_geometric_measures()
    meshes.get_topological_measures_from_quad_mesh()
    meshes.compute_scalar_by_aspect_ratio_per_face(metric="inradius/circumradius")
    meshes.compute_color_from_scalar_per_face(colormap="Plasma")
    meshes.meshing_merge_close_vertices(threshold=pymeshlab.PureValue(1e-9))
    meshes.generate_copy_of_current_mesh()
    meshes.compute_matrix_from_rotation(rotaxis="Z axis", angle=30, freeze=True)
    meshes.compute_matrix_from_translation(axisx=1000.5, axisy=0.1, freeze=True)
    meshes.generate_by_merging_visible_meshes()
    meshes.save_filter_script(script)


def apply(script: str, mesh: str, points: str) -> None:
    meshes = pymeshlab.MeshSet(False)
    meshes.load_new_mesh(mesh)
    meshes.load_filter_script(script)
    meshes.apply_filter_script()
    np.save(points, meshes.current_mesh().vertex_matrix())


if __name__ == "__main__":
    {"write": write, "apply": apply}[sys.argv[1]](*sys.argv[2:])
