"""Facts about the values of a scan, from the sample of rays: where its background ends, and what kind of scan it is."""

from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array

_BINS = 256
_OUTLIERS = (0.1, 99.9)
"""Per cent of the sample that the histogram leaves out at either end."""
_AIR_TO_WATER_HU = 1000.0
_CT_SLACK_HU = 130.0
"""How far the distance of the peaks of air and of soft tissue may be from 1000: fat and muscle lie on both sides of
water."""
_CT_PEAK_SHARE = 0.03
"""Least share of the sample within 40 HU of each peak."""
_CT_PEAK_OF_BODY = 0.1
"""The same of soft tissue, as part of all that is denser than air, where that is at least `_LEAST_BODY` of the
sample."""
_LEAST_BODY = 0.02
_ABOVE_AIR_HU = 200.0
"""How far above the peak of air a body begins."""
_OFFSET_SLACK_HU = 60.0
"""How far the peak of air may be from where a usual offset puts it."""
_USUAL_OFFSETS = (0.0, -1000.0, -1024.0, -32768.0, -31744.0)
BONE_HU = 300.0
"""A CT that reaches this has bone in it, or contrast medium."""
_DIM_TIMES = 2.0
"""Times as much of a scan is brighter than the threshold of its dark part as is brighter than that of the whole, where
the brightness falls off through an object. MR of a spine beside its coil has 2.4; heads and brains have 1.0 to 1.7."""
_ONE_TISSUE = (0.12, 0.5)
"""Distance from the peak of the tissue, as part of that from air, within which at least this share of an object lies
where its dense parts are drawn alone. CT of heads have 0.6 to 0.7, MR 0.2 to 0.5."""
_DENSE = (1.3, 1.5)
"""Times the distance of the tissue from air where dense parts begin and are whole: 350 and 550 HU."""
_DENSE_SHARE = (0.06, 0.4)
"""Share of the object that is dense: bone in CT of heads has 0.1 to 0.17, inserts of an engine 0.05."""
_VESSEL_SHARE = (0.0003, 0.03)
"""Share of the shown voxels that are vessels where bright vessels are what a scan is about."""
_VESSEL_BRIGHTNESS = 2.2
"""Multiple of the median of the visible values, above their background, above which a voxel may be a vessel."""
_VESSEL_RANGE = 2.8
"""Times the median that the brightest voxels have in a scan of vessels; fat in a T1 scan has 2.0 to 2.4."""


@dataclass(frozen=True)
class Values:
    """Where the values of a scan lie."""

    low: float
    """Value below which one in a thousand lies."""
    high: float
    """Value above which one in a thousand lies."""
    background: float
    """Largest value of the surroundings of the object: air, or the noise of an empty field."""
    median: float
    """Median of the values above the background."""
    vessels: float | None
    """Smallest value of bright vessels; None if the scan has no bright vessels."""
    dense: tuple[float, float] | None = None
    """Values where dense parts begin and are whole, such as bone in a CT whose values are not Hounsfield units; None if
    the object has no such parts in one even tissue."""
    dim: float | None = None
    """Largest value of the surroundings of an object whose brightness falls off so far, as with the distance from a
    coil, that `background` is within it; otherwise None."""


def values_of(sample: Float64Array) -> Values:
    """Measure a sample of physical values."""
    low, high = (float(value) for value in np.percentile(sample, _OUTLIERS))
    if not low < high:
        return Values(low, high, low, high, None)
    background = _otsu(sample, low, high)
    shown = sample[sample > background]
    median = float(np.median(shown)) if shown.size else high
    vessels = _vessels(shown, low, high, median)
    dense = _dense(shown, float(np.median(sample[sample <= background])), high)
    return Values(low, high, background, median, vessels, dense, _dim(sample, low, background))


