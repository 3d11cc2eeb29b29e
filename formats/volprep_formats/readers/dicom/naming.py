"""Names of DICOM series for people: number, description, kernel, echo, image type and time.

It is read from the first file of a series, and only for the screen: a description is free text, which may name a
patient, and times are dates of a person's life. Nothing here reaches a package.
"""

import warnings
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from volprep_formats.readers.dicom.kind import has_prefix

_KEYWORDS = (
    "SeriesNumber",
    "SeriesDescription",
    "ConvolutionKernel",
    "EchoTime",
    "ImageType",
    "SeriesTime",
    "AcquisitionTime",
)
_LONGEST = 60
_HEAD_BYTES = 132


@dataclass(frozen=True)
class SeriesName:
    """Facts of one series; empty or None where the header has none."""

    number: int | None = None
    """SeriesNumber."""
    description: str = ""
    """SeriesDescription."""
    kernel: str = ""
    """ConvolutionKernel."""
    echo_ms: float | None = None
    """EchoTime."""
    image_type: str = ""
    """Values of ImageType beyond the first two, which are ORIGINAL or DERIVED, and PRIMARY or SECONDARY."""
    time: str = ""
    """Start of the series, hh:mm:ss."""

    @property
    def details(self) -> str:
        """Return kernel, echo, image type and time in one text."""
        echo = "" if self.echo_ms is None else f"echo {self.echo_ms:g} ms"
        return ", ".join(value for value in (self.kernel, echo, self.image_type, self.time) if value)


def series_name(path: Path) -> SeriesName:
    """Read the facts of the series that a file belongs to; missing and odd values stay empty."""
    if not _is_dicom(path):
        return SeriesName()
    import pydicom  # noqa: PLC0415 - only for the screen

    found: dict[str, str] = {}
    # pydicom raises many kinds for odd headers, and this is a courtesy.
    with suppress(Exception), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        data = pydicom.dcmread(path, stop_before_pixels=True, specific_tags=[*_KEYWORDS])
        for keyword in _KEYWORDS:
            value = data.get(keyword)
            several = value if isinstance(value, (list, pydicom.multival.MultiValue)) else [value]
            found[keyword] = "\\".join(str(value).strip() for value in several if value is not None)[:_LONGEST]
    time = found.get("SeriesTime") or found.get("AcquisitionTime") or ""
    return SeriesName(
        number=_whole(found.get("SeriesNumber", "")),
        description=found.get("SeriesDescription", ""),
        kernel=found.get("ConvolutionKernel", ""),
        echo_ms=_number(found.get("EchoTime", "")),
        image_type=" ".join(found.get("ImageType", "").split("\\")[2:]),
        time=":".join((time[:2], time[2:4], time[4:6])) if time[:6].isdecimal() and len(time) >= 6 else "",
    )


def _is_dicom(path: Path) -> bool:
    with suppress(OSError), path.open("rb") as file:
        return has_prefix(file.read(_HEAD_BYTES))
    return False


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _whole(text: str) -> int | None:
    number = _number(text)
    return int(number) if number is not None and number == number // 1 and abs(number) < 1e9 else None
