"""Two elastic layers in Kratos: `kratos_force.py FILE.med`, of 4, 8 or 9 nodes."""

import sys

import KratosMultiphysics as K
import KratosMultiphysics.MedApplication as Med
import KratosMultiphysics.StructuralMechanicsApplication as Structural

K.Logger.GetDefaultOutput().SetSeverity(K.Logger.Severity.WARNING)
model = K.Model()
part = model.CreateModelPart("layers")
part.ProcessInfo[K.DOMAIN_SIZE] = 2
for variable in (K.DISPLACEMENT, K.REACTION, K.VOLUME_ACCELERATION):
    part.AddNodalSolutionStepVariable(variable)
Med.MedModelPartIO(sys.argv[1]).ReadModelPart(part)
# MedModelPartIO turns plane geometries over: turn them back
back = {4: (0, 3, 2, 1), 8: (0, 3, 2, 1, 7, 6, 5, 4), 9: (0, 3, 2, 1, 7, 6, 5, 4, 8)}
for number, (name, young) in enumerate((("material_0", 1.0), ("material_1", 10.0)), 1):
    values = part.CreateNewProperties(number)
    values.SetValue(K.CONSTITUTIVE_LAW, Structural.LinearElasticPlaneStress2DLaw())
    values.SetValue(K.YOUNG_MODULUS, young)
    values.SetValue(K.POISSON_RATIO, 0.0)
    values.SetValue(K.THICKNESS, 1.0)
    values.SetValue(K.DENSITY, 1.0)
    for geometry in part.GetSubModelPart(name).Geometries:
        nodes = [node.Id for node in geometry]
        kind = f"SmallDisplacementElement2D{len(nodes)}N"
        part.CreateNewElement(kind, geometry.Id, [nodes[i] for i in back[len(nodes)]], values)
for axis in "XYZ":
    variable, reaction = (K.KratosGlobals.GetVariable(f"{name}_{axis}") for name in ("DISPLACEMENT", "REACTION"))
    K.VariableUtils().AddDof(variable, reaction, part)
left, right = (part.GetSubModelPart(name).Nodes for name in ("left", "right"))
for node in left:
    node.Fix(K.DISPLACEMENT_X)
min(left, key=lambda node: node.Y).Fix(K.DISPLACEMENT_Y)
for node in right:
    node.Fix(K.DISPLACEMENT_X)
    node.SetSolutionStepValue(K.DISPLACEMENT_X, 0.06)
solver = K.SkylineLUFactorizationSolver()
scheme = K.ResidualBasedIncrementalUpdateStaticScheme()
builder = K.ResidualBasedBlockBuilderAndSolver(solver)
strategy = K.ResidualBasedLinearStrategy(part, scheme, builder, True, False, False, False)
strategy.Check()
strategy.Solve()
print("materials", "by name")
print("borders", "by name")
print("force", -sum(node.GetSolutionStepValue(K.REACTION_X) for node in left))
