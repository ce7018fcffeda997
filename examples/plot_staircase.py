"""
Against the staircase
=====================

PyVista can make quads of an image by itself: one quad a pixel. Its boundaries are stairs, at any resolution, and a
circle is too long by 4 / pi. A mesh that follows the boundary needs a fraction of the quads.
"""

import numpy as np
import pyvista as pv

image = pv.ImageData(dimensions=(80, 80, 1))
image["label"] = (np.hypot(image.points[:, 0] - 40, image.points[:, 1] - 38) < 26).astype(int)

# %%
# The staircase: cells of points, as quads.
stairs = image.points_to_cells("label").cast_to_structured_grid().cast_to_unstructured_grid()
mesh = image.imgquad.mesh(size=4)

plotter = pv.Plotter(shape=(1, 2), window_size=[1200, 600])
plotter.add_mesh(stairs, scalars="label", show_edges=True, cmap="Pastel1", show_scalar_bar=False, lighting=False)
plotter.view_xy()
plotter.camera.zoom(1.3)
plotter.subplot(0, 1)
mesh.imgquad.plot(plotter=plotter)
plotter.show()

# %%
# Length of the interface, and what it should be.
stairs["material"] = stairs["label"]
circle = 2 * np.pi * 26
lengths = []
for grid in (stairs, mesh):
    lines = grid.imgquad.boundaries()
    inner = lines.extract_cells((lines["boundary_labels"] >= 0).all(axis=1))
    lengths.append(inner.compute_cell_sizes()["Length"].sum())
print("staircase", lengths[0] / circle, "ours", lengths[1] / circle)
assert abs(lengths[0] / circle - 4 / np.pi) < 0.03
assert abs(lengths[1] / circle - 1) < 0.01
assert mesh.n_cells < stairs.n_cells / 8
