"""The DICOM attributes that are read, and their checked values.

Only the attributes in `TAGS` are read: that list protects the patient's identity. Values are checked here, so that the
rest of the reader computes with valid numbers. Source: DICOM PS3.6 (tags), PS3.5 (6.2 values).
"""

import math
import re
import struct
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from volprep_formats.diagnostics import VolprepError

LARGEST_NUMBER = 1e6
"""Largest magnitude of any header value. Lengths in mm must be at least the inverse of it."""

VARIANTS = (
    "EchoTime",
    "InversionTime",
    "TriggerTime",
    "TemporalPositionIdentifier",
    "DiffusionBValue",
    "AcquisitionNumber",
    "ImageType",
    "ComplexImageComponent",
    "StackID",
)
"""Attributes that distinguish several images at one position."""
CLOCKS = ("FrameReferenceTime", "TemporalPositionTimeOffset", "AcquisitionTime", "ContentTime")
"""Attributes that say when an image was taken, and may differ between the slices of one volume."""

TAGS = {
    "FrameReferenceTime": 0x0054_1300,
    "TemporalPositionTimeOffset": 0x0020_930D,
    "AcquisitionTime": 0x0008_0032,
    "ContentTime": 0x0008_0033,
    "FrameAcquisitionDateTime": 0x0018_9074,
    "EchoTime": 0x0018_0081,
    "InversionTime": 0x0018_0082,
    "TriggerTime": 0x0018_1060,
    "TemporalPositionIdentifier": 0x0020_0100,
    "DiffusionBValue": 0x0018_9087,
    "AcquisitionNumber": 0x0020_0012,
    "ImageType": 0x0008_0008,
    "ComplexImageComponent": 0x0008_9208,
    "StackID": 0x0020_9056,
    "InstanceNumber": 0x0020_0013,
    "ImagesInAcquisition": 0x0020_1002,
    "InConcatenationNumber": 0x0020_9162,
    "InConcatenationTotalNumber": 0x0020_9163,
    "DetectorInformationSequence": 0x0054_0022,
    "SliceVector": 0x0054_0080,
    "GridFrameOffsetVector": 0x3004_000C,
    "DoseGridScaling": 0x3004_000E,
    "DoseUnits": 0x3004_0002,
    "MRImageFrameTypeSequence": 0x0018_9226,
    "SOPClassUID": 0x0008_0016,
    "SOPInstanceUID": 0x0008_0018,
    "SeriesInstanceUID": 0x0020_000E,
    "FrameOfReferenceUID": 0x0020_0052,
    "Modality": 0x0008_0060,
    "BurnedInAnnotation": 0x0028_0301,
    "SliceThickness": 0x0018_0050,
    "SpacingBetweenSlices": 0x0018_0088,
    "ImagePositionPatient": 0x0020_0032,
    "ImageOrientationPatient": 0x0020_0037,
    "SamplesPerPixel": 0x0028_0002,
    "PlanarConfiguration": 0x0028_0006,
    "PhotometricInterpretation": 0x0028_0004,
    "NumberOfFrames": 0x0028_0008,
    "Rows": 0x0028_0010,
    "Columns": 0x0028_0011,
    "PixelSpacing": 0x0028_0030,
    "BitsAllocated": 0x0028_0100,
    "BitsStored": 0x0028_0101,
    "HighBit": 0x0028_0102,
    "PixelRepresentation": 0x0028_0103,
    "PixelPaddingValue": 0x0028_0120,
    "RescaleIntercept": 0x0028_1052,
    "RescaleSlope": 0x0028_1053,
    "RescaleType": 0x0028_1054,
    "Units": 0x0054_1001,
    "ModalityLUTSequence": 0x0028_3000,
    "LUTDescriptor": 0x0028_3002,
    "ModalityLUTType": 0x0028_3004,
    "LUTData": 0x0028_3006,
    "RealWorldValueMappingSequence": 0x0040_9096,
    "SharedFunctionalGroupsSequence": 0x5200_9229,
    "PerFrameFunctionalGroupsSequence": 0x5200_9230,
    "PlanePositionSequence": 0x0020_9113,
    "PlaneOrientationSequence": 0x0020_9116,
    "PlanePositionVolumeSequence": 0x0020_930E,
    "PlaneOrientationVolumeSequence": 0x0020_930F,
    "ImagePositionVolume": 0x0020_9301,
    "ImageOrientationVolume": 0x0020_9302,
    "PixelMeasuresSequence": 0x0028_9110,
    "PixelValueTransformationSequence": 0x0028_9145,
    "FrameContentSequence": 0x0020_9111,
    "TemporalPositionIndex": 0x0020_9128,
    "FrameAcquisitionNumber": 0x0020_9156,
    "InStackPositionNumber": 0x0020_9057,
    "FrameType": 0x0008_9007,
    "MREchoSequence": 0x0018_9114,
    "EffectiveEchoTime": 0x0018_9082,
    "MRModifierSequence": 0x0018_9115,
    "InversionTimes": 0x0018_9079,
    "MRDiffusionSequence": 0x0018_9117,
    "CardiacSynchronizationSequence": 0x0018_9118,
    "NominalCardiacTriggerDelayTime": 0x0020_9153,
}
"""Tags (group and element) of the only attributes that are read, besides `PRIVATE_TAGS`."""
MOSAIC_CREATOR, MOSAIC_COUNT = 0x0019_0010, 0x0019_100A
CSA_CREATOR, CSA_HEADER = 0x0029_0010, 0x0029_1010
PRIVATE_TAGS = (MOSAIC_CREATOR, MOSAIC_COUNT, CSA_CREATOR, CSA_HEADER)
"""Siemens elements with the number of slices of a mosaic, and their direction."""
Elements = Mapping[int, tuple[bytes, str]]
"""Raw element values and their byte order ("<" or ">"), by tag; no sequences."""

