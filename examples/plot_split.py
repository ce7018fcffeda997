"""
Threshold, split, outline
=========================

The mesh is an :class:`pyvista.UnstructuredGrid` like any other: PyVista's own filters take it apart.
"""

import numpy as np
import pyvista as pv

image = pv.ImageData(dimensions=(96, 64, 1))
x, y = image.points[:, 0], image.points[:, 1]
image["label"] = np.select([np.hypot(x - 30, y - 34) < 18, np.hypot(x - 68, y - 28) < 14], [1, 2])
mesh = image.imgquad.mesh(size=4)

# %%
# One material by :meth:`~pyvista.DataSetFilters.threshold`, all of them by name by
# :meth:`~pyvista.DataSetFilters.split_values`.
disk = mesh.threshold((1, 1), scalars="material")
names = ("matrix", "left disk", "right disk")
blocks = mesh.split_values(dict(zip(names, range(3), strict=True)), scalars="material")
print(blocks.keys(), [block.n_cells for block in blocks])

# %%
# The border of each block.
edges = pv.MultiBlock(
    [
        block.extract_feature_edges(
            boundary_edges=True, feature_edges=False, manifold_edges=False, non_manifold_edges=False
        )
        for block in blocks
    ]
)
plotter = pv.Plotter()
plotter.add_mesh(blocks["matrix"], color="white", show_edges=True, edge_color="lightgrey", lighting=False)
plotter.add_mesh(blocks["left disk"], color="orange", show_edges=True, lighting=False)
plotter.add_mesh(edges.combine(), color="black", line_width=4)
plotter.view_xy()
plotter.camera.zoom(1.4)
plotter.show()

# %%
# Nothing is lost on the way.
assert disk.n_cells == blocks["left disk"].n_cells
assert sum(block.n_cells for block in blocks) == mesh.n_cells
assert abs(disk.area / (np.pi * 18**2) - 1) < 0.02
border = edges[1].compute_cell_sizes()["Length"].sum()
print(disk.area / (np.pi * 18**2), border / (2 * np.pi * 18))
assert abs(border / (2 * np.pi * 18) - 1) < 0.02
