"""Volumes in files, each read with the library for its format, SimpleITK (whose space is LPS), or NumPy alone."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan, affine

_LPS_FROM_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])
_MM = {"mm": 1.0, "meter": 1e3, "micron": 1e-3, "unknown": 1.0}
_MM_OF_OME = {"mm": 1.0, "µm": 1e-3, "nm": 1e-6, "cm": 10.0, "m": 1e3}


def read_raw(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a file without a header, whose layout is in the scene."""
    layout = source.get("raw")
    if not layout:
        raise CannotWitnessError("the scene has no table [source.raw] for a file without a header")
    order = ">" if layout.get("byte_order", "little") == "big" else "<"
    dtype = np.dtype(layout["dtype"]).newbyteorder(order)
    offset, shape = int(layout.get("header_bytes", 0)), tuple(layout["shape_zyx"])
    stored = np.fromfile(path, dtype, count=int(np.prod(shape)), offset=offset).reshape(shape)
    return _at_origin(stored, layout.get("spacing_mm_zyx", (1.0, 1.0, 1.0)))


def read_npy(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read an array [z, y, x]."""
    layout = source.get("array") or {}
    loaded = np.load(path, allow_pickle=False)
    stored = loaded[layout.get("name") or loaded.files[0]] if path.suffix == ".npz" else loaded
    return _at_origin(stored, layout.get("spacing_mm_zyx", (1.0, 1.0, 1.0)))


def _at_origin(stored: NDArray[Any], spacing_mm_zyx: tuple[float, float, float]) -> WitnessedScan:
    return WitnessedScan(stored, 1.0, 0.0, affine(np.diag(spacing_mm_zyx[::-1]), np.zeros(3)), "")


def read_nifti(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a volume; NIfTI has its axes to the right, to the front and up."""
    import nibabel  # noqa: PLC0415 - only for this format

    image: Any = nibabel.load(path)
    header = image.header
    volume = int(source.get("volume") or 0)
    stored = np.asanyarray(image.dataobj.get_unscaled())
    stored = stored.reshape(stored.shape[:3] + tuple(n for n in stored.shape[3:] if n > 1))
    if stored.ndim > 4 or (stored.ndim == 4 and not volume):
        raise CannotWitnessError("the file has several volumes")
    stored = stored[..., volume - 1] if stored.ndim == 4 else stored
    matrix = _LPS_FROM_RAS @ image.affine
    matrix[:3] *= _MM[header.get_xyzt_units()[0]]
    return WitnessedScan(stored.T, float(image.dataobj.slope), float(image.dataobj.inter), matrix, "")


def read_nrrd(path: Path, source: Mapping[str, Any]) -> WitnessedScan:  # noqa: ARG001 - as every reader
    """Read a volume of three spatial axes."""
    import nrrd  # noqa: PLC0415 - only for this format

    stored, header = nrrd.read(str(path), index_order="C")
    if stored.ndim != 3:
        raise CannotWitnessError(f"the file has {stored.ndim} axes")
    space = str(header.get("space", "")).lower()
    signs = {"right-anterior-superior": (-1.0, -1.0, 1.0), "ras": (-1.0, -1.0, 1.0)}
    if space in {"left-anterior-superior", "las"}:
        signs[space] = (1.0, -1.0, 1.0)
    sign = np.array(signs.get(space, (1.0, 1.0, 1.0)))
    if "space directions" in header:
        axes = np.array(header["space directions"], dtype=np.float64).T
    else:
        axes = np.diag(np.array(header.get("spacings", (1.0, 1.0, 1.0)), dtype=np.float64))
    origin = np.array(header.get("space origin", (0.0, 0.0, 0.0)), dtype=np.float64)
    return WitnessedScan(stored, 1.0, 0.0, affine(sign[:, None] * axes, sign * origin), "")


def read_ome_tiff(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read the first image; the spacing is that of its OME header, the first voxel is at the origin."""
    import tifffile  # noqa: PLC0415 - only for this format

    with tifffile.TiffFile(path) as file:
        series, header = file.series[0], file.ome_metadata
        axes, stored = series.axes, series.asarray()
    kept = tuple(index for index, axis in enumerate(axes) if axis in "ZYX" or stored.shape[index] > 1)
    stored = stored.reshape([stored.shape[index] for index in kept])
    names = "".join(axes[index] for index in kept)
    if sorted(names) == sorted("CZYX") and isinstance(source.get("channel"), int):
        stored, names = stored.take(source["channel"] - 1, names.index("C")), names.replace("C", "")
    if names != "ZYX" or header is None:
        raise CannotWitnessError(f"the file has the axes {axes}")
    pixels = next(element for element in ElementTree.fromstring(header).iter() if element.tag.endswith("Pixels"))  # noqa: S314
    spacing = [
        float(pixels.get(f"PhysicalSize{axis}", "1")) * _MM_OF_OME.get(pixels.get(f"PhysicalSize{axis}Unit", "µm"), 1.0)
        for axis in "XYZ"
    ]
    return WitnessedScan(stored, 1.0, 0.0, affine(np.diag(spacing), np.zeros(3)), "")


def read_itk(path: Path, source: Mapping[str, Any]) -> WitnessedScan:  # noqa: ARG001 - as every reader
    """Read a volume of one component."""
    import SimpleITK  # noqa: PLC0415 - only for this format

    return _scan_of_itk(SimpleITK.ReadImage(str(path)))


def read_itk_series(path: Path, source: Mapping[str, Any]) -> WitnessedScan:
    """Read a DICOM series of single frames, compressed or not."""
    import SimpleITK  # noqa: PLC0415 - as above

    reader: Any = SimpleITK.ImageSeriesReader
    wanted = str(source.get("series") or "")
    found = [uid for uid in reader.GetGDCMSeriesIDs(str(path)) if uid.endswith(wanted)] if path.is_dir() else []
    if len(found) != 1:
        raise CannotWitnessError(f"{len(found)} series with single frames were found")
    return _scan_of_itk(SimpleITK.ReadImage(reader.GetGDCMSeriesFileNames(str(path), found[0])))


def _scan_of_itk(image: Any) -> WitnessedScan:
    import SimpleITK  # noqa: PLC0415 - as above

    if image.GetDimension() != 3 or image.GetNumberOfComponentsPerPixel() != 1:
        raise CannotWitnessError(f"the file has {image.GetDimension()} axes")
    axes = np.array(image.GetDirection()).reshape(3, 3) * np.array(image.GetSpacing())
    return WitnessedScan(SimpleITK.GetArrayFromImage(image), 1.0, 0.0, affine(axes, np.array(image.GetOrigin())), "")
