"""Two elastic layers in OpenSees: `opensees_force.py FILE.npz`, of 4, 8 or 9 nodes."""

import sys

import numpy as np
import openseespy.opensees as ops

with np.load(sys.argv[1]) as file:
    points, cells = file["points"], file["cells"]
    layers = [file["element_sets/material 0"], file["element_sets/material 1"]]
    left, right = file["node_sets/left"], file["node_sets/right"]
kind = {4: "quad", 8: "quad8n", 9: "quad9n"}[cells.shape[1]]
ops.model("basic", "-ndm", 2, "-ndf", 2)
for number, (x, y) in enumerate(points.tolist()):
    ops.node(number, x, y)
for material, (young, ids) in enumerate(zip((1.0, 10.0), layers, strict=True), 1):
    ops.nDMaterial("ElasticIsotropic", material, young, 0.0)
    for cell in ids.tolist():
        ops.element(kind, cell, *cells[cell].tolist(), 1.0, "PlaneStress", material)
pinned = int(left[np.argmin(points[left, 1])])
for node in left.tolist():
    ops.fix(node, 1, int(node == pinned))
ops.timeSeries("Constant", 1)
ops.pattern("Plain", 1, 1)
for node in right.tolist():
    ops.sp(node, 1, 0.06)
ops.constraints("Transformation")
ops.numberer("RCM")
ops.system("UmfPack")
ops.test("NormUnbalance", 1e-12, 10)
ops.algorithm("Linear")
ops.integrator("LoadControl", 1.0)
ops.analysis("Static")
ops.analyze(1)
ops.reactions()
print("materials", "by name")
print("borders", "by name")
print("force", -sum(ops.nodeReaction(node, 1) for node in left.tolist()))
