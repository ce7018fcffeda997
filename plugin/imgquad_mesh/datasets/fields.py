"""What the materials are called, in the field arrays of a dataset."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pyvista as pv

if TYPE_CHECKING:
    from imgquad_core.model import Materials

MATERIAL_FIELDS = ("material_numbers", "material_names", "material_colors")


def put_materials(dataset: pv.DataSet, materials: Materials) -> None:
    """Store what the materials are called in the field arrays of a dataset, in place."""
    dataset.field_data["material_numbers"] = materials.labels
    dataset.field_data["material_names"] = list(materials.names)
    dataset.field_data["material_colors"] = materials.colors


def materials_of(dataset: pv.DataSet) -> Materials:
    """Return what `put_materials` stored."""
    from imgquad_core.model import Materials

    fields = dataset.field_data
    return Materials(fields["material_numbers"], tuple(map(str, fields["material_names"])), fields["material_colors"])
