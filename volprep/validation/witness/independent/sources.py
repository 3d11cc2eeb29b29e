"""Read a source with the library for its format: pydicom, nibabel, pynrrd, tifffile, Pillow, SimpleITK, or NumPy."""

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

from volprep.validation.witness.independent import read_dicom, read_stack
from volprep.validation.witness.independent.colours import channel_of
from volprep.validation.witness.independent.scan import CannotWitnessError, WitnessedScan
from volprep.validation.witness.independent.volume_files import (
    read_itk,
    read_itk_series,
    read_nifti,
    read_npy,
    read_nrrd,
    read_ome_tiff,
    read_raw,
)

Source = Mapping[str, Any]
"""The table [source] of a scene, or one of its channels."""
Reader = Callable[[Path, Source], WitnessedScan]

_READERS: dict[str, tuple[tuple[str, str, Reader], ...]] = {
    "dicom": (("pydicom", "pydicom", read_dicom.read), ("SimpleITK", "SimpleITK", read_itk_series)),
    "nifti": (("nibabel", "nibabel", read_nifti), ("SimpleITK", "SimpleITK", read_itk)),
    "nrrd": (("nrrd", "pynrrd", read_nrrd), ("SimpleITK", "SimpleITK", read_itk)),
    "metaimage": (("SimpleITK", "SimpleITK", read_itk),),
    "ome-tiff": (("tifffile", "tifffile", read_ome_tiff),),
    "stack": (("tifffile", "tifffile", read_stack.read_tiff), ("PIL", "pillow", read_stack.read_pictures)),
    "raw": (("numpy", "numpy", read_raw),),
    "npy": (("numpy", "numpy", read_npy),),
}
"""Module, distribution and reader for each format, the preferred one first."""
_SUFFIXES = {
    ".nii": "nifti",
    ".nii.gz": "nifti",
    ".nrrd": "nrrd",
    ".nhdr": "nrrd",
    ".mha": "metaimage",
    ".mhd": "metaimage",
    ".ome.tif": "ome-tiff",
    ".ome.tiff": "ome-tiff",
    ".tif": "stack",
    ".tiff": "stack",
    ".npy": "npy",
    ".npz": "npy",
    ".dcm": "dicom",
}
_CHANGES_VALUES = ("mask", "nan", "rgb", "repair", "missing", "level", "suv")
"""Keys of a source that change the voxels of the file."""


def read_scan(source: Source) -> WitnessedScan:
    """Read the voxels that a source names.

    Raises CannotWitnessError if no installed library can read them, or if the source asks for a change.
    """
    changed = [key for key in _CHANGES_VALUES if source.get(key)]
    if changed:
        raise CannotWitnessError(f"the source has the key {changed[0]}, which changes voxels or chooses among them")
    path = Path(str(source["path"]))
    kind = _format_of(path, source)
    if kind not in _READERS:
        raise CannotWitnessError(f"no independent reader for the format {kind}")
    failed = []
    for module, distribution, read in _READERS[kind]:
        if importlib.util.find_spec(module) is None:
            continue
        try:
            return _named(read(path, source), distribution, source.get("colour"))
        except CannotWitnessError:
            raise
        except Exception as error:  # noqa: BLE001 - a foreign library may raise anything about a foreign file
            failed.append(f"{distribution} cannot read it: {(str(error) or type(error).__name__).splitlines()[0]}")
    if failed:
        raise CannotWitnessError("; ".join(failed))
    wanted = " or ".join(distribution for _, distribution, _ in _READERS[kind])
    raise CannotWitnessError(f"{wanted} is not installed, which is in the extra witness")


def _format_of(path: Path, source: Source) -> str:
    wanted = str(source.get("format") or "auto")
    if wanted != "auto":
        return wanted
    if source.get("raw") or source.get("array"):
        return "raw" if source.get("raw") else "npy"
    if source.get("stack"):
        return "stack"
    if path.is_dir():
        return "dicom"
    name = path.name.lower()
    found = next((kind for suffix, kind in _SUFFIXES.items() if name.endswith(suffix)), None)
    if found is None and path.is_file():
        with path.open("rb") as file:
            found = "dicom" if file.read(132)[128:] == b"DICM" else None
    return found or (path.suffix or "unknown")


def _named(scan: WitnessedScan, distribution: str, colour: Mapping[str, Any] | None) -> WitnessedScan:
    stored = scan.stored if colour is None else channel_of(scan.stored, colour)
    if stored.ndim != 3 or stored.dtype.kind not in "biuf":
        raise CannotWitnessError("its voxels are colours, or other numbers of several components")
    slope, intercept = (scan.slope, scan.intercept) if colour is None else (1.0, 0.0)
    library = f"{distribution} {version(distribution)}"
    return WitnessedScan(stored, slope, intercept, scan.world_from_index, library)
