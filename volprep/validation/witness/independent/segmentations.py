"""Segmentations, read by pydicom, pynrrd, or the library for a volume: which segments each voxel belongs to."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.package import Json, world_from_index
from volprep.validation.witness.independent.read_contours import covered_voxels
from volprep.validation.witness.independent.read_dicom_seg import read_frames
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan, affine
from volprep.validation.witness.independent.sources import read_scan

Mask = NDArray[np.bool_]
_VOLUMES = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd")
_DEFAULT_LAYER = "0"
_HALF = 0.5
_UNCERTAIN = 0.1
"""How near to a half the share of a voxel may be that is not compared: shares are counted at points."""
_OFF_CONTOURS = 0.02


@dataclass(frozen=True)
class WitnessedSegments:
    """The segments of a source on its own grid."""

    labels: WitnessedScan
    """Number of the segment of each voxel, 0 outside; NaN where it is uncertain, or in several."""
    voxels: Mapping[int, float]
    """Number of voxels of each segment."""
    off_share: float = 1e-4
    """How far volumes may be off, as a part: affine matrices of NIfTI have 24 bits."""

    def volume_ml(self, number: int) -> float:
        """Return the volume of a segment: its voxels, each as large as its three edges span."""
        voxel_mm3 = abs(float(np.linalg.det(self.labels.world_from_index[:3, :3])))
        return self.voxels.get(number, 0) * voxel_mm3 / 1000.0


def read_segments(settings: Mapping[str, Any], base: Path, scan: Json) -> WitnessedSegments:
    """Read the segments that the table [segments] of a scene names; contours lie on the grid of the `scan`.

    Raises CannotWitnessError for borders that are smoothed.
    """
    path = base / str(settings["source"])
    if settings.get("smoothing_mm"):
        raise CannotWitnessError("its borders are smoothed")
    if path.name.endswith(".seg.nrrd"):
        return _together(*_of_slicer(path))
    if path.name.endswith(".dcm"):
        return _of_dicom(path, scan)
    if path.is_dir() and any(file.name.endswith(_VOLUMES) for file in path.iterdir()):
        return _together(*_of_masks(path))
    if path.is_dir() and len(files := [file for file in path.iterdir() if file.is_file()]) == 1:
        return _of_dicom(files[0], scan)
    labels = read_scan({"path": str(path)})
    numbers, counts = np.unique(labels.physical(labels.stored), return_counts=True)
    return WitnessedSegments(labels, dict(zip(numbers.astype(int).tolist(), counts.tolist(), strict=True)))


def _of_dicom(path: Path, scan: Json) -> WitnessedSegments:
    import pydicom  # noqa: PLC0415 - only for this format

    file = pydicom.dcmread(path)
    if str(file.get("Modality", "")) != "RTSTRUCT":
        return _together(*read_frames(file))
    matrix, shape = world_from_index(scan), tuple(scan["shape_zyx"])
    labels, voxels = np.zeros(shape, np.float32), {}
    for number, share in covered_voxels(file, matrix, shape):
        _add(labels, share >= _HALF, number)
        labels[np.abs(share - _HALF) < _UNCERTAIN] = np.nan
        voxels[number] = float(share.sum())
    found = WitnessedScan(labels, 1.0, 0.0, matrix, f"pydicom {pydicom.__version__}")
    return WitnessedSegments(found, voxels, off_share=_OFF_CONTOURS)


def _add(labels: NDArray[np.float32], mask: Mask, number: int) -> None:
    labels[mask] = np.where(labels[mask] == 0.0, number, np.nan)


def _together(masks: Iterator[tuple[int, Mask]], world_from_index: Floats, library: str) -> WitnessedSegments:
    """Put masks of segments, in ascending order of their numbers, into one volume."""
    labels: NDArray[np.float32] | None = None
    voxels: dict[int, float] = {}
    for number, mask in masks:
        labels = np.zeros(mask.shape, np.float32) if labels is None else labels
        _add(labels, mask, number)
        voxels[number] = int(mask.sum())
    if labels is None:
        raise CannotWitnessError("its source has no segment")
    return WitnessedSegments(WitnessedScan(labels, 1.0, 0.0, world_from_index, library), voxels)


def _of_slicer(path: Path) -> tuple[Iterator[tuple[int, Mask]], Floats, str]:
    """Return the segments of a file of 3D Slicer: segment N of the header has the number N + 1."""
    import nrrd  # noqa: PLC0415 - only for this format

    stored, header = nrrd.read(str(path), index_order="C")
    if header.get("space") not in {None, "left-posterior-superior", "LPS"}:
        raise CannotWitnessError(f"its space is {header['space']}")
    layers = stored[..., None] if stored.ndim == 3 else stored
    directions = np.array([row for row in header["space directions"] if np.isfinite(row).all()], dtype=np.float64)
    matrix = affine(directions.T, np.array(header["space origin"], dtype=np.float64))
    names = {key.partition("_")[0] for key in header if key.startswith("Segment") and key[7:8].isdigit()}
    numbers = sorted(int(name[7:]) for name in names)

    def masks() -> Iterator[tuple[int, Mask]]:
        for number in numbers:
            label = int(header.get(f"Segment{number}_LabelValue", number + 1))
            yield number + 1, layers[..., int(header.get(f"Segment{number}_Layer", _DEFAULT_LAYER))] == label

    return masks(), matrix, f"pynrrd {nrrd.__version__}"


def _of_masks(folder: Path) -> tuple[Iterator[tuple[int, Mask]], Floats, str]:
    """Return the masks of a folder, numbered in the order of their names."""
    files = sorted(file for file in folder.iterdir() if file.name.endswith(_VOLUMES) and file.name[0] != ".")
    first = read_scan({"path": str(files[0])})

    def masks() -> Iterator[tuple[int, Mask]]:
        for number, file in enumerate(files, 1):
            mask = read_scan({"path": str(file)})
            values = mask.physical(mask.stored)
            if not np.allclose(mask.world_from_index, first.world_from_index, atol=1e-4):
                raise CannotWitnessError("its masks lie on several grids")
            yield number, values >= 0.5

    return masks(), first.world_from_index, first.library
