#!/usr/bin/env bash
# Heat through two layers in OpenFOAM: openfoam_heat.sh FILE.msh (extruded, --interfaces none); two solid regions, coupled
set -e
export WM_PROJECT_DIR=${WM_PROJECT_DIR:-/usr/share/openfoam}
mesh=$(realpath "$1")
rm -rf case && mkdir -p case/system case/constant case/0 && cd case
head() { echo "FoamFile { version 2.0; format ascii; class $1; object $2; }"; }
{
    head dictionary controlDict
    echo "application chtMultiRegionSimpleFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 600; deltaT 1;"
    echo "writeControl timeStep; writeInterval 600; writePrecision 14; functions {"
    for region in material_0 material_1; do
        echo "flux_$region { type wallHeatFlux; libs (fieldFunctionObjects); region $region; writeControl onEnd; log true; }"
    done
    echo "}"
} > system/controlDict
{
    head dictionary fvSchemes
    echo "ddtSchemes { default steadyState; } gradSchemes { default leastSquares; } divSchemes { default none; }"
    echo "laplacianSchemes { default Gauss linear corrected; } interpolationSchemes { default linear; }"
    echo "snGradSchemes { default corrected; }"
} > system/fvSchemes
{
    head dictionary fvSolution
    echo "solvers { h { solver PCG; preconditioner DIC; tolerance 1e-15; relTol 0; } }"
    echo "SIMPLE { nNonOrthogonalCorrectors 3; } relaxationFactors { equations { h 1; } }"
} > system/fvSolution
gmshToFoam "$mesh" > gmshToFoam.log
checkMesh | grep -E "Mesh OK|Failed"
# the ends become walls, whose heat OpenFOAM measures; a 2D case would make back and front empty
for patch in left right; do foamDictionary constant/polyMesh/boundary -entry "entry0.$patch.type" -set wall > /dev/null; done
splitMeshRegions -cellZones -overwrite > split.log
{ head dictionary regionProperties; echo "regions ( fluid () solid (material_0 material_1) );"; } > constant/regionProperties
{ head uniformDimensionedVectorField g; echo "dimensions [0 1 -2 0 0 0 0]; value (0 0 0);"; } > constant/g
for region in material_0 material_1; do
    k=1; [ $region = material_1 ] && k=10
    mkdir -p constant/$region system/$region 0/$region
    {
        head dictionary thermophysicalProperties
        echo "thermoType { type heSolidThermo; mixture pureMixture; transport constIso; thermo hConst;"
        echo "equationOfState rhoConst; specie specie; energy sensibleEnthalpy; }"
        echo "mixture { specie { molWeight 1; } transport { kappa $k; } thermodynamics { Hf 0; Cp 1; } equationOfState { rho 1; } }"
    } > constant/$region/thermophysicalProperties
    cp system/fvSchemes system/fvSolution system/$region
    {
        head volScalarField T
        echo "dimensions [0 0 0 1 0 0 0]; internalField uniform 300; boundaryField {"
        echo '".*" { type zeroGradient; } left { type fixedValue; value uniform 300; } right { type fixedValue; value uniform 301; }'
        echo '"material_.*_to_.*" { type compressible::turbulentTemperatureCoupledBaffleMixed; Tnbr T; kappaMethod solidThermo;'
        echo "value uniform 300; } }"
    } > 0/$region/T
    {
        head volScalarField p
        echo 'dimensions [1 -1 -2 0 0 0 0]; internalField uniform 1e5; boundaryField { ".*" { type calculated; value uniform 1e5; } }'
    } > 0/$region/p
done
chtMultiRegionSimpleFoam > solve.log 2>&1 || { tail -20 solve.log; exit 1; }
echo "materials by name"
echo "borders by name"
# integral of the flux over the right end, per unit of thickness (10)
grep -E "min/max/integ\(right\)" solve.log | tail -1 | awk '{printf "heat %.10g\n", $NF / 10}'
