"""Pictures from files: one table of formats, one reader each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from imgquad_core.errors import InputError

from .decoding import NoSuchPicture
from .dicom import MAGIC as DICM
from .dicom import PREAMBLE, read_dicom
from .ebsd_texts import read_ang, read_ctf
from .hdf5_files import read_hdf5
from .info_bar import cut_info_bar
from .leica import read_lif
from .numpy_files import read_npy, read_npz
from .options import ReadOptions
from .picture import Picture, picture_of
from .pillow_images import read_by_pillow
from .tiff import MAGIC, read_tiff
from .volumes import read_mrc, read_nifti, read_nrrd
from .zarr_images import is_zarr, read_zarr

__all__ = ["FORMATS", "Format", "Picture", "ReadOptions", "count_pictures", "format_of", "picture_of", "read_picture"]

Reader = Callable[[Path, ReadOptions], Picture]


class Format(NamedTuple):
    """A format that is read."""

    name: str
    extensions: tuple[str, ...]
    read: Reader
    extra: str = ""  #: extra of this package that it needs; empty: none


_RASTER = (".png", ".jpg", ".jpeg", ".bmp", ".dib", ".ppm", ".pgm", ".pbm", ".gif", ".webp")
_TIFF = (".tif", ".tiff", ".btf", ".svs", ".ndpi", ".scn", ".lsm", ".stk")
#: what is read by its extension; PNG, JPEG and TIFF by their content, whatever their names
FORMATS = (
    Format("PNG, JPEG, BMP, PPM, GIF, WebP", _RASTER, read_by_pillow),
    Format("TIFF, OME-TIFF, GeoTIFF, SVS", _TIFF, read_tiff),
    Format("NumPy", (".npy",), read_npy),
    Format("NumPy, several arrays", (".npz",), read_npz),
    Format("EDAX .ang", (".ang",), read_ang),
    Format("Oxford .ctf", (".ctf",), read_ctf),
    Format("HDF5: h5oina, DREAM.3D and others", (".h5oina", ".dream3d", ".h5", ".hdf5", ".h5ebsd"), read_hdf5, "hdf5"),
    Format("OME-Zarr", (".zarr",), read_zarr, "zarr"),
    Format("NRRD", (".nrrd", ".nhdr"), read_nrrd, "nrrd"),
    Format("NIfTI", (".nii", ".nii.gz"), read_nifti, "nifti"),
    Format("DICOM", (".dcm", ".dicom", ".ima"), read_dicom, "dicom"),
    Format("Leica LIF", (".lif",), read_lif, "lif"),
    Format("MRC", (".mrc", ".mrcs", ".map", ".rec", ".st"), read_mrc, "mrc"),
)  # fmt: skip

#: formats that VTK reads: `imgquad_mesh.read` and the command do
OF_VTK = (".vti", ".vtk", ".vtkhdf", ".mha", ".mhd")

#: formats that are not read, and the line that turns them into one that is
CONVERTED_BY: Mapping[str, str] = {
    ".cpr": "export the map as .ctf (Channel 5: Save as; AZtec: Export)",
    ".crc": "export the map as .ctf (Channel 5: Save as; AZtec: Export)",
    ".osc": "export the map as .ang from OIM Analysis (File, Export, Scan data)",
    ".czi": "pip install czifile imagecodecs, then numpy.save('x.npy', czifile.imread(FILE).squeeze())",
    ".dm3": "pip install rosettasciio, then numpy.save('x.npy', rsciio.digitalmicrograph.file_reader(FILE)[0]['data'])",
    ".dm4": "pip install rosettasciio, then numpy.save('x.npy', rsciio.digitalmicrograph.file_reader(FILE)[0]['data'])",
    ".emd": "pip install rosettasciio, then numpy.save('x.npy', rsciio.emd.file_reader(FILE)[0]['data'])",
    ".bcf": "pip install rosettasciio, then numpy.save('x.npy', rsciio.bruker.file_reader(FILE)[0]['data'])",
    ".csv": "numpy.save('x.npy', numpy.loadtxt(FILE, delimiter=','))",
    ".txt": "numpy.save('x.npy', numpy.loadtxt(FILE))",
    ".asc": "numpy.save('x.npy', numpy.loadtxt(FILE, skiprows=6)), or gdal_translate FILE x.tif",
    ".mat": "numpy.save('x.npy', scipy.io.loadmat(FILE)['NAME'])",
    ".jp2": "gdal_translate FILE x.tif, or pip install imagecodecs, then numpy.save('x.npy', imagecodecs.imread(FILE))",
    **dict.fromkeys(
        (".jxl", ".avif", ".jxr", ".wdp", ".qoi", ".exr"),
        "pip install imagecodecs, then numpy.save('x.npy', imagecodecs.imread(FILE))",
    ),
    ".nd2": "pip install nd2, then numpy.save('x.npy', nd2.imread(FILE))",
    ".oib": "pip install oiffile, then numpy.save('x.npy', oiffile.imread(FILE))",
    ".oif": "pip install oiffile, then numpy.save('x.npy', oiffile.imread(FILE))",
    ".raw": "numpy.save('x.npy', numpy.fromfile(FILE, 'uint16').reshape(SLICES, ROWS, COLUMNS))",
    ".vol": "numpy.save('x.npy', numpy.fromfile(FILE, 'uint16').reshape(SLICES, ROWS, COLUMNS))",
    ".am": "save it as NRRD or .mha from Amira or Avizo (File, Export data as)",
    ".mrxs": "pip install openslide-python openslide-bin, then OpenSlide(FILE).read_region(...).save('x.png')",
    ".pdf": "pdftoppm -r 300 -png FILE x",
    ".svg": "inkscape FILE --export-type=png",
    ".xyz": "gdal_translate FILE x.tif",
    ".vrt": "gdal_translate FILE x.tif",
    ".heic": "save it as PNG or TIFF",
}


def read_picture(path: str | Path, options: ReadOptions | None = None, name: str | None = None) -> Picture:
    """Read a picture from a file.

    Parameters
    ----------
    path : str or Path
        A file of one of `FORMATS`. PNG, JPEG, TIFF, BMP, PPM, GIF and WebP are told by their content, all others by
        their names. VTK's (.vti, .mha) are for `imgquad_mesh.read`.
    options : ReadOptions, optional
        Pixel limit; which frame, channel, level or array; what becomes of an info bar.
    name : str, optional
        What to call the picture in messages, of a file whose path says nothing to the user; the path by default.

    Returns
    -------
    Picture
        Values as they are stored, row 0 on top: grey values and labels (8, 16, 32 bit or float; a small range that
        the format stretches is put back: 2 and 4 bit PNG, PGM with a maximum other than 255; MinIsWhite is not
        inverted), palette indices with their palette, or RGB. CMYK, YCbCr and the like are turned into RGB. Pixels
        that the file says hold nothing (GDAL's no data, mask pages, points that were not indexed) are void.

    Raises
    ------
    InputError
        If the file is missing, no picture, cut off, too large, a stack of which none is chosen, or of a format whose
        package is not installed.

    Notes
    -----
    The orientation tag of a camera (EXIF, TIFF) is followed: the mesh lies as every viewer shows the picture. Of
    volumes and arrays the first stored row is on top, as NumPy prints them.
    """
    path, options = Path(path), options or ReadOptions()
    with called(path, name):
        found = cut_info_bar(format_of(path).read(path, options), options.info_bar)
    return replace(found, name=name) if name else found


@contextmanager
def called(path: Path, name: str | None) -> Iterator[None]:
    """Call the picture by its `name` in what is raised about the file at `path`."""
    try:
        yield
    except InputError as error:
        raise (InputError(str(error).replace(str(path), name)) if name else error) from error.__cause__


def count_pictures(path: str | Path, options: ReadOptions | None = None) -> int:
    """Return how many pictures a file holds that `ReadOptions.frame` can choose from.

    Parameters
    ----------
    path, options
        As for `read_picture`; `frame` does not count.

    Raises
    ------
    InputError
        As for `read_picture`, but for what is wrong with the pixels.
    """
    try:
        read_picture(path, replace(options or ReadOptions(), frame=_BEYOND))
    except NoSuchPicture as error:
        return error.n
    return 1


_BEYOND = 1 << 40  #: more pictures than a file holds


def format_of(path: Path) -> Format:
    """Return how a file is read.

    Raises
    ------
    InputError
        It cannot be opened, is empty, or is of a format that is not read; the text says what turns it into one.
    """
    if is_zarr(path):
        return _named(".zarr")
    suffixes = [suffix.lower() for suffix in path.suffixes[-2:]]
    if suffixes and suffixes[-1] in OF_VTK:
        raise InputError(f"{path} is for VTK: mesh it by the command, or imgquad_mesh.read(path).imgquad.mesh(...)")
    start = _first_bytes(path)
    by_name = _by_name("".join(suffixes)) or (_by_name(suffixes[-1]) if suffixes else None)
    if by_name is not None and by_name.read not in (read_by_pillow, read_tiff):
        return by_name
    if start[PREAMBLE:].startswith(DICM):  # before TIFF: its preamble may hold a TIFF header
        return _named(".dcm")
    if start.startswith(MAGIC):
        return _named(".tif")
    if start.startswith(b"\x89HDF\r\n\x1a\n"):
        return _named(".h5")
    if suffixes and suffixes[-1] in CONVERTED_BY and not start.startswith(_PICTURES):
        raise InputError(f"{path} is not read directly: {CONVERTED_BY[suffixes[-1]].replace('FILE', repr(str(path)))}")
    if not start.startswith(_PICTURES):
        raise InputError(f"{path} is not a picture that can be read: give {_known()}")
    return _named(".png")


#: how files start that Pillow reads
_PICTURES = (b"\x89PNG", b"\xff\xd8\xff", b"BM", b"GIF8", b"RIFF", *(b"P%d" % k for k in range(1, 7)), b"Pf", b"PF")


def _first_bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            start = file.read(PREAMBLE + len(DICM))
    except OSError as error:
        raise InputError(f"cannot open the picture {path} ({error.strerror}): give a file that can be read") from error
    if not start:
        raise InputError(f"{path} is empty: give a picture ({_known()})")
    return start


#: a few more, for messages
_OTHERS = ("npy", "npz", "ang", "ctf", "h5oina", "dream3d", "zarr", "nrrd", "nii", "mrc", "lif", "dcm", "vti", "mha")


def _by_name(extension: str) -> Format | None:
    return next((form for form in FORMATS if extension in form.extensions), None)


def _named(extension: str) -> Format:
    found = _by_name(extension)
    assert found is not None
    return found


def _known() -> str:
    return "PNG, JPEG, BMP, PPM/PGM/PBM, GIF, WebP, TIFF, " + ", ".join(f".{e}" for e in _OTHERS)
