"""Frames of a radiotherapy dose, which lie at offsets along the normal. Source: DICOM PS3.3, C.8.8.3."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from pydicom.dataset import Dataset

from volprep_formats.diagnostics import VolprepError
from volprep_formats.readers.dicom.data_set import elements_of
from volprep_formats.readers.dicom.fields import Fields
from volprep_formats.readers.dicom.header import EncodedPixels, SliceImage


def dose_slices(image: SliceImage, data: Dataset, pixels: Sequence[EncodedPixels]) -> tuple[SliceImage, ...]:
    """Return the frames of the dose `image` as slices. Raises VP1036 and VP1037 if their offsets cannot be used."""
    fields = Fields(image.path, elements_of(data))
    offsets_mm = fields.numbers("GridFrameOffsetVector", len(pixels))
    if offsets_mm is None or image.orientation is None or image.position_mm_xyz is None:
        raise fields.problem or VolprepError("VP1036", path=image.path, keyword="GridFrameOffsetVector")
    normal = np.cross(image.orientation[:3], image.orientation[3:])
    # Offsets are distances from the first frame, or, where the first is not 0, places along the normal.
    places = [np.array(image.position_mm_xyz) + (offset - offsets_mm[0]) * normal for offset in offsets_mm]
    return tuple(
        replace(image, number=k + 1, position_mm_xyz=tuple(place.tolist()), pixels=part)
        for k, (place, part) in enumerate(zip(places, pixels, strict=True))
    )
