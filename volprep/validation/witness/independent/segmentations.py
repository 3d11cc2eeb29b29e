"""Segmentations, read by pydicom, pynrrd, or the library for a volume: which segments each voxel belongs to."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.read_dicom_seg import read_frames
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan, affine
from volprep.validation.witness.independent.sources import read_scan

Mask = NDArray[np.bool_]
_VOLUMES = (".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd")
_DEFAULT_LAYER = "0"


@dataclass(frozen=True)
class WitnessedSegments:
    """The segments of a source on its own grid."""

    labels: WitnessedScan
    """Number of the segment of each voxel, 0 outside; of several segments the last one."""
    voxels: Mapping[int, int]
    """Number of voxels of each segment."""
    overlap: bool
    """Whether a voxel belongs to several segments."""

    def volume_ml(self, number: int) -> float:
        """Return the volume of a segment: its voxels, each as large as its three edges span."""
        voxel_mm3 = abs(float(np.linalg.det(self.labels.world_from_index[:3, :3])))
        return self.voxels.get(number, 0) * voxel_mm3 / 1000.0


def read_segments(settings: Mapping[str, Any], base: Path) -> WitnessedSegments:
    """Read the segments that the table [segments] of a scene names.

    Raises CannotWitnessError for contours, for fractions, and for borders that are smoothed.
    """
    path = base / str(settings["source"])
    if settings.get("smoothing_mm"):
        raise CannotWitnessError("its borders are smoothed")
    if path.name.endswith(".seg.nrrd"):
        return _together(*_of_slicer(path))
    if path.name.endswith(".dcm"):
        return _together(*read_frames(path))
    if path.is_dir() and any(file.name.endswith(_VOLUMES) for file in path.iterdir()):
        return _together(*_of_masks(path))
    if path.is_dir() and len(files := [file for file in path.iterdir() if file.is_file()]) == 1:
        return _together(*read_frames(files[0]))
    labels = read_scan({"path": str(path)})
    numbers, counts = np.unique(labels.physical(labels.stored), return_counts=True)
    return WitnessedSegments(labels, dict(zip(numbers.astype(int).tolist(), counts.tolist(), strict=True)), False)


def _together(masks: Iterator[tuple[int, Mask]], world_from_index: Floats, library: str) -> WitnessedSegments:
    """Put masks of segments, in ascending order of their numbers, into one volume."""
    labels: NDArray[np.uint16] | None = None
    voxels: dict[int, int] = {}
    overlap = False
    for number, mask in masks:
        labels = np.zeros(mask.shape, np.uint16) if labels is None else labels
        overlap = overlap or bool((labels[mask] > 0).any())
        labels[mask] = number
        voxels[number] = int(mask.sum())
    if labels is None:
        raise CannotWitnessError("its source has no segment")
    return WitnessedSegments(WitnessedScan(labels, 1.0, 0.0, world_from_index, library), voxels, overlap)


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
