"""DICOM segmentations, with pydicom alone: a frame for each slice of a segment, or label maps."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, affine

_EVEN = 0.02
"""How far a frame may lie from its even place, in distances of slices."""


def read_frames(file: Any) -> tuple[Iterator[tuple[int, NDArray[np.bool_]]], Floats, str]:
    """Return number and mask [z, y, x] of each segment, ascending, the matrix of the grid, and who read it."""
    import pydicom  # noqa: PLC0415 - only for this format

    kind = str(file.get("SegmentationType", ""))
    if kind not in {"BINARY", "FRACTIONAL", "LABELMAP"}:
        raise CannotWitnessError("its source is no segmentation")
    pixels = file.pixel_array.reshape(-1, int(file.Rows), int(file.Columns))
    places, matrix = _slices(file)
    numbers = sorted(int(item.SegmentNumber) for item in file.SegmentSequence if int(item.SegmentNumber) > 0)
    least = int(file.get("MaximumFractionalValue", 255)) / 2 if kind == "FRACTIONAL" else 1

    def masks() -> Iterator[tuple[int, NDArray[np.bool_]]]:
        for number in numbers:
            mask = np.zeros((int(places.max()) + 1, *pixels.shape[1:]), np.bool_)
            for plane, group, place in zip(pixels, file.PerFrameFunctionalGroupsSequence, places, strict=True):
                if kind == "LABELMAP":
                    mask[place] |= plane == number
                elif group.SegmentIdentificationSequence[0].ReferencedSegmentNumber == number:
                    mask[place] |= plane >= least
            yield number, mask

    return masks(), matrix, f"pydicom {pydicom.__version__}"


def _slices(file: Any) -> tuple[NDArray[np.intp], Floats]:
    """Return the slice of each frame, and the matrix of the grid, from the functional groups."""
    groups = file.PerFrameFunctionalGroupsSequence
    shared = file.SharedFunctionalGroupsSequence[0]
    orientation = _of(groups[0], shared, "PlaneOrientationSequence").ImageOrientationPatient
    along_row, along_column = np.array(orientation, dtype=np.float64).reshape(2, 3)
    normal = np.cross(along_row, along_column)
    measures = _of(groups[0], shared, "PixelMeasuresSequence")
    between_rows_mm, between_columns_mm = (float(value) for value in measures.PixelSpacing)
    positions = np.array(
        [_of(group, shared, "PlanePositionSequence").ImagePositionPatient for group in groups], dtype=np.float64
    )
    along_mm = positions @ normal - (positions @ normal).min()
    gaps = np.diff(np.unique(np.round(along_mm, 4)))
    stated = float(measures.get("SpacingBetweenSlices") or measures.get("SliceThickness") or 0.0)
    pitch_mm = next(
        (distance for distance in (stated, *gaps[:1].tolist()) if distance and _is_even(along_mm, distance)), 0.0
    )
    if not pitch_mm:
        raise CannotWitnessError("its frames are not evenly spaced")
    axes = np.column_stack([along_row * between_columns_mm, along_column * between_rows_mm, normal * pitch_mm])
    return np.rint(along_mm / pitch_mm).astype(np.intp), affine(axes, positions[int(along_mm.argmin())])


def _of(group: Any, shared: Any, keyword: str) -> Any:
    """Return the item of a functional group, which is a frame's own or shared."""
    return (group if keyword in group else shared)[keyword].value[0]


def _is_even(along_mm: Floats, pitch_mm: float) -> bool:
    steps = along_mm / pitch_mm
    return bool(np.abs(steps - np.rint(steps)).max() <= _EVEN)
