"""DICOM structure sets: closed planar contours of each structure, in patient space.

Source: DICOM PS3.3, A.19 (RT Structure Set), C.8.8.5 (structures and their frame of reference), C.8.8.6 (contours).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.segmentations.dicom_file import Item, code_of, images_in, parsed
from volprep_formats.segmentations.records import MOST_SEGMENTS, Contours, SourceSegment

SOP_CLASS = "1.2.840.10008.5.1.4.1.1.481.3"
"""RT Structure Set Storage."""
_CLOSED = frozenset(("CLOSED_PLANAR", "CLOSEDPLANAR_XOR"))
_MOST_POINTS = 2**27
_LARGEST_MM = 1e6


def read_rtstruct(path: Path) -> Contours:
    """Read the contours of a structure set. Raises VP1400, VP1401 and VP1406."""
    with parsed(path) as data:
        structures = _structures(path, data)
        if data.get("ROIContourSequence") is None:
            raise VolprepError("VP1400", path=path, problem="it has no contours (ROIContourSequence)")
        drawn: dict[int, list[Item]] = {}
        for item in data.get("ROIContourSequence") or ():
            drawn.setdefault(int(item.ReferencedROINumber), []).append(item)
        codes = {
            int(item.get("ReferencedROINumber", -1)): code_of(item, "RTROIIdentificationCodeSequence")
            for item in data.get("RTROIObservationsSequence") or ()
        }
        frames = {str(item.get("ReferencedFrameOfReferenceUID", "") or "") for item in structures.values()} - {""}
        if len(frames) > 1:
            raise VolprepError("VP1406", path=path, count=len(frames))
        rings: list[tuple[Float64Array, ...]] = []
        items: list[tuple[int, ...]] = []
        left_out = 0
        for number in sorted(structures):
            found, others = _rings(path, drawn.get(number, []))
            rings.append(tuple(ring for _, ring in found))
            items.append(tuple(item for item, _ in found))
            left_out += others
        if not any(rings):
            raise VolprepError("VP1400", path=path, problem="none of its structures has a closed contour")
        segments = tuple(
            SourceSegment(
                number=number,
                name=str(structures[number].get("ROIName", "") or ""),
                code=codes.get(number),
                colour=next((colour for item in drawn.get(number, []) if (colour := _colour(item))), None),
            )
            for number in sorted(structures)
        )
        remark = f"{left_out} contours are points or open lines, which enclose nothing; they are left out"
        frame = "".join(frames)
        remarks = (remark,) if left_out else ()
        return Contours(segments, tuple(rings), tuple(items), frame, _images(data, frame), remarks)


def _structures(path: Path, data: Item) -> dict[int, Item]:
    """Return the structures by their numbers. Raises VP1400 and VP1401."""
    items = data.get("StructureSetROISequence") or ()
    if not 0 < len(items) <= MOST_SEGMENTS:
        raise VolprepError("VP1401", path=path, count=len(items), most=MOST_SEGMENTS)
    structures: dict[int, Item] = {}
    for item in items:
        number = int(item.ROINumber)
        if number < 0 or number in structures:
            problem = f"two structures have the number {number}" if number >= 0 else f"a structure has number {number}"
            raise VolprepError("VP1400", path=path, problem=problem)
        structures[number] = item
    return structures


def _images(data: Item, frame: str) -> frozenset[str]:
    """Return the images that the contours name; if they name none, those that the file lists in their frame."""
    drawn = (contour for item in data.get("ROIContourSequence") or () for contour in item.get("ContourSequence") or ())
    named = frozenset[str]().union(*(images_in(contour, "ContourImageSequence") for contour in drawn))
    listed = (
        images_in(series, "ContourImageSequence")
        for item in data.get("ReferencedFrameOfReferenceSequence") or ()
        if str(item.get("FrameOfReferenceUID", "") or "") == frame
        for study in item.get("RTReferencedStudySequence") or ()
        for series in study.get("RTReferencedSeriesSequence") or ()
    )
    return named or frozenset[str]().union(*listed)


def _rings(path: Path, items: Sequence[Item]) -> tuple[list[tuple[int, Float64Array]], int]:
    """Return the closed contours of a structure, each with the number of its item, and the number of others."""
    found = []
    others = 0
    contours = ((number, value) for number, item in enumerate(items) for value in item.get("ContourSequence") or ())
    for number, contour in contours:
        if str(contour.get("ContourGeometricType", "")) not in _CLOSED:
            others += 1
            continue
        points = _points(path, contour)
        if len(points) > 2:
            found.append((number, points))
        else:
            others += 1
    return found, others


def _points(path: Path, contour: Item) -> Float64Array:
    """Return the points of a contour [points, (x, y, z)], moved by its offset. Raises VP1400."""
    # The raw text: pydicom leaves values above 64 KiB unparsed, and takes six times the memory for others.
    element = contour.get_item("ContourData") if "ContourData" in contour else None
    raw = getattr(element, "value", None)
    numbers = np.array(raw.split(b"\\") if isinstance(raw, bytes) and raw else [], np.bytes_).astype(np.float64)
    stated = int(contour.get("NumberOfContourPoints", -1))
    if len(numbers) != 3 * stated or stated > _MOST_POINTS:
        problem = f"a contour has {len(numbers)} coordinates of {stated} points"
        raise VolprepError("VP1400", path=path, problem=problem)
    offset_mm = [float(number) for number in contour.get("ContourOffsetVector") or (0.0, 0.0, 0.0)]
    if len(offset_mm) != 3:
        raise VolprepError("VP1400", path=path, problem=f"a ContourOffsetVector has {len(offset_mm)} numbers")
    points = numbers.reshape(-1, 3) + offset_mm
    if not (np.abs(points) <= _LARGEST_MM).all():
        raise VolprepError("VP1400", path=path, problem="a contour has a point that is not finite or too far away")
    return points


def _colour(item: Item) -> tuple[float, float, float] | None:
    numbers = [int(number) for number in item.get("ROIDisplayColor") or ()]
    if len(numbers) != 3 or not all(0 <= number <= 255 for number in numbers):
        return None
    red, green, blue = (number / 255 for number in numbers)
    return red, green, blue
