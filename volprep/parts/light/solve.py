"""Fit a coarse field of light to estimates of the light where pictures need it.

Rays from everywhere outside are followed to where the volume stops them, so that places are as frequent as pictures
show them, and random paths from each place estimate the light there (native/src/light_samples.cpp). The field is the
one that comes nearest to these estimates in the sense of least squares (native/src/light_sums.cpp, light_solve.cpp).
So values of the field are those for which *pictures* are right, also where a wall is thinner than a cell of the field.
Every eighth place is anywhere inside, with little weight: cuts show these.

Scattered light takes three rounds. Whole paths from places that light seen places give a rough field. Paths from such
places that end at the rough field after some bounces give a draft, and paths from seen places that end at the draft
give the result. Errors of the field where paths end are errors of the result, and more places do not remove them. About
half of the paths leave at each bounce, so that more bounces cost little: on an engine of 64×128×128 voxels that is
opaque within half a voxel, with a million places, pictures came within 32.5 dB of path tracing after three bounces,
33.2 dB after six in 1.15 times the time, and 33.4 dB after eight in 1.3 times the time.

The outer nodes of the field lie on the faces of the box. Where a face cuts a body, values do not change with depth, and
the field has to: on that engine this gained 1.0 dB at half of the resolution, 1.5 dB at a quarter.

The field is fitted from coarse to fine: a grid of four times the cell first, then twice, then the one that is wanted.
Each begins with what the coarser one has found, and only its difference from that is smoothed. So large bright and dark
parts, which many samples tell, cost no smoothness, and noise of the few samples of a small cell does not enter. On a
head of 90×108×90 voxels with ten samples for each node this gained 1.0 dB beside the best single smoothness. With so
little noise much less smoothness is best than with paths: on 64³ voxels of a head, 1/16 of a sample for each node had
an RMSE of 0.043 at seen places, and 4 had 0.051; paths needed four times the places for 0.043.

The light at a place is first + share · second, both trilinear. `share` is a function of the value at the place: it
rises from 0 to 1 over the values of most places that are seen. At a steep wall it says how deep in the wall a place is.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from volprep.kernels import _native
from volprep.parts.light.kept import Arrays, KeptSamples
from volprep.truth.path_traced import LitVolume
from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.progress import Progress

BATCH = 1 << 18
"""Samples that are made at a time."""
_FEWEST = 1 << 15
"""Fewest samples of a field: a small scan needs a second for them."""
_SEED = 28
_INNER_EACH = 8
_INNER_WEIGHT = 0.05
_HELD_OUT_EACH = 16
"""One sample in so many is kept out of the fit, to choose how smooth the field is."""
_RARELY_SEEN = 0.05
"""Part of the seen places with values below those over which the share rises, and part with values above."""
_SMOOTH = (1 / 16, 0.5, 4.0, 32.0, 256.0)
"""Weights of smoothness in samples for each node; each grid tries them until one is worse than the one before."""
_COARSER = (4, 2, 1)
"""Cells of the grids, in cells of the one that is wanted."""
_PATHS_EACH, _DRAFT_EACH = 8, 4
"""One sample in so many is a whole path, and one in so many fits the draft that the other paths end at."""
_RAYS = 8
"""Paths from each place, one into each octant."""
_BOUNCES = 8
"""How often a path is stopped before it ends at the draft."""
_NOTHING = (np.zeros((1, 1, 1, 2, 1), np.float32), np.array([[0.0, 1.0], [0.0, 1.0]]), (1.0, 1.0, 1.0))
_TOLERANCE = 1e-2
"""Share of the residual that may be left. Less gains nothing: 30.8 dB with it and 30.7 with 1e-4, on an engine that is
opaque within half a voxel, with half a million places. On a head of 256³ voxels 1e-4 took 127 of 174 processor s."""
_MOST_STEPS = 200


@dataclass(frozen=True)
class LightField:
    """Light on a coarse grid."""

    texels: Float32Array
    """[z, y, x, 2, channels]: the two numbers of each node; 1 or 3 channels."""
    curve: Float64Array
    """[2, n]: ascending physical values, and the share of the second number at each."""
    nodes_per_mm_xyz: tuple[float, float, float]
    """Nodes for each millimetre; node k lies at k / this in box space: the outer nodes lie on the faces of the box."""
    samples: int
    """Places that the field was fitted to."""
    smoothness: float
    """Weight of smoothness that was chosen."""
    residual: float
    """Part of the equations' right side that the solution leaves."""
    hues: Float64Array | None = None
    """[3, 3], of light in colour: mean products of what red, green and blue have beyond their mean at seen places."""

    def at(self, places_mm_xyz: Float64Array, values: Float64Array) -> Float64Array:
        """Return the light [n, channels] at places [n, 3] in box space that have physical values [n]."""
        sums = np.zeros((len(values), *self.texels.shape[3:]))
        for nodes, weights in _corners(places_mm_xyz, self.texels.shape[:3], self.nodes_per_mm_xyz):
            sums += weights[:, None, None] * self.texels.reshape(-1, *self.texels.shape[3:])[nodes]
        share = np.interp(values, *self.curve)
        light: Float64Array = np.maximum(sums[:, 0] + share[:, None] * sums[:, 1], 0.0)
        return light


