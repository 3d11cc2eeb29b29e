"""DICOM structure sets: closed planar contours of each structure, in patient space.

Source: DICOM PS3.3, A.19 (RT Structure Set), C.8.8.5 (structures and their frame of reference), C.8.8.6 (contours).
"""

from pathlib import Path

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.segmentations.dicom_file import Item, code_of, parsed
from volprep_formats.segmentations.records import MOST_SEGMENTS, Contours, SourceSegment

SOP_CLASS = "1.2.840.10008.5.1.4.1.1.481.3"
"""RT Structure Set Storage."""
_CLOSED = frozenset(("CLOSED_PLANAR", "CLOSEDPLANAR_XOR"))
_MOST_POINTS = 2**27
_LARGEST_MM = 1e6


def read_rtstruct(path: Path) -> Contours:
    """Read the contours of a structure set. Raises VP1400, VP1401 and VP1406."""
    with parsed(path) as data:
        structures = {int(item.ROINumber): item for item in data.get("StructureSetROISequence") or ()}
        if not 0 < len(structures) <= MOST_SEGMENTS:
            raise VolprepError("VP1401", path=path, count=len(structures), most=MOST_SEGMENTS)
        if data.get("ROIContourSequence") is None:
            raise VolprepError("VP1400", path=path, problem="it has no contours (ROIContourSequence)")
        drawn = {int(item.ReferencedROINumber): item for item in data.get("ROIContourSequence") or ()}
        codes = {
            int(item.get("ReferencedROINumber", -1)): code_of(item, "RTROIIdentificationCodeSequence")
            for item in data.get("RTROIObservationsSequence") or ()
        }
        frames = {str(item.get("ReferencedFrameOfReferenceUID", "") or "") for item in structures.values()} - {""}
        if len(frames) > 1:
            raise VolprepError("VP1406", path=path, count=len(frames))
        rings: list[tuple[Float64Array, ...]] = []
        left_out = 0
        for number in sorted(structures):
            found, others = _rings(path, drawn.get(number))
            rings.append(found)
            left_out += others
        if not any(rings):
            raise VolprepError("VP1400", path=path, problem="none of its structures has a closed contour")
        segments = tuple(
            SourceSegment(
                number=number,
                name=str(structures[number].get("ROIName", "") or ""),
                code=codes.get(number),
                colour=_colour(drawn.get(number)),
            )
            for number in sorted(structures)
        )
        remark = f"{left_out} contours are points or open lines, which enclose nothing; they are left out"
        return Contours(segments, tuple(rings), "".join(frames), _images(data), (remark,) if left_out else ())


def _images(data: Item) -> frozenset[str]:
    """Return the images of the series that a structure set refers to, and the images that its contours name."""
    found = [
        *(contour for item in data.get("ROIContourSequence") or () for contour in item.get("ContourSequence") or ()),
        *(
            series
            for frame in data.get("ReferencedFrameOfReferenceSequence") or ()
            for study in frame.get("RTReferencedStudySequence") or ()
            for series in study.get("RTReferencedSeriesSequence") or ()
        ),
    ]
    images = (image for each in found for image in each.get("ContourImageSequence") or ())
    return frozenset(str(image.get("ReferencedSOPInstanceUID", "")) for image in images) - {""}


def _rings(path: Path, item: Item | None) -> tuple[tuple[Float64Array, ...], int]:
    """Return the closed contours of a structure, and the number of others."""
    found = []
    others = 0
    for contour in (item.get("ContourSequence") or ()) if item is not None else ():
        if str(contour.get("ContourGeometricType", "")) not in _CLOSED:
            others += 1
            continue
        numbers = contour.get("ContourData")
        stated = int(contour.get("NumberOfContourPoints", -1))
        if numbers is None or len(numbers) != 3 * stated or stated > _MOST_POINTS:
            count = 0 if numbers is None else len(numbers)
            raise VolprepError("VP1400", path=path, problem=f"a contour has {count} coordinates of {stated} points")
        points = np.array([float(number) for number in numbers]).reshape(-1, 3)
        if not (np.abs(points) <= _LARGEST_MM).all():
            raise VolprepError("VP1400", path=path, problem="a contour has a point that is not finite or too far away")
        if len(points) > 2:
            found.append(points)
        else:
            others += 1
    return tuple(found), others


def _colour(item: Item | None) -> tuple[float, float, float] | None:
    numbers = [] if item is None else [int(number) for number in item.get("ROIDisplayColor") or ()]
    if len(numbers) != 3 or not all(0 <= number <= 255 for number in numbers):
        return None
    red, green, blue = (number / 255 for number in numbers)
    return red, green, blue