def hounsfield_offset(sample: Float64Array) -> float | None:
    """Return the offset from the values to Hounsfield units, or None if the values are not CT values.

    A CT has a peak of air and one of soft tissue, 1000 apart, and, unless these are at -1000 and 0, some bone above.
    """
    low, high = (float(value) for value in np.percentile(sample, _OUTLIERS))
    if not 1200.0 < high - low < 9000.0:
        return None
    counts, edges = np.histogram(sample, np.arange(low - 40.0, high + 60.0, 20.0))
    share = np.convolve(counts, np.ones(3), "same") / sample.size
    centres = (edges[:-1] + edges[1:]) / 2
    peaks = [k for k in range(len(share)) if share[k] == share[max(k - 1, 0) : k + 2].max()]
    for air in (k for k in peaks if share[k] >= _CT_PEAK_SHARE):
        guess = -_AIR_TO_WATER_HU - float(centres[air])
        near = min(_USUAL_OFFSETS, key=lambda offset: abs(offset - guess))
        is_usual = abs(near - guess) <= _OFFSET_SLACK_HU
        # Air at -1000 and tissue near 0 need no bone, and little tissue: a small body may lie in a wide field.
        in_units = is_usual and near == 0.0
        least = _CT_PEAK_SHARE
        if in_units and (of_body := float((sample > centres[air] + _ABOVE_AIR_HU).mean())) >= _LEAST_BODY:
            least = min(least, _CT_PEAK_OF_BODY * of_body)
        has_tissue = any(
            share[k] >= least and abs(centres[k] - centres[air] - _AIR_TO_WATER_HU) <= _CT_SLACK_HU for k in peaks
        )
        if has_tissue and (in_units or high - centres[air] >= _AIR_TO_WATER_HU + BONE_HU):
            return near if is_usual else round(guess)
    return None


def _otsu(sample: Float64Array, low: float, high: float) -> float:
    """Threshold that separates the sample best in two classes (Otsu 1979), over the range without outliers."""
    counts, edges = np.histogram(np.clip(sample, low, high), _BINS, (low, high))
    centres = (edges[:-1] + edges[1:]) / 2
    below = np.cumsum(counts).astype(np.float64)
    above = below[-1] - below
    sums = np.cumsum(counts * centres)
    with np.errstate(invalid="ignore", divide="ignore"):
        spread = below * above * (sums / below - (sums[-1] - sums) / above) ** 2
    best = np.flatnonzero(spread[:-1] >= np.nanmax(spread[:-1]) * (1 - 1e-9))
    # Between two peaks with nothing between them all thresholds are equally good: the middle one is the surface.
    return float((edges[1 + best[0]] + edges[1 + best[-1]]) / 2)


def _dim(sample: Float64Array, low: float, background: float) -> float | None:
    dark = np.maximum(sample[sample <= background], low)
    if not dark.size or dark.min() == dark.max():
        return None
    threshold = _otsu(dark, float(dark.min()), float(dark.max()))
    is_dim = np.count_nonzero(sample > threshold) >= _DIM_TIMES * np.count_nonzero(sample > background)
    return threshold if is_dim else None


def _dense(shown: Float64Array, air: float, high: float) -> tuple[float, float] | None:
    if not shown.size or not shown.min() < high:
        return None
    counts, edges = np.histogram(shown, _BINS // 2, (shown.min(), high))
    peak = int(np.convolve(counts, np.ones(5), "same").argmax())
    tissue = float(edges[peak] + edges[peak + 1]) / 2 - air
    start, whole = (air + times * tissue for times in _DENSE)
    reach, least = _ONE_TISSUE
    is_even = (np.abs(shown - air - tissue) < reach * tissue).mean() >= least
    is_usual = _DENSE_SHARE[0] <= (shown > whole).mean() <= _DENSE_SHARE[1]
    return (start, whole) if is_even and is_usual else None


def _vessels(shown: Float64Array, low: float, high: float, median: float) -> float | None:
    if not shown.size:
        return None
    threshold = low + _VESSEL_BRIGHTNESS * (median - low)
    share = float((shown > threshold).mean())
    if high - low < _VESSEL_RANGE * (median - low):
        return None
    return threshold if _VESSEL_SHARE[0] <= share <= _VESSEL_SHARE[1] else None
