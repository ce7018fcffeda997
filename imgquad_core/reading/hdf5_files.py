"""HDF5 files: .h5oina of Oxford Instruments, DREAM.3D, and arrays of other programs; by h5py."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imgquad_core.errors import InputError

from .calibration import Calibration, PixelSize, size_of
from .crystal_map import CrystalMap, Phase, crystal_picture, crystals_of, grain_names
from .decoding import Stack, assert_pixels, decoding, optional
from .grains import LAUE_GROUPS, quaternions_of
from .hdf5_texts import texts_of
from .numpy_files import chosen_array
from .options import ReadOptions
from .packed import DEFLATE, assert_unpacks
from .picture import Picture, picture_of

#: the array of grain numbers that DREAM.3D makes
_GRAINS = "FeatureIds"
#: DREAM.3D's numbers of crystal structures -> Laue group
_LAUE = dict(enumerate(("6/mmm", "m-3m", "6/m", "m-3", "-1", "2/m", "mmm", "4/m", "4/mmm", "-3", "-3m x")))


def read_hdf5(path: Path, options: ReadOptions) -> Picture:
    """Read an EBSD map (.h5oina), DREAM.3D's grains, or the array that `scalars` names (its path, or the end of it)."""
    h5py = optional("hdf5", path)
    with decoding(path), h5py.File(path, "r") as file:
        ebsd = _oina_group(file)
        if ebsd is not None and options.scalars in (None, "phases", "grains"):
            return crystal_picture(path, _oina_map(path, ebsd, options), options)
        return _array_picture(path, file, options)


# ------------------------------------------------------------------------------------------------- .h5oina


def _oina_group(file: Any) -> Any:
    """Return the group of the first EBSD map, None where there is none."""
    for name in file:
        group = file[name].get("EBSD") if hasattr(file[name], "get") else None
        if group is not None and "Phase" in group.get("Data", {}) and "X Cells" in group.get("Header", {}):
            return group
    return None


def _oina_map(path: Path, group: Any, options: ReadOptions) -> CrystalMap:
    header, data = group["Header"], group["Data"]
    n_cols, n_rows = int(_scalar(path, header["X Cells"])), int(_scalar(path, header["Y Cells"]))
    assert_pixels(path, n_cols, n_rows, options)
    n = n_rows * n_cols
    for name in ("Phase", "Euler"):
        if data[name].shape[0] != n:
            raise InputError(f"{path} has {data[name].shape[0]} values of {name} for {n_cols} x {n_rows} points")
        _assert_sound(path, data[name], options)
    phase = np.nan_to_num(np.asarray(data["Phase"], float).reshape(n_rows, n_cols)).astype(np.int32)
    euler = np.asarray(data["Euler"], float).reshape(n_rows, n_cols, 3)
    lost = (phase <= 0) | ~np.isfinite(euler).all(axis=2)
    phases = {int(number): _oina_phase(path, found) for number, found in header["Phases"].items()}
    unknown = np.setdiff1d(phase[~lost], list(phases))
    if len(unknown):
        raise InputError(f"{path} holds phase {unknown[0]}, its header names {sorted(phases)}: export it anew")
    size = size_of(
        float(_scalar(path, header["X Step"])), float(_scalar(path, header["Y Step"])), "um", "step of the map"
    )
    return CrystalMap(np.where(lost, -1, phase).astype(np.int32), np.nan_to_num(euler), phases, size)


def _oina_phase(path: Path, group: Any) -> Phase:
    laue = int(_scalar(path, group["Laue Group"]))
    return Phase(
        texts_of(path, group["Phase Name"])[0], LAUE_GROUPS[laue - 1] if 1 <= laue <= len(LAUE_GROUPS) else "-1"
    )


def _scalar(path: Path, dataset: Any) -> Any:
    return _numbers(path, dataset)[0]


def _numbers(path: Path, dataset: Any) -> NDArray[Any]:
    """Return the numbers of a small dataset, in a row."""
    _assert_numbers(path, dataset)
    return np.ravel(dataset[()])


def _assert_numbers(path: Path, dataset: Any) -> None:
    """Raise for all but numbers: what damage turns into something else may take the HDF5 library down."""
    if dataset.dtype.kind not in "biuf" or not dataset.size:
        raise InputError(f"{path} holds no numbers in {dataset.name}: it is damaged, save it anew")


# -------------------------------------------------------------------------------------------------- arrays


def _array_picture(path: Path, file: Any, options: ReadOptions) -> Picture:
    arrays = _arrays(file)
    name = chosen_array(path, list(arrays), _by_its_end(arrays, options), _grains_among(arrays))
    dataset = arrays[name]
    values = _plane(path, name, dataset, options)
    calibration, notes = Calibration(_spacing(path, file, name)), (f"array {name}",)
    is_labels = name.endswith(f"/{_GRAINS}")
    found = replace(picture_of(values, str(path)), labels=is_labels, calibration=calibration, notes=notes)
    return _with_crystals(found, path, dataset, options) if is_labels else found


def _arrays(file: Any) -> dict[str, Any]:
    """Return the arrays of numbers that have rows and columns, by their paths; links are not followed."""
    found: dict[str, Any] = {}

    def add(name: str, node: Any) -> None:
        if hasattr(node, "dtype") and node.dtype.kind in "biuf" and len(node.shape) >= 2:
            rows, cols = _rows_and_columns(node.shape)
            if min(rows, cols) > 1:
                found[name] = node

    file.visititems(add)
    return found


