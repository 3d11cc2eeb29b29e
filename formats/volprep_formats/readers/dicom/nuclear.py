"""Frames of reconstructed nuclear medicine: the place of the first slice, and a signed step to the next ones.

Position and orientation are those of the detector. A slice lies (its number - 1) · SpacingBetweenSlices along the
normal, so a negative distance stacks the slices against it. Projections have no places. Source: DICOM PS3.3, C.8.4.8
(frames), C.8.4.11 (detector), C.8.4.15 (reconstruction).
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydicom.dataset import Dataset

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.dicom.data_set import elements_of, sequence
from volprep_formats.readers.dicom.fields import VARIANTS, Fields
from volprep_formats.readers.dicom.header import EncodedPixels, SliceImage

_RECONSTRUCTED = frozenset(("RECON TOMO", "RECON GATED TOMO"))
_TIME = VARIANTS.index("TemporalPositionIdentifier")


def nuclear_slices(image: SliceImage, data: Dataset, pixels: Sequence[EncodedPixels]) -> tuple[SliceImage, ...]:
    """Return the frames of the reconstruction `image` as slices; frames of one slice are told apart by their order.

    Raises VP1036 and VP1037 for attributes, and VP1041 for other frames than slices.
    """
    fields = Fields(image.path, elements_of(data))
    kind = [part.strip() for part in fields.text("ImageType").upper().split("\\")]
    if not _RECONSTRUCTED.intersection(kind):
        what = SafeText("its ImageType is not RECON TOMO: projections and planar images are no slices")
        raise VolprepError("VP1041", path=image.path, frames=len(pixels), what=what)
    orientation, position_mm_xyz = _place(image, data, len(pixels))
    step_mm = fields.number("SpacingBetweenSlices")
    numbers = fields.numbers("SliceVector", len(pixels)) or range(1, len(pixels) + 1)
    if fields.problem is not None:
        raise fields.problem
    if not step_mm:
        raise VolprepError("VP1036", path=image.path, keyword="SpacingBetweenSlices")
    normal = np.cross(orientation[:3], orientation[3:])
    seen: Counter[float] = Counter()
    slices = []
    for k, (number, part) in enumerate(zip(numbers, pixels, strict=True)):
        seen[number] += 1
        place = np.array(position_mm_xyz) + (number - 1) * step_mm * normal
        variants = (*image.variants[:_TIME], str(seen[number]), *image.variants[_TIME + 1 :])
        slices.append(
            replace(
                image,
                number=k + 1,
                orientation=orientation,
                position_mm_xyz=tuple(place.tolist()),
                variants=variants,
                pixels=part,
            )
        )
    return tuple(slices)


def _place(image: SliceImage, data: Dataset, frames: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return orientation and position of the first slice: the detector's, or else the image's."""
    found = {
        (orientation, position)
        for detector in sequence(data, "DetectorInformationSequence")
        for fields in [Fields(image.path, elements_of(detector))]
        if (orientation := fields.numbers("ImageOrientationPatient", 6) or image.orientation)
        and (position := fields.numbers("ImagePositionPatient", 3) or image.position_mm_xyz)
    }
    if len(found) > 1:
        what = SafeText(f"{len(found)} places for the first of them, one for each detector")
        raise VolprepError("VP1041", path=image.path, frames=frames, what=what)
    if found:
        return found.pop()
    if image.orientation is None or image.position_mm_xyz is None:
        raise VolprepError("VP1036", path=image.path, keyword="ImagePositionPatient of the detector")
    return image.orientation, image.position_mm_xyz
