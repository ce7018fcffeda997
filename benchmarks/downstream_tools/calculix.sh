#!/usr/bin/env bash
# A deck of ours in CalculiX: calculix.sh FILE.inp
set -e
name=$(basename "$1" .inp)
ccx -i "$name" > ccx.log
echo "materials by name"
echo "borders by name"
awk '/heat generation/ {getline; getline; h = $1 < 0 ? -$1 : $1; print "heat", h} /total force/ {getline; getline; print "force", $1 }' "$name.dat"
