"""The attributes of a DICOM header that are read, and their values as sound ones.

Only the attributes in `TAGS` are ever looked at: that list is what protects the patient's identity. Values are checked
here, so that the rest of the reader computes with sound numbers. Source: DICOM PS3.6 (tags), PS3.5 (6.2 values).
"""

import math
import re
import struct
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from volprep_formats.diagnostics import VolprepError

LARGEST_NUMBER = 1e6
"""Of anything that a header says; lengths may be as many times smaller than a millimetre."""

VARIANTS = (
    "EchoTime",
    "InversionTime",
    "TriggerTime",
    "TemporalPositionIdentifier",
    "DiffusionBValue",
    "AcquisitionNumber",
    "ImageType",
)
"""Attributes that tell apart several images at one place."""

TAGS = {
    "EchoTime": 0x0018_0081,
    "InversionTime": 0x0018_0082,
    "TriggerTime": 0x0018_1060,
    "TemporalPositionIdentifier": 0x0020_0100,
    "DiffusionBValue": 0x0018_9087,
    "AcquisitionNumber": 0x0020_0012,
    "ImageType": 0x0008_0008,
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
    "PixelMeasuresSequence": 0x0028_9110,
    "PixelValueTransformationSequence": 0x0028_9145,
    "FrameContentSequence": 0x0020_9111,
    "TemporalPositionIndex": 0x0020_9128,
    "FrameAcquisitionNumber": 0x0020_9156,
    "StackID": 0x0020_9056,
    "MREchoSequence": 0x0018_9114,
    "EffectiveEchoTime": 0x0018_9082,
    "MRDiffusionSequence": 0x0018_9117,
    "CardiacSynchronizationSequence": 0x0018_9118,
    "NominalCardiacTriggerDelayTime": 0x0020_9153,
}
"""The only attributes that are read, besides `PRIVATE_TAGS`, and their tags: group and element."""
MOSAIC_CREATOR, MOSAIC_COUNT = 0x0019_0010, 0x0019_100A
CSA_CREATOR, CSA_HEADER = 0x0029_0010, 0x0029_1010
PRIVATE_TAGS = (MOSAIC_CREATOR, MOSAIC_COUNT, CSA_CREATOR, CSA_HEADER)
"""Where Siemens writes how many slices a mosaic holds, and which way they follow each other."""
Elements = Mapping[int, tuple[bytes, str]]
"""Values of elements as they stand in the file, and their byte order ("<" or ">"), by tag; no sequences."""

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
    )
)
"""Those of them that are stored as 16-bit numbers, the others being text."""
_LONGEST_UID = 64
_UID = re.compile(f"[0-9.]{{1,{_LONGEST_UID}}}")
_VARIANT_FORMS = {
    "DiffusionBValue": "d",
    "EffectiveEchoTime": "d",
    "NominalCardiacTriggerDelayTime": "d",
    "TemporalPositionIndex": "L",
    "FrameAcquisitionNumber": "H",
}
"""Forms of what tells images apart, where it is no text."""


def raw_value(data: Elements, keyword: str) -> tuple[bytes, str]:
    """Value of an attribute as it stands in the file, and its byte order; empty when missing, or a sequence."""
    return raw_element(data, TAGS[keyword])


def raw_element(data: Elements, tag: int) -> tuple[bytes, str]:
    """Value of the element `tag` as it stands in the file, and its byte order; empty when missing, or a sequence."""
    return data.get(tag, (b"", "<"))


def raw_text(data: Elements, keyword: str) -> str:
    """Value of a text attribute as it stands in the file."""
    return raw_value(data, keyword)[0].decode("latin-1").strip(" \0")


def variant_text(data: Elements, keyword: str) -> str:
    """Value of an attribute that tells images apart, as text; a binary number as its digits."""
    value, order = raw_value(data, keyword)
    form = _VARIANT_FORMS.get(keyword)
    if form is None:
        return raw_text(data, keyword)
    return repr(struct.unpack(order + form, value)[0]) if len(value) == struct.calcsize("=" + form) else ""


class Fields:
    """Attributes of one data set as sound values. The first that is wrong becomes `problem`.

    Values are converted here and not by pydicom: it takes three times as long, and damaged ones can raise anything.
    """

    def __init__(self, path: Path, data: Elements) -> None:
        self.path = path
        self.problem: VolprepError | None = None
        self._data = data

    def refuse(self, code: str, **fields: object) -> None:
        """Remember why this image cannot be used, unless a reason is known already."""
        self.problem = self.problem or VolprepError(code, path=self.path, **fields)

    def text(self, keyword: str) -> str:
        """Value as text; empty when missing."""
        return raw_text(self._data, keyword)

    def uid(self, keyword: str) -> str:
        """Value as a UID; empty when missing. What is none is a problem, and comes escaped and cut to its length."""
        text = self.text(keyword)
        if not text or _UID.fullmatch(text):
            return text
        self.refuse("VP1052", keyword=keyword)
        return ascii(text)[1:-1][:_LONGEST_UID]

    def numbers(self, keyword: str, count: int) -> tuple[float, ...] | None:
        """Value as `count` finite numbers of sane size; None when missing or wrong."""
        value, order = raw_value(self._data, keyword)
        numbers = _words(value, order) if keyword in _BINARY else _decimals(value)
        if not numbers:
            return None
        if len(numbers) != count or not all(abs(n) <= LARGEST_NUMBER for n in numbers):
            wanted = "a number" if count == 1 else f"{count} numbers"
            wanted += " of at most a million"
            self.refuse("VP1037", keyword=keyword, wanted=wanted)
            return None
        return numbers

    def number(self, keyword: str) -> float | None:
        """Value as one finite number; None when missing or wrong."""
        numbers = self.numbers(keyword, 1)
        return None if numbers is None else numbers[0]

    def hint(self, keyword: str) -> float | None:
        """Value as one number that geometry seldom needs; None when missing or wrong, which is no problem by itself."""
        found = Fields(self.path, self._data).number(keyword)
        return found or None

    def count(self, keyword: str, low: int, high: int) -> int:
        """Value as a whole number from low to high; `low`, and a problem, when it is missing or wrong."""
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
    """Numbers of a decimal string; NaN for what is none."""
    text = value.decode("latin-1").strip(" \0")
    try:
        return tuple(float(part) for part in text.split("\\")) if text else ()
    except ValueError:
        return (math.nan,)


@lru_cache(maxsize=4096)
def _words(value: bytes, order: str) -> tuple[float, ...]:
    """16-bit numbers; NaN where a byte is left over."""
    if len(value) % 2:
        return (math.nan,)
    return tuple(float(n) for n in struct.unpack(f"{order}{len(value) // 2}H", value))
