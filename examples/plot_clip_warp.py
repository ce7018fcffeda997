"""
Clip and warp
=============

A field on the nodes bends the mesh; a plane cuts it.
"""

import numpy as np
import pyvista as pv

image = pv.ImageData(dimensions=(96, 48, 1))
x, y = image.points[:, 0], image.points[:, 1]
image["label"] = (np.abs(y - 24 - 6 * np.sin(x / 12)) < 7).astype(int)
mesh = image.imgquad.mesh(size=3)

# %%
# A simple bending of the whole strip, exaggerated.
along = mesh.points[:, 0] / 96
mesh["bending"] = np.column_stack([np.zeros(mesh.n_points), -20 * along**2, np.zeros(mesh.n_points)])
bent = mesh.warp_by_vector("bending")

plotter = pv.Plotter()
plotter.add_mesh(mesh.outline(), color="grey")
bent.imgquad.plot(plotter=plotter)
plotter.show()

# %%
# The quads are still convex, and the materials are still theirs.
quality = bent.imgquad.quality()
assert quality["scaled_jacobian"].min() > 0.3
assert np.array_equal(bent["material"], mesh["material"])

# %%
# A cut through the mesh cuts quads: the pieces are no longer all quads, but their area is whole.
left = mesh.clip(normal="x", origin=(40, 0, 0))
right = mesh.clip(normal="x", origin=(40, 0, 0), invert=False)
left.plot(scalars="material", show_edges=True, cpos="xy", cmap="Pastel1", show_scalar_bar=False)
assert abs((left.area + right.area) / mesh.area - 1) < 1e-6
