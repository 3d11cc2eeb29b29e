"""Enhanced multi-frame images: one file with many slices, each with functional groups that hold its position.

The shared groups hold the attributes common to all frames, the per-frame groups the others. Ultrasound places its
frames in a volume instead of the patient. A multi-frame image without these groups has frame positions if it is a dose
or a reconstruction of nuclear medicine, and is refused otherwise. Source: DICOM PS3.3, C.7.6.16 (C.7.6.16.2.21 and
2.22 for ultrasound); for the frames of encapsulated pixel data PS3.5, A.4.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import starmap

from pydicom.dataset import Dataset
from pydicom.uid import UID, ExplicitVRBigEndian

from volprep_formats.diagnostics import SafeText, VolprepError
from volprep_formats.readers.dicom.data_set import elements_of, sequence
from volprep_formats.readers.dicom.dose import dose_slices
from volprep_formats.readers.dicom.element import PixelElement
from volprep_formats.readers.dicom.fields import CLOCKS, TAGS, VARIANTS, Elements, Fields, raw_text, variant_text
from volprep_formats.readers.dicom.header import EncodedPixels, SliceImage, pixel_spacing, unit_of
from volprep_formats.readers.dicom.nuclear import nuclear_slices
from volprep_formats.readers.dicom.pixels import picture_bytes

_MOST_FRAMES = 2**20
_IN_GROUP = {
    "EchoTime": ("MREchoSequence", "EffectiveEchoTime"),
    "InversionTime": ("MRModifierSequence", "InversionTimes"),
    "TriggerTime": ("CardiacSynchronizationSequence", "NominalCardiacTriggerDelayTime"),
    "TemporalPositionIdentifier": ("FrameContentSequence", "TemporalPositionIndex"),
    "DiffusionBValue": ("MRDiffusionSequence", "DiffusionBValue"),
    "AcquisitionNumber": ("FrameContentSequence", "FrameAcquisitionNumber"),
    "ImageType": ("MRImageFrameTypeSequence", "FrameType"),
    "StackID": ("FrameContentSequence", "StackID"),
    "ComplexImageComponent": ("MRImageFrameTypeSequence", "ComplexImageComponent"),
    "TemporalPositionTimeOffset": ("FrameContentSequence", "TemporalPositionTimeOffset"),
    "AcquisitionTime": ("FrameContentSequence", "FrameAcquisitionDateTime"),
}
"""Functional-group elements of a frame that correspond to `VARIANTS` and `CLOCKS` of a single image."""
_PLACED_BY: Mapping[str, Callable[[SliceImage, Dataset, Sequence[EncodedPixels]], tuple[SliceImage, ...]]] = {
    "RTDOSE": dose_slices,
    "NM": nuclear_slices,
}
"""Modalities whose multi-frame images place their frames without functional groups."""


def frame_count(data: Dataset) -> int | None:
    """Number of frames declared by a multi-frame image, 0 if invalid; None for a single image."""
    text = raw_text(elements_of(data), "NumberOfFrames")
    grouped = TAGS["PerFrameFunctionalGroupsSequence"] in data
    if not text:
        return 1 if grouped else None
    try:
        frames = int(text)
    except ValueError:
        return 0
    if frames == 1 and not grouped:
        return None
    return frames if 1 <= frames <= _MOST_FRAMES else 0


def frame_slices(image: SliceImage, data: Dataset, element: PixelElement, frames: int) -> tuple[SliceImage, ...]:
    """Slices of the multi-frame image that `image` is as a whole; the image itself, with its problem, if it has one."""
    # Each frame keeps the problem that it is in colour, which the scene may solve.
    is_colour = image.problem is not None and image.problem.code == "VP1035"
    if image.pixels is None or (image.problem is not None and not is_colour):
        return (replace(image, pixels=None),)
    groups = sequence(data, "PerFrameFunctionalGroupsSequence")
    placed = _PLACED_BY.get(image.modality)
    if frames and not groups and placed is not None:
        try:
            return placed(image, data, _frame_pixels(image.pixels, element, frames))
        except VolprepError as error:
            return (replace(image, problem=error),)
    if frames == 0 or len(groups) != frames:
        what = f"places for {len(groups)} frames" if groups else "no places for them"
        shown = str(frames) if frames else "an unsound number of"
        return (replace(image, problem=VolprepError("VP1041", path=image.path, frames=shown, what=what)),)
    shared = (sequence(data, "SharedFunctionalGroupsSequence") or [Dataset()])[0]
    try:
        pixels = _frame_pixels(image.pixels, element, frames)
        parts = zip(groups, pixels, strict=True)
        return tuple(_slice(image, k + 1, shared, own, part) for k, (own, part) in enumerate(parts))
    except VolprepError as error:
        return (replace(image, problem=error),)


def _slice(image: SliceImage, number: int, shared: Dataset, own: Dataset, pixels: EncodedPixels) -> SliceImage:
    """Return one frame as a slice. Fields missing from its groups come from the image."""

    def group(keyword: str) -> Elements:
        found = sequence(own, keyword) or sequence(shared, keyword)
        return elements_of(found[0]) if found else {}

    def own_text(keyword: str, of_image: str) -> str:
        """Return a distinguishing attribute of the frame, or else that of the image."""
        holder, inside = _IN_GROUP.get(keyword, ("", ""))
        return (variant_text(group(holder), inside) if holder else "") or of_image

    measures = Fields(image.path, group("PixelMeasuresSequence"))
    orientation = Fields(image.path, group("PlaneOrientationSequence"))
    position = Fields(image.path, group("PlanePositionSequence"))
    of_volume = Fields(image.path, {**group("PlaneOrientationVolumeSequence"), **group("PlanePositionVolumeSequence")})
    position_of_volume = of_volume.numbers("ImagePositionVolume", 3)
    values = Fields(image.path, group("PixelValueTransformationSequence"))
    slope, intercept = values.number("RescaleSlope"), values.number("RescaleIntercept")
    if slope == 0.0:
        values.refuse("VP1037", keyword="RescaleSlope", wanted="a number other than 0")
    found = replace(
        image,
        number=number,
        orientation=orientation.numbers("ImageOrientationPatient", 6)
        or of_volume.numbers("ImageOrientationVolume", 6)
        or image.orientation,
        position_mm_xyz=position.numbers("ImagePositionPatient", 3) or position_of_volume or image.position_mm_xyz,
        is_in_volume=position_of_volume is not None,
        pixel_spacing_mm_yx=pixel_spacing(measures) or image.pixel_spacing_mm_yx,
        slice_thickness_mm=measures.hint("SliceThickness"),
        spacing_between_slices_mm=measures.hint("SpacingBetweenSlices"),
        slope=image.slope if slope is None else slope,
        intercept=image.intercept if intercept is None else intercept,
        unit=unit_of(values, image.modality, rescaled=intercept is not None) or image.unit,
        variants=tuple(starmap(own_text, zip(VARIANTS, image.variants, strict=True))),
        clocks=tuple(starmap(own_text, zip(CLOCKS, image.clocks, strict=True))),
        stack_position=variant_text(group("FrameContentSequence"), "InStackPositionNumber") or image.stack_position,
        pixels=pixels,
        has_real_world_values=image.has_real_world_values
        or any(sequence(part, "RealWorldValueMappingSequence") for part in (own, shared)),
    )
    read = (measures, orientation, position, of_volume, values)
    problems = [fields.problem for fields in read if fields.problem is not None]
    return replace(found, problem=problems[0]) if problems else found


def _frame_pixels(pixels: EncodedPixels, element: PixelElement, frames: int) -> list[EncodedPixels]:
    """Position of each frame in the pixel data."""
    syntax = UID(pixels.transfer_syntax)
    if syntax.is_transfer_syntax and syntax.is_encapsulated:
        return [
            replace(pixels, offset_bytes=start, size_bytes=end - start, is_bare=True)
            for start, end in _fragments(pixels, element, frames)
        ]
    size = picture_bytes(pixels)
    if pixels.size_bytes not in {frames * size, frames * size + frames * size % 2}:
        expected, actual = f"{frames * size} bytes", f"{pixels.size_bytes} bytes"
        raise VolprepError("VP1045", path=pixels.path, frames=frames, expected=expected, actual=actual)
    if syntax == ExplicitVRBigEndian and pixels.bits_allocated == 8 and pixels.has_words and size % 2:
        raise VolprepError("VP1041", path=pixels.path, frames=frames, what=SafeText("frames that begin within a word"))
    return [replace(pixels, offset_bytes=pixels.offset_bytes + k * size, size_bytes=size) for k in range(frames)]


def _fragments(pixels: EncodedPixels, element: PixelElement, frames: int) -> list[tuple[int, int]]:
    """Bytes of the items of each frame, with their headers."""
    items = [(offset - 8, offset + length) for offset, length in element.items[1:]]
    if len(items) == frames:
        return items
    begins = [items[0][0] + offset for offset in element.table] if items else []
    places = {start: k for k, (start, _) in enumerate(items)}
    firsts = [places[begin] for begin in begins if begin in places]
    if len(begins) != frames or len(firsts) != frames or firsts != sorted(set(firsts)) or firsts[0] != 0:
        raise VolprepError(
            "VP1045", path=pixels.path, frames=frames, expected="a table of their places", actual=f"{len(items)} parts"
        )
    lasts = [*(first - 1 for first in firsts[1:]), len(items) - 1]
    return [(items[first][0], items[last][1]) for first, last in zip(firsts, lasts, strict=True)]
