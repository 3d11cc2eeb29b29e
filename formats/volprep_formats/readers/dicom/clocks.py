"""When images were taken: trigger delays, reference times and times of the day, in seconds.

Source: DICOM PS3.3, C.8.9.5 (FrameReferenceTime), C.7.6.16.2.2 (frames of enhanced images), C.7.6.18.1 (TriggerTime);
PS3.5, 6.2 for the types DT and TM.
"""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.readers.dicom.fields import CLOCKS, VARIANTS
from volprep_formats.readers.dicom.header import SliceImage

ORDERED_BY = ("TriggerTime", "TemporalPositionTimeOffset", "FrameReferenceTime", "AcquisitionTime", "ContentTime")
"""Attributes that may give the order of volumes, the most reliable one first."""
TIMES_OF_DAY = ("AcquisitionTime", "ContentTime")
_MILLISECONDS = ("TriggerTime", "FrameReferenceTime")
_TIME_OF_DAY = re.compile(r"(?:\d{8}(?=\d{6}))?(\d\d):?(\d\d)?:?(\d\d(?:\.\d{1,6})?)?(?:[+-]\d{4})?")
_DAY_S = 86400.0


def seconds_of(images: Sequence[SliceImage], clock: str) -> NDArray[np.float64]:
    """Return the time of each image in seconds, NaN where it is not known. Times of the day go on after midnight."""
    if clock in VARIANTS:
        texts = [image.variants[VARIANTS.index(clock)] for image in images]
    else:
        texts = [image.clocks[CLOCKS.index(clock)] for image in images]
    parse = _of_day if clock in TIMES_OF_DAY else _number
    seconds = np.array([parse(text) for text in texts]) * (1e-3 if clock in _MILLISECONDS else 1.0)
    if clock in TIMES_OF_DAY and np.nanmax(seconds, initial=0.0) - np.nanmin(seconds, initial=_DAY_S) > _DAY_S / 2:
        seconds[seconds < _DAY_S / 2] += _DAY_S
    return seconds


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return np.nan


def _of_day(text: str) -> float:
    found = _TIME_OF_DAY.fullmatch(text)
    if found is None:
        return np.nan
    hours, minutes, seconds = (float(part or 0.0) for part in found.groups())
    return 3600.0 * hours + 60.0 * minutes + seconds
