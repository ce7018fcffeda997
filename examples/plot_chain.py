"""
One filter a stage
==================

An image of PyVista becomes a mesh in five steps, each a filter of its own. Every step gives a dataset of PyVista that
can be looked at, saved, and read again.
"""

import numpy as np
import pyvista as pv

# %%
# A picture of three materials: a square and a disk in a matrix. PyVista finds ``.imgquad`` by itself: nothing more is
# imported.
image = pv.ImageData(dimensions=(96, 64, 1))
x, y = image.points[:, 0], image.points[:, 1]
material = np.zeros(image.n_points, int)
material[(abs(x - 32) < 16) & (abs(y - 36) < 14)] = 1
material[np.hypot(x - 56, y - 26) < 15] = 2
image["label"] = material

# %%
# The boundaries run along the sides and corners of the pixels. ``boundary_labels`` tells the materials on the left and
# on the right, -1 for the outside.
segmented = image.imgquad.segment()
boundaries = segmented.imgquad.remove_noise().imgquad.boundaries()
print(boundaries["boundary_labels"])

# %%
# Smooth boundaries lie within a pixel of them, keep the areas, and are cut into edges of the final mesh.
smooth = boundaries.imgquad.smooth(size=4)

plotter = pv.Plotter()
plotter.add_mesh(image.points_to_cells("label"), cmap="Pastel1", show_scalar_bar=False)
plotter.add_mesh(boundaries, color="grey", line_width=1)
plotter.add_mesh(smooth, color="black", line_width=3)
plotter.add_points(smooth.points, color="black", point_size=7)
plotter.view_xy()
plotter.camera.zoom(1.4)
plotter.show()

# %%
# Quads fill them.
mesh = smooth.imgquad.quads()
mesh.imgquad.plot()

# %%
# ``mesh`` does all of this in one call, with the same result to the bit.
whole = image.imgquad.mesh(size=4)
assert np.array_equal(whole.points, mesh.points)
assert np.array_equal(whole.cells, mesh.cells)
