"""A ray integrator in NumPy: samples composited as each kind of picture defines it.

Samples have equal distances. Through labels there is one in each voxel that a ray passes, which is exact.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.witness.independent.normals import WitnessedLight, lit_colours
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan, between_eight

_ROUNDING = 1e-6
"""In voxels."""
_MOST_SAMPLES = 300_000
"""Samples in memory at once."""


@dataclass(frozen=True)
class WitnessedMedium:
    """A scan with its transfer function."""

    scan: WitnessedScan
    values: Floats
    colours: Floats
    extinctions_per_mm: Floats
    reference_mm: float
    isovalue: float | None
    intensities: tuple[float, float]
    nearest: bool
    absorbs: bool = True
    """False for red, green and blue of a volume in colour: they give light, and its opacity alone absorbs."""

    @property
    def scan_of_normals(self) -> WitnessedScan:
        """The scan whose gradients light falls on: of labels their extinction."""
        scan = self.scan
        if not self.nearest:
            return scan
        return replace(scan, stored=self.at(scan.physical(scan.stored))[1], slope=1.0, intercept=0.0)

    def at(self, values: Floats) -> tuple[Floats, Floats]:
        """Return colours [..., 3] and extinctions [...] of physical values; at a jump the upper side."""
        found = [np.interp(values, self.values, value) for value in (*self.colours.T, self.extinctions_per_mm)]
        return np.stack(found[:3], axis=-1), found[3]


@dataclass(frozen=True)
class Samples:
    """Samples of rays, [ray, sample]."""

    shown: Sequence[WitnessedMedium]
    values: Sequence[Floats]
    """Of each scan."""
    world_mm: Floats
    directions: Floats
    length_mm: Floats
    """Length of the path around each sample, [ray, sample], or [ray, 1] if all are equal."""
    lights: Sequence[WitnessedLight | None]
    """On each scan."""

    def colours(self, number: int, values: Floats) -> tuple[Floats, Floats]:
        """Return lit colours and extinctions of one scan."""
        colours, extinctions = self.shown[number].at(np.nan_to_num(values))
        extinctions = np.where(np.isnan(values), 0.0, extinctions)
        light = self.lights[number]
        if light is not None:
            colours = lit_colours(colours, light, self.shown[number].scan, self.world_mm, self.directions)
        return colours, extinctions


def picture(
    shown: Sequence[WitnessedMedium],
    rays: tuple[Floats, Floats],
    compositing: str,
    step_mm: float,
    lights: Sequence[WitnessedLight | None],
) -> Floats:
    """Return premultiplied linear pixels [ray, 4] of origins and directions of rays through the boxes of all scans."""
    origins, directions = rays
    if compositing not in _COMPOSITED:
        raise CannotWitnessError(f"the NumPy integrator has no compositing {compositing}")
    enter, leave = _through_boxes(shown, origins, directions)
    met = np.flatnonzero(leave > enter)
    result = np.zeros((len(origins), 4))
    if not len(met):
        return result
    is_labels = all(medium.nearest for medium in shown)
    count = max(1, int(np.ceil((leave - enter)[met].max() / step_mm)))
    most = int(shown[0].scan.counts_xyz.sum()) if is_labels else count
    for part in np.array_split(met, -(-len(met) * most // _MOST_SAMPLES)):
        if is_labels:
            along, length = _voxels(shown[0].scan, origins[part], directions[part], enter[part], leave[part])
        else:
            length = (leave - enter)[part, None] / count
            along = enter[part, None] + length * (np.arange(count) + 0.5)
        at = origins[part, None] + along[..., None] * directions[part, None]
        values = [sampled(medium.scan, at, nearest=medium.nearest) for medium in shown]
        if len(shown) > 1:
            values = [_within(medium.scan, at, found) for medium, found in zip(shown, values, strict=True)]
        result[part] = _COMPOSITED[compositing](Samples(shown, values, at, directions[part], length, lights))
    return result


def sampled(scan: WitnessedScan, world_mm: Floats, *, nearest: bool) -> Floats:
    """Return physical values at places [..., 3]: between eight voxels, or of the nearest; edges go on outside."""
    last = scan.counts_xyz - 1
    place = np.clip(scan.index_of(world_mm), 0.0, last)
    if nearest:
        x, y, z = np.moveaxis(np.rint(place).astype(np.intp), -1, 0)
        return scan.physical(scan.stored[z, y, x])
    return scan.physical(between_eight(scan.stored, place))


def _voxels(
    scan: WitnessedScan, origins: Floats, directions: Floats, enter: Floats, leave: Floats
) -> tuple[Floats, Floats]:
    """Return the middle and the length of the part of each ray in each voxel, [ray, part]; some lengths are 0."""
    inverse = np.linalg.inv(scan.world_from_index)
    start, per_mm = scan.index_of(origins), directions @ inverse[:3, :3].T
    faces = [
        (np.arange(count - 1) + 0.5 - start[:, axis, None]) / np.where(per_mm == 0.0, 1e-300, per_mm)[:, axis, None]
        for axis, count in enumerate(scan.counts_xyz.astype(int))
    ]
    ends = np.sort(np.clip(np.concatenate(faces, axis=1), enter[:, None], leave[:, None]), axis=1)
    ends = np.concatenate([enter[:, None], ends, leave[:, None]], axis=1)
    return 0.5 * (ends[:, 1:] + ends[:, :-1]), np.diff(ends, axis=1)


def _within(scan: WitnessedScan, world_mm: Floats, values: Floats) -> Floats:
    """Return values at places, NaN outside of the box of the scan; a rounding beyond its faces is inside."""
    place = scan.index_of(world_mm)
    inside = ((place >= -0.5 - _ROUNDING) & (place <= scan.counts_xyz - 0.5 + _ROUNDING)).all(axis=-1)
    return np.where(inside, values, np.nan)


def _through_boxes(shown: Sequence[WitnessedMedium], origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    """Return where rays enter the first and leave the last of the boxes that they meet."""
    ends = [_through_box(medium.scan, origins, directions) for medium in shown]
    enter = np.min([np.where(leave > enter, enter, np.inf) for enter, leave in ends], axis=0)
    leave = np.max([np.where(leave > enter, leave, -np.inf) for enter, leave in ends], axis=0)
    return enter, leave


def _through_box(scan: WitnessedScan, origins: Floats, directions: Floats) -> tuple[Floats, Floats]:
    inverse = np.linalg.inv(scan.world_from_index)
    start, per_mm = scan.index_of(origins), directions @ inverse[:3, :3].T
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(-0.5 - start) / per_mm, (scan.counts_xyz - 0.5 - start) / per_mm])
    inside = (start >= -0.5) & (start <= scan.counts_xyz - 0.5)
    level = np.abs(per_mm) < 1e-12
    low = np.where(level, np.where(inside, -np.inf, np.inf), ends.min(axis=0)).max(axis=1)
    high = np.where(level, np.inf, ends.max(axis=0)).min(axis=1)
    return np.maximum(low, 0.0), high


def _emission_absorption(samples: Samples) -> Floats:
    given: Any = 0.0
    extinction: Any = 0.0
    for number, values in enumerate(samples.values):
        colours, own = samples.colours(number, values)
        given = given + colours * own[..., None]
        extinction = extinction + (own if samples.shown[number].absorbs else 0.0)
    depth = extinction * samples.length_mm
    in_front = np.exp(-(np.cumsum(depth, axis=1) - depth))
    weight = in_front * -np.expm1(-depth)
    mixed = given / np.where(extinction > 0.0, extinction, 1.0)[..., None]
    return np.concatenate([(weight[..., None] * mixed).sum(axis=1), 1.0 - np.exp(-depth.sum(axis=1))[:, None]], axis=1)


def _of_value(shown: WitnessedMedium, values: Floats, seen: NDArray[np.bool_] | None = None) -> Floats:
    colours, extinctions = shown.at(values)
    opacity = -np.expm1(-extinctions * shown.reference_mm) * (1.0 if seen is None else seen)
    return np.concatenate([colours * opacity[:, None], opacity[:, None]], axis=1)


def _mida(samples: Samples) -> Floats:
    shown, values = samples.shown[0], samples.values[0]
    low, high = shown.intensities
    colours, extinctions = samples.colours(0, values)
    opacity = -np.expm1(-extinctions * samples.length_mm)
    intensity = np.clip((values - low) / (high - low), 0.0, 1.0)
    greatest = np.maximum.accumulate(np.concatenate([intensity[:, :1], intensity], axis=1), axis=1)
    kept = 1.0 - np.diff(greatest, axis=1)
    result = np.zeros((len(values), 4))
    for number in range(values.shape[1]):
        result *= kept[:, number, None]
        gain = (1.0 - result[:, 3]) * opacity[:, number]
        result += gain[:, None] * np.concatenate([colours[:, number], np.ones((len(gain), 1))], axis=1)
    return result


def _surface(samples: Samples, *, solid: bool) -> Floats:
    shown, values = samples.shown[0], samples.values[0]
    isovalue = shown.isovalue
    if isovalue is None:
        raise CannotWitnessError("a surface without an isovalue")
    above = values >= isovalue
    passes = above[:, 1:] != above[:, :-1]
    rows = np.arange(len(values))
    first = passes.argmax(axis=1)
    begins = above[:, 0] & solid
    before, after = values[rows, first], values[rows, np.minimum(first + 1, values.shape[1] - 1)]
    share = np.divide(isovalue - before, after - before, out=np.zeros(len(rows)), where=after != before)
    at = samples.world_mm[rows, first] + share[:, None] * samples.length_mm * samples.directions
    at[begins] = (samples.world_mm[:, 0] - 0.5 * samples.length_mm * samples.directions)[begins]
    value = np.where(begins, sampled(shown.scan, at, nearest=False), isovalue)
    result = _of_value(shown, value, passes.any(axis=1) | begins)
    light = samples.lights[0]
    if light is not None:
        colours = result[:, :3] / np.where(result[:, 3:] > 0.0, result[:, 3:], 1.0)
        lit = lit_colours(colours[:, None], light, shown.scan, at[:, None], samples.directions)[:, 0]
        result[:, :3] = lit * result[:, 3:]
    return result


_COMPOSITED: dict[str, Callable[[Samples], Floats]] = {
    "emission-absorption": _emission_absorption,
    "back-to-front": _emission_absorption,
    "maximum": lambda samples: _of_value(samples.shown[0], samples.values[0].max(axis=1)),
    "minimum": lambda samples: _of_value(samples.shown[0], samples.values[0].min(axis=1)),
    "average": lambda samples: _of_value(samples.shown[0], samples.values[0].mean(axis=1)),
    "mida": _mida,
    "isosurface": partial(_surface, solid=False),
    "first-hit": partial(_surface, solid=True),
}
