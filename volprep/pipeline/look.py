"""A first look at a scan, before anything is built: three slices, a histogram, and the kind that was recognised.

It reads up to 128 slices, spread over the scan, so that it takes about a second.
"""

from dataclasses import dataclass
from math import ceil, prod, sqrt
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.pipeline.prepare import Prepared, prepare
from volprep.scan.repair import open_scan
from volprep.scene.first_look import with_first_look
from volprep.scene.request import Request
from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Statistics
from volprep_formats.progress import Silent
from volprep_formats.readers.colour import unpacked
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource
from volprep_formats.srgb import srgb_of_linear

BINS = 64
_SLICES = 128
_OUTLIERS = (0.5, 99.5)
"""Per cent of the values that are shown black and white."""
_PANEL_PIXELS = 256
_GAP_PIXELS = 8
_HISTOGRAM_PIXELS = 96
_MOST_SAMPLES = 2_000_000
_MOST_KEPT = 2**23
"""Voxels that are kept for slices and histogram, about: 128 slices of 256×256. Larger slices are thinned."""
_MOST_COLOUR_PIXELS = 256


@dataclass(frozen=True)
class ScanPreview:
    """Results of a look at a scan."""

    info: SourceInfo
    """Geometry, type and remarks."""
    slices: tuple[Float64Array, Float64Array, Float64Array]
    """Physical values in the middle across z, y and x, [row, column], as coarse as the look was; of a volume in colour
    sRGB colours on black, [row, column, 3]."""
    shapes_mm: tuple[tuple[float, float], tuple[float, float], tuple[float, float]]
    """Height and width of each of them."""
    ends: tuple[float, float]
    """Least and greatest value that was met; of a volume in colour, shares of the largest extinction."""
    is_whole: bool
    """Whether all slices were read, so that these are the ends of the scan."""
    not_numbers: int
    """Values that were NaN or infinite."""
    counts: tuple[int, ...]
    """Histogram of the values that were read, between the ends."""
    recognised: str
    """The kind that was recognised; "" if a scene says how it is drawn."""