class _Samples(NamedTuple):
    places: Float32Array  # [n, 4]
    light: Float32Array  # [n, 3]
    weights: Float32Array  # [n]
    held_out: Float32Array  # [n]: 1 where a sample is kept out of the fit


def solve_field(
    lit: LitVolume,
    factor: int,
    count: int,
    progress: Progress,
    kept: KeptSamples | None = None,
    *,
    curve: Float64Array | None = None,
) -> LightField:
    """Fit a field with a node for each `factor`³ voxels to about `count` samples.

    The result is the same on any number of threads, and with samples that were `kept`. It is 0 everywhere if nothing is
    seen. With a `curve` [2, n] the share has these values; otherwise it follows from the samples.
    """
    return solve_fields(lit, [factor * value for value in _COARSER], count, progress, kept, curve=curve)[-1]


def solve_fields(
    lit: LitVolume,
    factors: Sequence[int],
    count: int,
    progress: Progress,
    kept: KeptSamples | None = None,
    *,
    curve: Float64Array | None = None,
) -> list[LightField]:
    """Fit a field for each of `factors`, which halve from one to the next, to the same samples.

    Each field begins with the one before it. Other arguments as `solve_field`.
    """
    samples = partial(_samples, lit, kept)
    if lit.model.kind == "shadow":
        return _fields(lit, partial(samples, _Gather()), factors, count, progress, curve=curve)
    if lit.model.kind == "occlusion":
        nothing = LightField(*_NOTHING, samples=0, smoothness=0.0, residual=0.0)
        return _fields(lit, partial(samples, _Gather(nothing)), factors, count, progress, curve=curve)
    lighting = _Gather(lighting=True)
    # Whole paths are too few, and too noisy, for the finest grid.
    coarse = factors[:-1] or factors
    rough = _fields(lit, partial(samples, lighting), coarse, -(-count // _PATHS_EACH), progress)[-1]
    lighting = _Gather(rough, lighting=True)
    draft = _fields(lit, partial(samples, lighting), factors, -(-count // _DRAFT_EACH), progress)[-1]
    return _fields(lit, partial(samples, _Gather(draft)), factors, count, progress, curve=curve)


def _fields(
    lit: LitVolume,
    samples: "Callable[[int, int], _Samples]",
    factors: Sequence[int],
    count: int,
    progress: Progress,
    *,
    curve: Float64Array | None = None,
) -> list[LightField]:
    """Fit fields to batches of samples, each by its number."""
    batches = max(1, -(-count // BATCH))
    size = min(BATCH, max(count, _FEWEST))
    progress.start("light", batches + len(factors))
    first = samples(0, size)
    curve = _curve(first) if curve is None else curve
    grids = [_Sums(_node_grid(lit, factor), curve, first) for factor in factors]
    tests: list[_Samples] = []
    used = 0
    for batch in range(batches):
        found = first if batch == 0 else samples(batch, size)
        used += int(np.count_nonzero(found.weights))
        for sums in grids:
            sums.add(found)
        tests.append(_only_held_out(found))
        progress.advance()
    channels = 3 if lit.model.channels == "rgb" else 1
    fields: list[LightField] = []
    for sums in grids:
        start = sums.grid.finer(fields[-1].texels) if fields else sums.grid.dark(channels)
        fields.append(_best(sums, start, tests, used, fields[-1].smoothness if fields else _SMOOTH[0]))
        progress.advance()
    if channels > 1 and not lit.model.turnable:
        fields = [replace(field, hues=_hues(field, tests)) for field in fields]
    return fields


def _best(sums: "_Sums", start: Float32Array, tests: list[_Samples], used: int, begin: float) -> LightField:
    """Return the solution with the smoothness that suits samples that were kept out of the fit.

    The search starts at the smoothness `begin`.
    """

    def fitted(smooth: float) -> tuple[float, LightField]:
        texels, residual = sums.solved(smooth, start, _TOLERANCE)
        field = LightField(texels, sums.curve, sums.grid.nodes_per_mm_xyz, used, smooth, residual)
        return _held_out_error(field, tests), field

    middle = _SMOOTH.index(begin)
    best = fitted(begin)
    for others in (_SMOOTH[middle + 1 :], _SMOOTH[:middle][::-1]):
        for smooth in others:
            other = fitted(smooth)
            if other[0] >= best[0]:
                break
            best = other
        if best[1].smoothness > begin:
            break
    return best[1]


def _node_grid(lit: LitVolume, factor: int) -> "_NodeGrid":
    z, y, x = (-(-n // factor) for n in lit.grid.shape_zyx)
    per_z, per_y, per_x = ((n - 1) / mm for n, mm in zip((z, y, x), lit.grid.extent_mm_zyx, strict=True))
    return _NodeGrid((z, y, x), (per_x, per_y, per_z))


class _NodeGrid(NamedTuple):
    shape_zyx: tuple[int, int, int]
    nodes_per_mm_xyz: tuple[float, float, float]

    def dark(self, channels: int) -> Float32Array:
        """Return texels of no light."""
        return np.zeros((*self.shape_zyx, 2, channels), np.float32)

    def finer(self, texels: Float32Array) -> Float32Array:
        """Return this grid's texels of a field on a coarser grid."""
        for axis, count in enumerate(self.shape_zyx):
            last = texels.shape[axis] - 1
            at = np.linspace(0.0, last, count)
            low = at.astype(np.intp)
            share = (at - low).astype(np.float32).reshape([-1 if index == axis else 1 for index in range(5)])
            below, above = texels.take(low, axis), texels.take(np.minimum(low + 1, last), axis)
            texels = below + share * (above - below)
        return texels


class _Gather(NamedTuple):
    """How the light at a place is estimated, and where the places are."""

    known: LightField | None = None
    """Light where paths end; None: they go on until they leave."""
    lighting: bool = False
    """Whether places are those where light toward seen places was last stopped, instead of seen ones."""

    def native(self) -> dict[str, Any]:
        """Return the arguments of the native kernel for one batch."""
        known = self.known
        if known is None:
            return {"seed": _SEED + self.lighting, "paths": 1, "lighting": self.lighting}
        return {
            "seed": _SEED + 2 * self.lighting,
            "paths": _RAYS,
            "lighting": self.lighting,
            "bounces": _BOUNCES,
            "known": known.texels,
            "known_curve": known.curve,
            "known_per_mm_xyz": known.nodes_per_mm_xyz,
        }


def _samples(lit: LitVolume, kept: KeptSamples | None, gather: _Gather, batch: int, size: int) -> _Samples:
    places, light = np.empty((size, 4), np.float32), np.empty((size, 3), np.float32)
    kinds: UInt8Array = np.empty(size, np.uint8)
    made: Arrays = {"places": places, "light": light, "kinds": kinds}
    arguments = {**lit.native(), "first": batch * BATCH, **gather.native(), "inner_each": _INNER_EACH}
    if kept is None or not kept.find(arguments, made):
        _native.light_samples(**arguments, **made)
        if kept is not None:
            kept.keep(arguments, made)
    held_out = (np.arange(size) % _HELD_OUT_EACH == 1) & (kinds == 1)
    weights = np.select([held_out, kinds == 1, kinds == 2], [0.0, 1.0, _INNER_WEIGHT], 0.0)
    return _Samples(places, light, weights.astype(np.float32), held_out.astype(np.float32))


def _only_held_out(samples: _Samples) -> _Samples:
    chosen = samples.held_out > 0
    return _Samples(*(part[chosen] for part in samples))


def _curve(samples: _Samples) -> Float64Array:
    """Return the share over values: it rises from 0 to 1 over the values of most seen places."""
    seen = samples.places[samples.weights == 1.0, 3].astype(np.float64)
    if len(seen) == 0:
        return np.array([[0.0, 1.0], [0.0, 1.0]])
    low, high = np.quantile(seen, [_RARELY_SEEN, 1.0 - _RARELY_SEEN])
    # Where all seen places have one value, the share is 0 there.
    above = high if high > low else low + max(abs(low), 1.0)
    return np.array([[low, above], [0.0, 1.0]])


def _held_out_error(field: LightField, tests: list[_Samples]) -> float:
    """Return the mean square of what the field is off by at samples that it was not fitted to, their noise included."""
    squares, count = 0.0, 0
    channels = field.texels.shape[4]
    for test in tests:
        light = field.at(test.places[:, :3].astype(np.float64), test.places[:, 3].astype(np.float64))
        squares += float(np.sum((light - test.light[:, :channels]) ** 2))
        count += light.size
    return squares / max(count, 1)


def _hues(field: LightField, tests: list[_Samples]) -> Float64Array:
    """Return how colours of a field vary at places that it was not fitted to."""
    places = np.concatenate([test.places for test in tests]).astype(np.float64)
    light = field.at(places[:, :3], places[:, 3])
    beyond = light - light.mean(axis=1, keepdims=True)
    hues: Float64Array = beyond.T @ beyond / max(len(beyond), 1)
    return hues


class _Sums:
    """The equations of a field, which samples are added to."""

    def __init__(self, grid: _NodeGrid, curve: Float64Array, first: _Samples) -> None:
        self.grid, self.curve = grid, curve
        seen = np.zeros(int(np.prod(grid.shape_zyx)), bool)
        chosen = first.weights == 1.0
        for nodes, _ in _corners(first.places[chosen, :3].astype(np.float64), *grid):
            seen[nodes] = True
        active = _dilated(seen.reshape(grid.shape_zyx))
        self._rows = np.where(active, np.cumsum(active).reshape(grid.shape_zyx) - 1, -1).astype(np.int32)
        rows = int(active.sum())
        self._pairs = np.zeros((rows, 14, 3), np.float32)
        self._light = np.zeros((rows, 2, 3), np.float32)
        self._inner = np.zeros((seen.size, 4), np.float32)

    def add(self, samples: _Samples) -> None:
        """Add the samples that have a weight."""
        per_mm = self.grid.nodes_per_mm_xyz
        _native.add_light_samples(self._rows, per_mm, *samples[:3], self.curve, self._pairs, self._light)
        inner = (samples.weights > 0.0) & (samples.weights < 1.0)
        light = np.column_stack([samples.light[inner], np.ones(int(inner.sum()), np.float32)])
        for nodes, weights in _corners(samples.places[inner, :3].astype(np.float64), *self.grid):
            np.add.at(self._inner, nodes, weights[:, None].astype(np.float32) * light)

    def solved(self, smooth: float, start: Float32Array, tolerance: float) -> tuple[Float32Array, float]:
        """Return the two numbers of each node [z, y, x, 2, channels], and the share of the residual that is left.

        The solution is good enough where the share is `tolerance`.

        Only the difference from `start` is smoothed. Nodes that nothing seen lies at have the mean light inside, or
        that of `start`.
        """
        texels = start.copy()
        inner = self._inner[:, 3].reshape(self.grid.shape_zyx) > 0
        texels[inner] = 0.0
        texels[inner, 0] = (self._inner[:, :3] / np.maximum(self._inner[:, 3:], 1e-30)).reshape(*inner.shape, 3)[
            inner, : start.shape[4]
        ]
        active = self._rows >= 0
        left = 0.0
        for channel in range(start.shape[4]):
            field = np.ascontiguousarray(start[active, :, channel], np.float64)
            residual = _native.solve_light(
                rows=self._rows,
                pairs=self._pairs,
                sums=self._light,
                channel=channel,
                smooth_first=smooth,
                smooth_second=smooth,
                small_second=0.1 * smooth,
                tolerance=tolerance,
                most=_MOST_STEPS,
                field=field,
            )
            left = max(left, residual)
            texels[active, :, channel] = field
        return texels, left


def _corners(
    places_mm_xyz: Float64Array, shape_zyx: tuple[int, ...], nodes_per_mm_xyz: tuple[float, float, float]
) -> Iterator[tuple[np.ndarray[tuple[int], np.dtype[np.intp]], Float64Array]]:
    """Return index and weight of each of the eight nodes around places."""
    last_xyz = np.array(shape_zyx[::-1]) - 1
    at = np.clip(places_mm_xyz * nodes_per_mm_xyz, 0.0, last_xyz)
    low = np.minimum(at.astype(np.intp), np.maximum(last_xyz - 1, 0))
    share = at - low
    for corner in range(8):
        upper = np.array([corner & 1, corner >> 1 & 1, corner >> 2 & 1])
        x, y, z = np.minimum(low + upper, last_xyz).T
        weights = np.prod(np.where(upper, share, 1.0 - share), axis=1)
        yield (z * shape_zyx[1] + y) * shape_zyx[2] + x, weights


def _dilated(mask: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Add the neighbours along each axis, one after the other, so that corners count."""
    found = mask.copy()
    for axis in range(3):
        grown = found.copy()
        ahead = [slice(None)] * 3
        behind = [slice(None)] * 3
        ahead[axis], behind[axis] = slice(1, None), slice(None, -1)
        grown[tuple(ahead)] |= found[tuple(behind)]
        grown[tuple(behind)] |= found[tuple(ahead)]
        found = grown
    return found