def _rows_and_columns(shape: tuple[int, ...]) -> tuple[int, int]:
    is_stack = len(shape) == 4 or (len(shape) == 3 and shape[2] > 4)
    return (shape[1], shape[2]) if is_stack else (shape[0], shape[1])


def _by_its_end(arrays: Mapping[str, Any], options: ReadOptions) -> ReadOptions:
    """Return options with the whole path of the array whose last part is asked for, if only one has it."""
    ends = [name for name in arrays if options.scalars is not None and name.endswith(f"/{options.scalars}")]
    return replace(options, scalars=ends[0]) if len(ends) == 1 and options.scalars not in arrays else options


def _grains_among(arrays: Mapping[str, Any]) -> str | None:
    found = [name for name in arrays if name.endswith(f"/{_GRAINS}")]
    return found[0] if len(found) == 1 else None


def _plane(path: Path, name: str, dataset: Any, options: ReadOptions) -> NDArray[Any]:
    """Return one plane of (rows, columns), or colours, of an array of 2, 3 or 4 axes: z, y, x, components."""
    shape = dataset.shape
    if len(shape) > 4:
        raise InputError(f"array {name} of {path} has {len(shape)} axes: save one plane by itself")
    rows, cols = _rows_and_columns(shape)
    assert_pixels(path, cols, rows, options)
    _assert_sound(path, dataset, options)
    if len(shape) == 4 or (len(shape) == 3 and shape[2] > 4):
        plane = dataset[Stack(f"{name} of {path}", (("frame", shape[0]),)).choose(options)["frame"]]
    else:
        plane = dataset[()]
    n = plane.shape[2] if plane.ndim == 3 else 1
    if plane.ndim < 3 or n == 1 or (n in (3, 4) and plane.dtype == np.uint8 and options.channel is None):
        return np.asarray(plane if plane.ndim == 2 or n > 1 else plane[..., 0])
    return np.asarray(plane[..., Stack(f"{name} of {path}", (("channel", n),)).choose(options)["channel"]])


def _assert_sound(path: Path, dataset: Any, options: ReadOptions) -> None:
    """Raise for all but numbers, for values in other files, and for chunks that unpack to more than they stand for."""
    _assert_numbers(path, dataset)
    if dataset.external or dataset.is_virtual:
        raise InputError(f"{path} keeps {dataset.name} in other files: save it into one")
    if dataset.chunks is None:
        return
    size = int(np.prod(dataset.chunks, dtype=object)) * dataset.dtype.itemsize
    if size > 16 * options.max_pixels:
        raise InputError(f"{path} holds {dataset.name} in chunks of {size} bytes: save it in smaller ones")
    if dataset.compression != "gzip":
        return
    for k in range(dataset.id.get_num_chunks()):
        chunk = dataset.id.get_chunk_info(k)
        if chunk.size * DEFLATE > 4 * size:
            assert_unpacks(path, dataset.id.read_direct_chunk(chunk.chunk_offset)[1], size)


def _spacing(path: Path, file: Any, name: str) -> PixelSize | None:
    """Return DREAM.3D's spacing: a dataset of the geometry beside the arrays, or an attribute of it (DREAM3D-NX)."""
    container = file[name].parent.parent
    geometry = container.get("_SIMPL_GEOMETRY")
    if geometry is not None and "SPACING" in geometry:
        values = _numbers(path, geometry["SPACING"])
    elif "_SPACING" in container.attrs and container.attrs.get_id("_SPACING").dtype.kind in "iuf":
        values = np.ravel(container.attrs["_SPACING"])
    else:
        return None
    if len(values) < 2:
        return None
    return size_of(float(values[0]), float(values[1]), "", "SPACING of DREAM.3D")


def _with_crystals(picture: Picture, path: Path, dataset: Any, options: ReadOptions) -> Picture:
    """Take grain 0 for no grain, as DREAM.3D does, and add the phase and mean orientation of each grain."""
    grains = np.where(picture.values > 0, picture.values, -1).astype(np.int32)
    void = grains < 0
    if void.all():
        raise InputError(f"{path} holds no grain in {dataset.name}: segment features first")
    picture = replace(picture, void=void if void.any() else None)
    group = dataset.parent
    if "EulerAngles" not in group or "Phases" not in group:
        return picture
    euler, phase = (_plane_like(path, group[name], options) for name in ("EulerAngles", "Phases"))
    if euler.shape != (*grains.shape, 3):
        return picture
    crystals = crystals_of(grains, phase.astype(np.int32), quaternions_of(euler), _phases(path, group.parent))
    return replace(picture, crystals=crystals, names=grain_names(crystals))


def _plane_like(path: Path, dataset: Any, options: ReadOptions) -> NDArray[Any]:
    _assert_sound(path, dataset, options)
    plane = dataset[options.frame or 0] if len(dataset.shape) == 4 else dataset[()]
    return np.asarray(plane if plane.ndim == 3 and plane.shape[2] > 1 else plane.reshape(plane.shape[:2]))


def _phases(path: Path, container: Any) -> dict[int, Phase]:
    """Return the phases of the ensemble data beside the cells; number 0 stands for none."""
    for group in container.values():
        if hasattr(group, "get") and "CrystalStructures" in group:
            codes = _numbers(path, group["CrystalStructures"]).tolist()
            texts = texts_of(path, group["PhaseName"]) if "PhaseName" in group else []
            return {
                k: Phase(texts[k] if k < len(texts) else f"phase {k}", _LAUE.get(int(code), "-1"))
                for k, code in enumerate(codes)
                if k > 0
            }
    return {}
