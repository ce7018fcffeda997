#!/usr/bin/env bash
# A deck of ours with *USER MATERIAL in CalculiX: calculix_umat.sh FILE.inp
# Debian's ccx has some routines built in, chosen by the name of the material; LIN_ISO_EL takes Young's modulus and Poisson's ratio.
set -e
sed -i -E 's/MATERIAL, NAME=(MATERIAL_[01])/MATERIAL, NAME=LIN_ISO_EL_\1/; s/, MATERIAL=(MATERIAL_[01])/, MATERIAL=LIN_ISO_EL_\1/' "$1"
bash "$(dirname "$0")/calculix.sh" "$1"