_BINARY = frozenset(
    (
        "SamplesPerPixel",
        "PlanarConfiguration",
        "Rows",
        "Columns",
        "BitsAllocated",
        "BitsStored",
        "HighBit",
        "PixelRepresentation",
        "InConcatenationNumber",
        "InConcatenationTotalNumber",
        "SliceVector",
    )
)
"""Attributes stored as 16-bit numbers."""
_DOUBLES = frozenset(("ImagePositionVolume", "ImageOrientationVolume"))
"""Attributes stored as 64-bit floating-point numbers; the others are text."""
_LONGEST_UID = 64
_UID = re.compile(f"[0-9.]{{1,{_LONGEST_UID}}}")
_VARIANT_FORMS = {
    "DiffusionBValue": "d",
    "EffectiveEchoTime": "d",
    "NominalCardiacTriggerDelayTime": "d",
    "InversionTimes": "d",
    "TemporalPositionIndex": "L",
    "TemporalPositionTimeOffset": "d",
    "FrameAcquisitionNumber": "H",
    "InStackPositionNumber": "L",
}
"""Formats of the binary attributes."""


def raw_value(data: Elements, keyword: str) -> tuple[bytes, str]:
    """Return the raw value of an attribute and its byte order; empty if it is missing or a sequence."""
    return raw_element(data, TAGS[keyword])


def raw_element(data: Elements, tag: int) -> tuple[bytes, str]:
    """Return the raw value of the element `tag` and its byte order; empty if it is missing or a sequence."""
    return data.get(tag, (b"", "<"))


def raw_text(data: Elements, keyword: str) -> str:
    """Return the raw value of a text attribute."""
    return raw_value(data, keyword)[0].decode("latin-1").strip(" \0")


def variant_text(data: Elements, keyword: str) -> str:
    """Return a distinguishing attribute as text; a binary number as its digits."""
    value, order = raw_value(data, keyword)
    form = _VARIANT_FORMS.get(keyword)
    if form is None:
        return raw_text(data, keyword)
    return repr(struct.unpack(order + form, value)[0]) if len(value) == struct.calcsize("=" + form) else ""


class Fields:
    """Checked attributes of one data set. The first invalid one becomes `problem`.

    Values are converted here and not by pydicom: it takes three times as long, and damaged ones can raise anything.
    """

    def __init__(self, path: Path, data: Elements) -> None:
        self.path = path
        self.problem: VolprepError | None = None
        self._data = data

    def refuse(self, code: str, **fields: object) -> None:
        """Record why this image cannot be used, unless a reason is already recorded."""
        self.problem = self.problem or VolprepError(code, path=self.path, **fields)

    def text(self, keyword: str) -> str:
        """Return the value as text; empty when missing."""
        return raw_text(self._data, keyword)

    def uid(self, keyword: str) -> str:
        """Return a UID, or empty if missing. An invalid UID is a problem, and is escaped and truncated."""
        text = self.text(keyword)
        if not text or _UID.fullmatch(text):
            return text
        self.refuse("VP1052", keyword=keyword)
        return ascii(text)[1:-1][:_LONGEST_UID]

    def numbers(self, keyword: str, count: int) -> tuple[float, ...] | None:
        """Return `count` finite numbers of plausible size; None when missing or invalid."""
        value, order = raw_value(self._data, keyword)
        form = "H" if keyword in _BINARY else "d" if keyword in _DOUBLES else ""
        numbers = _unpacked(value, order, form) if form else _decimals(value)
        if not numbers:
            return None
        if len(numbers) != count or not all(abs(n) <= LARGEST_NUMBER for n in numbers):
            wanted = "a number" if count == 1 else f"{count} numbers"
            wanted += " of at most a million"
            self.refuse("VP1037", keyword=keyword, wanted=wanted)
            return None
        return numbers

    def number(self, keyword: str) -> float | None:
        """Return one finite number; None when missing or invalid."""
        numbers = self.numbers(keyword, 1)
        return None if numbers is None else numbers[0]

    def hint(self, keyword: str) -> float | None:
        """Return an optional number; None when missing or invalid, which is not a problem by itself."""
        found = Fields(self.path, self._data).number(keyword)
        return found or None

    def count(self, keyword: str, low: int, high: int) -> int:
        """Return an integer from low to high; `low`, and a problem, when it is missing or invalid."""
        number = self.number(keyword)
        if number is None:
            self.refuse("VP1036", keyword=keyword)
        elif number != int(number) or not low <= number <= high:
            self.refuse("VP1037", keyword=keyword, wanted=f"a whole number from {low} to {high}")
        else:
            return int(number)
        return low


# Most values of a series are the same in all its slices.
@lru_cache(maxsize=4096)
def _decimals(value: bytes) -> tuple[float, ...]:
    """Parse the numbers of a decimal string; NaN where invalid."""
    text = value.decode("latin-1").strip(" \0")
    try:
        return tuple(float(part) for part in text.split("\\")) if text else ()
    except ValueError:
        return (math.nan,)


@lru_cache(maxsize=4096)
def _unpacked(value: bytes, order: str, form: str) -> tuple[float, ...]:
    """Return binary numbers; NaN where bytes are left over."""
    count, left = divmod(len(value), struct.calcsize(f"={form}"))
    return (math.nan,) if left else tuple(float(n) for n in struct.unpack(f"{order}{count}{form}", value))
