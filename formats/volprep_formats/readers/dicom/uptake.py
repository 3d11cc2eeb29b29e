"""Standardised uptake values by body weight of a PET series: PS3.3 C.8.9.1, and the vendor-neutral steps of QIBA.

SUV = activity concentration · weight / injected dose, the dose decayed to the time that the images are corrected to.
The attributes are read from one header when a scene asks for SUV, and nothing but the factor is kept.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

from volprep_formats.readers.dicom.header import SliceImage
from volprep_formats.source import SUV_UNIT

if TYPE_CHECKING:
    from pydicom.dataset import Dataset

_TAGS = (
    "Units",
    "DecayCorrection",
    "CorrectedImage",
    "PatientWeight",
    "SeriesDate",
    "SeriesTime",
    "AcquisitionDate",
    "RadiopharmaceuticalInformationSequence",
)
_LONGEST = timedelta(days=2)
"""From the injection to the images: a longer time is a mistake in the header."""
_ACQUIRED = 2
"""Place of AcquisitionTime among the clocks of a slice."""


@dataclass(frozen=True)
class Uptake:
    """How activity concentrations become SUV."""

    factor: float
    """Number that the values are multiplied by; 1 if they stay."""
    unit: str
    """Unit of the values."""
    remark: str
    """For people."""


class _MissingError(Exception):
    """The header lacks an attribute."""


def uptake_of(images: Sequence[SliceImage]) -> Uptake:
    """Return how the values of a series become SUV by body weight; its remark says why, if they do not."""
    first = images[0]
    if first.modality != "PT" or first.unit != "Bq/ml":
        remark = "" if first.unit == "Gy" else "the values are not SUV: it is no PET series in Bq/ml"
        return Uptake(1.0, first.unit, remark)
    try:
        factor = _factor(_header(first.path), [image.clocks[_ACQUIRED] for image in images])
    except _MissingError as problem:
        return Uptake(1.0, first.unit, f"the values are not SUV: {problem}")
    return Uptake(factor, SUV_UNIT, "the values are SUV by body weight, in g/ml")


def _header(path: Path) -> "Dataset":
    from pydicom import dcmread  # noqa: PLC0415 - loads slowly

    from volprep_formats.readers.dicom.any_file import quiet_pydicom  # noqa: PLC0415 - loads pydicom

    try:
        with quiet_pydicom():
            return dcmread(path, force=True, stop_before_pixels=True, specific_tags=list(_TAGS))
    except Exception as error:
        msg = "its header cannot be read a second time"
        raise _MissingError(msg) from error


def _factor(data: "Dataset", acquired: Sequence[str]) -> float:
    """Return g/ml for each Bq/ml. Raises _MissingError for what the header does not say."""
    corrected = str(data.get("CorrectedImage", "")).upper()
    for word in ("ATTN", "DECY"):
        if word not in corrected:
            msg = f"CorrectedImage does not say {word}"
            raise _MissingError(msg)
    injection = next(iter(data.get("RadiopharmaceuticalInformationSequence", None) or ()), None)
    if injection is None:
        msg = "RadiopharmaceuticalInformationSequence is missing"
        raise _MissingError(msg)
    weight_kg, dose_bq = _positive(data, "PatientWeight"), _positive(injection, "RadionuclideTotalDose")
    correction = str(data.get("DecayCorrection", "")).upper()
    if correction == "START":
        elapsed_s = _elapsed(data, injection, acquired).total_seconds()
        dose_bq *= 2.0 ** (-elapsed_s / _positive(injection, "RadionuclideHalfLife"))
    elif correction != "ADMIN":
        msg = "DecayCorrection is neither START nor ADMIN"
        raise _MissingError(msg)
    return 1000.0 * weight_kg / dose_bq


def _elapsed(data: "Dataset", injection: "Dataset", acquired: Sequence[str]) -> timedelta:
    """Return the time from the injection to the time that the images are corrected to: the start of the series.

    A series time behind the first acquisition is that of a later processing, and the first acquisition counts.
    """
    date = str(data.get("SeriesDate", ""))
    series = _moment(date, str(data.get("SeriesTime", "")), "SeriesDate and SeriesTime")
    times = sorted(value for value in acquired if value)
    if times:
        first = _moment(str(data.get("AcquisitionDate", "")) or date, times[0], "AcquisitionTime")
        series = min(series, first)
    told = str(injection.get("RadiopharmaceuticalStartDateTime", "") or "")
    time = str(injection.get("RadiopharmaceuticalStartTime", "") or "")
    injected = _moment(told[:8], told[8:], "") if told else _moment(date, time, "RadiopharmaceuticalStartTime")
    elapsed = series - injected
    if not timedelta(0) <= elapsed <= _LONGEST:
        msg = "the injection is not within two days before the series"
        raise _MissingError(msg)
    return elapsed


def _moment(date: str, time: str, keyword: str) -> datetime:
    digits = time.partition("+")[0].partition("-")[0].partition(".")[0]
    try:
        # Minutes and seconds may be left out.
        return datetime.strptime(date + (digits.ljust(6, "0") if digits else ""), "%Y%m%d%H%M%S")  # noqa: DTZ007 - only differences are taken
    except ValueError:
        msg = f"{keyword or 'RadiopharmaceuticalStartDateTime'} is missing or no time"
        raise _MissingError(msg) from None


def _positive(data: Any, keyword: str) -> float:
    try:
        number = float(data.get(keyword, math.nan))
    except (TypeError, ValueError):
        number = math.nan
    if not 0.0 < number < math.inf:
        msg = f"{keyword} is missing or not above 0"
        raise _MissingError(msg)
    return number
