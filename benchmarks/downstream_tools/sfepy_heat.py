"""Heat through two layers in SfePy: `sfepy_heat.py FILE` (.vtu or .vtk written with --plain)."""

import sys

import numpy as np
from sfepy.base.base import output
from sfepy.discrete import Equation, Equations, FieldVariable, Integral, Material, Problem
from sfepy.discrete.conditions import Conditions, EssentialBC
from sfepy.discrete.fem import FEDomain, Field, Mesh
from sfepy.solvers.ls import ScipyDirect
from sfepy.solvers.nls import Newton
from sfepy.terms import Term

output.set_output(quiet=True)
mesh = Mesh.from_file(sys.argv[1])
domain = FEDomain("domain", mesh)
omega = domain.create_region("Omega", "all")
width = mesh.coors[:, 0].max()
left = domain.create_region("Left", "vertices in x < 1e-9", "facet")
right = domain.create_region("Right", f"vertices in x > {width - 1e-9}", "facet")
layers = [domain.create_region(f"Layer{group}", f"cells of group {group}") for group in (1, 2)]
field = Field.from_args("temperature", np.float64, "scalar", omega, approx_order=1)
T, s = FieldVariable("T", "unknown", field), FieldVariable("s", "test", field, primary_var_name="T")
k = Material("k", values={"one": np.eye(2), "ten": 10.0 * np.eye(2)})
rule = Integral("i", order=2)
terms = [
    Term.new(f"dw_diffusion(k.{value}, s, T)", rule, layer, k=k, s=s, T=T)
    for value, layer in zip(("one", "ten"), layers, strict=True)
]
problem = Problem("heat", equations=Equations([Equation("balance", terms[0] + terms[1])]))
problem.set_bcs(ebcs=Conditions([EssentialBC("cold", left, {"T.0": 0.0}), EssentialBC("hot", right, {"T.0": 1.0})]))
problem.set_solver(Newton({}, lin_solver=ScipyDirect({})))
problem.solve(save_results=False)
flow = sum(
    problem.evaluate(f"dw_diffusion.2.{layer.name}(k.{value}, T, T)", mode="eval", k=k, T=T)
    for value, layer in zip(("one", "ten"), layers, strict=True)
)
print("materials", "by number")
print("borders", "by hand")
print("heat", float(flow))