def look_at(request: Request) -> ScanPreview:
    """Look at the first channel of a scan. Raises the errors of its reader."""
    prepared = prepare(request)
    try:
        info, planes = _first_planes(prepared)
    except VolprepError as error:
        prepared = prepared.after(error)
        info, planes = _first_planes(prepared)
    shown = planes.values
    if prepared.channels[0].spec.colour is not None:
        shown, planes = _colours(prepared.channels[0].spec, planes.places)
    depth = info.grid.shape_zyx[0]
    z_mm, y_mm, x_mm = info.grid.extent_mm_zyx
    middle = shown[int(np.argmin(np.abs(planes.places - depth // 2)))]
    finite = planes.values[np.isfinite(planes.values)]
    sample = finite[:: max(1, finite.size // _MOST_SAMPLES)]
    ends = planes.ends
    counts, _ = np.histogram(sample, BINS, ends if ends[0] < ends[1] else (ends[0], ends[0] + 1.0))
    recognised = prepared.scene.recognised
    if prepared.first_look and len(prepared.channels) == 1 and sample.size:
        statistics = Statistics(minimum=ends[0], maximum=ends[1], non_finite=0)
        looked = with_first_look(prepared.scene, prepared.profile, info, statistics, sample, faces=planes.faces)
        recognised = looked.recognised
    return ScanPreview(
        info=info,
        slices=(middle, shown[:, shown.shape[1] // 2], shown[:, :, shown.shape[2] // 2]),
        shapes_mm=((y_mm, x_mm), (z_mm, x_mm), (z_mm, y_mm)),
        ends=ends,
        is_whole=len(planes.places) == depth,
        not_numbers=planes.not_numbers,
        counts=tuple(counts.tolist()),
        recognised=recognised,
    )


@dataclass(frozen=True)
class _Planes:
    """Slices of a scan."""

    values: Float64Array
    """Physical values [slice, y, x], thinned in y and x."""
    places: NDArray[np.intp]
    """Numbers of the slices."""
    ends: tuple[float, float]
    """Least and greatest finite value of all their voxels; 0 without one."""
    not_numbers: int
    """Voxels that are NaN or infinite."""

    @property
    def faces(self) -> tuple[Float64Array, Float64Array, Float64Array]:
        """Values on the faces of the box across z, y and x, each [first or last, place]."""
        z, y, x = (np.moveaxis(self.values, axis, 0)[[0, -1]].reshape(2, -1) for axis in range(3))
        return z, y, x


def _first_planes(prepared: Prepared) -> tuple[SourceInfo, _Planes]:
    return next((info, _planes(source)) for _, info, source in prepared.sources(Silent()))


def _colours(spec: SourceSpec, places: NDArray[np.intp]) -> tuple[Float64Array, _Planes]:
    """Return sRGB colours on black [slice, y, x, 3], and slices of shares of the largest extinction."""
    every = spec.model_copy(update={"colour": spec.colour and spec.colour.model_copy(update={"part": "all"})})
    with open_scan(every, Path("/"), Silent()) as source:
        # Four numbers of 64 bits for each pixel: large pictures are thinned.
        step = max(1, max(source.info.grid.shape_zyx[1:]) // _MOST_COLOUR_PIXELS)
        slices = [unpacked(source.read_slab(z, z + 1)[:, ::step, ::step]) for z in places.tolist()]
    values = np.concatenate(slices) / 65535
    shares = values[..., 3]
    ends = (float(shares.min()), float(shares.max()))
    return srgb_of_linear(values[..., :3]), _Planes(shares, places, ends, not_numbers=0)


def _planes(source: VolumeSource) -> _Planes:
    """Read up to 128 slices."""
    info = source.info
    depth, height, width = info.grid.shape_zyx
    most = max(3, min(_SLICES, 2**27 // max(1, height * width)))
    places = np.unique(np.linspace(0, depth - 1, min(depth, most)).round().astype(np.intp))
    step = max(1, ceil(sqrt(len(places) * height * width / _MOST_KEPT)))
    kept, ends, numbers = [], [], 0
    for z in places.tolist():
        plane = source.read_slab(z, z + 1)[0]
        kept.append(plane[::step, ::step].copy())
        finite = plane[np.isfinite(plane)] if plane.dtype.kind == "f" else plane
        numbers += finite.size
        ends += [finite.min(), finite.max()] if finite.size else []
    values: Float64Array = info.slope * np.asarray(kept, np.float64) + info.intercept
    physical = [info.slope * float(end) + info.intercept for end in ends] or [0.0]
    others = len(places) * height * width - numbers
    return _Planes(values, places, (min(physical), max(physical)), not_numbers=others)


def picture(looked: ScanPreview) -> UInt8Array:
    """Draw the three slices beside each other, the histogram below, as [H, W, 3]. The top of a slice is its last z."""
    low, high = _window(looked)
    tallest_mm = max(value for shape in looked.shapes_mm for value in shape)
    panels = []
    for number, (values, shape_mm) in enumerate(zip(looked.slices, looked.shapes_mm, strict=True)):
        panel = np.zeros((_PANEL_PIXELS, _PANEL_PIXELS, 3))
        rows, columns = (max(1, round(_PANEL_PIXELS * length / tallest_mm)) for length in shape_mm)
        resized = _resized(values if number == 0 else values[::-1], rows, columns)
        top, left = (_PANEL_PIXELS - rows) // 2, (_PANEL_PIXELS - columns) // 2
        shades = np.clip((resized - low) / (high - low), 0.0, 1.0)
        panel[top : top + rows, left : left + columns] = shades if shades.ndim == 3 else shades[..., None]
        panels += [panel, np.zeros((_PANEL_PIXELS, _GAP_PIXELS, 3))]
    above = np.hstack(panels[:-1])
    bars = np.repeat(_bars(looked, above.shape[1])[..., None], 3, axis=2)
    whole = np.vstack([above, np.zeros((_GAP_PIXELS, above.shape[1], 3)), bars])
    drawn: UInt8Array = np.rint(255 * np.nan_to_num(whole)).astype(np.uint8)
    return drawn


def _window(looked: ScanPreview) -> tuple[float, float]:
    if looked.slices[0].ndim == 3:
        return 0.0, 1.0
    finite = np.concatenate([slice_[np.isfinite(slice_)].ravel() for slice_ in looked.slices])
    low, high = np.percentile(finite, _OUTLIERS) if finite.size else (0.0, 1.0)
    return (float(low), float(high)) if low < high else (float(low), float(low) + 1.0)


def _resized(values: Float64Array, rows: int, columns: int) -> Float64Array:
    """Take the nearest value for each pixel."""
    y = (np.arange(rows) + 0.5) * values.shape[0] / rows
    x = (np.arange(columns) + 0.5) * values.shape[1] / columns
    resized: Float64Array = values[y.astype(int)][:, x.astype(int)]
    return resized


def _bars(looked: ScanPreview, width: int) -> Float64Array:
    """Draw the histogram, heights by the logarithm of the counts."""
    heights = np.log1p(looked.counts)
    heights = heights / max(float(heights.max()), 1e-9) * (_HISTOGRAM_PIXELS - 1)
    columns = heights[np.arange(width) * len(heights) // width]
    rows = np.arange(_HISTOGRAM_PIXELS)[::-1, None]
    bars: Float64Array = np.where(rows <= columns, 0.7, 0.0)
    return bars


def size_bytes(info: SourceInfo) -> int:
    """Return the size of the voxels as they are read."""
    return prod(info.grid.shape_zyx) * np.dtype(info.stored_type).itemsize
