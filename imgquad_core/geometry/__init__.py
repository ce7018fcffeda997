"""Planar geometry that more than one stage needs: half-edges, one quad, exact crossings, the ambiguous corner."""
