"""
Materials and quality
=====================

What a mesh is made of, how good its quads are, and where its irregular nodes lie.
"""

import numpy as np
import pyvista as pv
from scipy.spatial import cKDTree

# %%
# Grains: every pixel belongs to the nearest of a few seeds.
rng = np.random.default_rng(4)
seeds = rng.uniform(0, (120, 80), (14, 2))
image = pv.ImageData(dimensions=(120, 80, 1), spacing=(0.25, 0.25, 1))
image["grain"] = cKDTree(seeds).query(image.points[:, :2] / 0.25)[1]
mesh = image.imgquad.mesh(size=3)
mesh.imgquad.plot()

# %%
# Measures are cell arrays. They are those of :meth:`pyvista.DataObjectFilters.cell_quality`, but a quad that turns the
# wrong way is negative here.
quality = mesh.imgquad.quality()
print(quality.array_names)
theirs = mesh.cell_quality("scaled_jacobian")["scaled_jacobian"]
assert np.abs(quality["scaled_jacobian"] - theirs).max() < 1e-9

# %%
# Red nodes have fewer than four quads, blue ones more.
mesh.imgquad.plot("scaled_jacobian")

# %%
# All figures at once.
report = mesh.imgquad.report()
print({name: value for name, value in report.items() if name != "materials"})
assert report["inverted"] == 0
assert report["min_sj"] > 0.3
