"""
A photo to a mesh
=================

The coins of scikit-image: noise, uneven light, hundreds of grey values. Segmentation finds the greys that matter, noise
removal takes what is too small to be meshed.
"""

import numpy as np
import pyvista as pv
from skimage.data import coins
from skimage.filters import gaussian

picture = gaussian(coins(), 2, preserve_range=True)[:150, :200]

# %%
# An array becomes an image with its top row at the largest y, as ``pv.read`` gives it.
image = pv.ImageData(dimensions=(*picture.shape[::-1], 1))
image["grey"] = picture[::-1].ravel()
segmented = image.imgquad.segment(colors=2).imgquad.remove_noise(min_pixels=400, min_length=30)
print(list(segmented.field_data["material_names"]))

# %%
# Sizes are in pixels: fine at the rims of the coins, coarse elsewhere.
mesh = segmented.imgquad.mesh(size=8, boundary_size=4)

plotter = pv.Plotter(shape=(1, 2), window_size=[1200, 480])
plotter.add_mesh(image, scalars="grey", cmap="gray", show_scalar_bar=False)
plotter.view_xy()
plotter.camera.zoom(1.4)
plotter.subplot(0, 1)
mesh.imgquad.plot(plotter=plotter)
plotter.show()

# %%
# The coins cover what they cover in the picture.
report = mesh.imgquad.report()
light = segmented.field_data["material_numbers"][-1]
share = np.mean(segmented["material"] == light)
areas = {name: row["area"] for name, row in report["materials"].items()}
print(areas, report["min_sj"])
assert abs(list(areas.values())[-1] / picture.size - share) < 0.01
assert report["inverted"] == 0
