"""Compare the data of a package with NumPy's results from the scan: codes, levels, tables, normals."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.validation.subjects.subject import Subject
from volprep.validation.witness.check import WitnessCheck
from volprep.validation.witness.independent.colours import encoded_light
from volprep.validation.witness.independent.normals import normals
from volprep.validation.witness.independent.package import Json, read_texture, world_from_index
from volprep.validation.witness.independent.scan import CannotWitnessError, Floats, WitnessedScan
from volprep.validation.witness.read_checks import NUMPY

_MOST_VOXELS = 2**24
"""Voxels of level 0 that levels are compared on; of a larger scan, so many in its middle slices."""
_EXTREMES = {"maximum": np.max, "minimum": np.min}
_UNLIKE_MEANS = frozenset(("nearest", "mode", "mode-foreground", "raised"))
_STEP_OF_LIGHT = 1 / 255 + 12.92 / 65535
"""Of sRGB in 8 bits, after channels of 16 bits: where sRGB is steepest, it makes 12.92 steps of one of linear light."""
_SHIFT_VOXELS = 0.15
_LEAST_VOXELS = 50
"""Fewer voxels say nothing of a shift."""
_ANGLE_DEG = 5.0
_LEAST_NORMAL = 2.0**-14
"""Half floats below this have one distance."""


def on_level_0(scan: WitnessedScan, grid: Json, window: tuple[float, float], factor: int) -> tuple[Floats, int]:
    """Return physical values within `window` on the grid of level 0, and the number of the first slice of them.

    Some middle slices if there are many voxels; the first is a multiple of `factor`.
    """
    between = np.rint(np.linalg.inv(scan.world_from_index) @ world_from_index(grid)).astype(np.intp)
    depth, rows, columns = grid["shape_zyx"]
    slices = min(depth, max(factor, _MOST_VOXELS // (rows * columns) // factor * factor))
    first = (depth - slices) // 2 // factor * factor
    ranges = (np.arange(columns), np.arange(rows), np.arange(first, min(first + slices, depth)))
    places: list[NDArray[np.intp]] = []
    order = np.abs(between[:3, :3]).argmax(axis=1)
    for axis in range(3):
        along = int(order[axis])
        places.append(between[axis, along] * ranges[along] + between[axis, 3])
    for axis, place in enumerate(places):
        if place.min() < 0 or place.max() >= scan.counts_xyz[axis]:
            raise CannotWitnessError("level 0 reaches beyond the scan")
    part = scan.stored[np.ix_(places[2], places[1], places[0])]
    turned = part.transpose(*(2 - np.abs(between[:3, :3]).argmax(axis=0)[::-1]))
    return np.clip(scan.physical(turned), *window), first


def check_levels(
    subject: Subject,
    channel: Json,
    scan: WitnessedScan,
    functions: Sequence[tuple[Floats, Floats]],
    *,
    is_light: bool = False,
) -> Iterator[WitnessCheck]:
    """Compare the codes of level 0, and each coarser level, with the scan.

    `functions` are the values and extinctions of the points of transfer functions: voxels far from all that they show
    may have another hidden value. Texels of `is_light`, red, green or blue of a volume in colour, are sRGB.
    """
    name, quantization, levels = channel["name"], channel["quantization"], channel["levels"]
    low, high = (float(value) for value in quantization["window"])
    step = (high - low) / (2.0 ** int(quantization["bits"]) - 1.0)
    textures = subject.package.manifest.textures
    if any(texture.encoder is not None for texture in textures):
        raise CannotWitnessError("levels are compressed: pictures witness them")
    if any(texture.bricks is not None for texture in textures):
        raise CannotWitnessError("levels are bricks without what cannot be seen: pictures witness them")
    volumes = subject.package.manifest.textures_of("volume")
    if is_light and not all(volume.format.endswith("srgb") for volume in volumes):
        raise CannotWitnessError("its light is not stored as sRGB: pictures witness it")
    for level in levels:
        factors = tuple(level["factors_zyx"])
        yield _check_place(name, level, levels[0])
        fine, first = on_level_0(scan, levels[0]["grid"], (low, high), factors[0])
        volume = subject.level(int(level["index"]))
        slices = -(-len(fine) // factors[0])
        held = volume.slope * volume.stored[first // factors[0] :][:slices].astype(np.float64) + volume.intercept
        blocks = _blocks(fine, factors)
        if is_light and factors == (1, 1, 1):
            held, blocks, step = encoded_light(held), encoded_light(blocks), _STEP_OF_LIGHT
        found = _check_values(f"level {level['index']} of {name}", level, held, blocks)
        if found is not None:
            apart = step + (_half_float_steps(held, (low, high)) if _is_half_float(subject, level) else 0.0)
            yield found(apart, _near_seen(fine, factors, functions))


def _check_values(
    item: str, level: Json, held: Floats, blocks: Floats
) -> Callable[[Floats | float, NDArray[np.bool_]], WitnessCheck] | None:
    """Return the comparison of the values of a level with its blocks; it takes the steps of codes, and a mask."""
    if blocks.shape[1::2] == (1, 1, 1):
        return partial(_close, item, "a code from its value, in steps of codes", held - blocks[:, 0, :, 0, :, 0])
    if (name := level["filter"]) in _EXTREMES:
        extremes = _EXTREMES[name](blocks, axis=(1, 3, 5))
        return partial(_close, item, f"a value from the {name} of its block, in steps of codes", held - extremes)
    if name in _UNLIKE_MEANS:
        return None
    return partial(_beside, item, held, blocks.mean(axis=(1, 3, 5)))


def _near_seen(fine: Floats, factors: tuple[int, ...], functions: Sequence[tuple[Floats, Floats]]) -> NDArray[np.bool_]:
    """Return the voxels of a level whose blocks, or the neighbours of these, have a visible voxel of level 0."""
    blocks = _blocks(fine, factors)
    seen = np.full(blocks.shape[::2], not functions)
    for values, extinctions in functions:
        seen |= (np.interp(blocks, values, extinctions) > 0.0).any(axis=(1, 3, 5))
    for axis in range(3):
        count: int = seen.shape[axis]
        wider = np.pad(seen, [(int(dimension == axis),) * 2 for dimension in range(3)])
        seen = np.logical_or.reduce([wider.take(range(k, k + count), axis) for k in range(3)])
    return seen


def _is_half_float(subject: Subject, level: Json) -> bool:
    textures = subject.package.manifest.textures_of("volume", level=int(level["index"]))
    return any(texture.format == "r16float" for texture in textures)


def _half_float_steps(held: Floats, window: tuple[float, float]) -> Floats:
    """Return the distance of half floats near each value, where they hold 0 to 1 for the window: 11 bits."""
    low, high = window
    share = np.maximum((held - low) / (high - low), _LEAST_NORMAL)
    steps: Floats = 2.0 ** (np.floor(np.log2(share)) - 10.0) * (high - low)
    return steps


def _close(item: str, what: str, difference: Floats, step: Floats | float, seen: NDArray[np.bool_]) -> WitnessCheck:
    found = np.abs(difference / step)[seen].max(initial=0.0)
    return WitnessCheck(item=item, by=NUMPY, what=f"largest distance of {what}", found=float(found), limit=0.5 + 1e-3)


def _beside(item: str, held: Floats, mean: Floats, _step: Floats | float, seen: NDArray[np.bool_]) -> WitnessCheck:
    what = "shift of the level from the box mean, in its voxels"
    return WitnessCheck(item=item, by=NUMPY, what=what, found=_shift(held, mean, seen), limit=_SHIFT_VOXELS)


def _check_place(name: str, level: Json, finest: Json) -> WitnessCheck:
    """Compare the position of a level with that of its blocks."""
    fine, coarse = world_from_index(finest["grid"]), world_from_index(level["grid"])
    factors = np.array(level["factors_zyx"][::-1], dtype=np.float64)
    expected = fine.copy()
    expected[:3, :3] = fine[:3, :3] * factors
    expected[:3, 3] = fine[:3, 3] + fine[:3, :3] @ ((factors - 1.0) / 2.0)
    size = np.linalg.norm(expected[:3, :3], axis=0).min()
    counts = -(-np.array(finest["grid"]["shape_zyx"]) // np.array(level["factors_zyx"]))
    right = counts.tolist() == list(level["grid"]["shape_zyx"])
    return WitnessCheck(
        item=f"grid of level {level['index']} of {name}",
        by=NUMPY,
        what="largest difference of its matrix, in its voxels" if right else f"not {counts.tolist()} voxels",
        found=float(np.abs(coarse - expected).max() / size) if right else float("1e9"),
        limit=1e-6,
    )


def _blocks(fine: Floats, factors: tuple[int, ...]) -> Floats:
    """Return [z, fz, y, fy, x, fx]: each block of a level; edges are repeated."""
    padded = np.pad(fine, [(0, -n % f) for n, f in zip(fine.shape, factors, strict=True)], mode="edge")
    shape = [length for n, f in zip(padded.shape, factors, strict=True) for length in (n // f, f)]
    return padded.reshape(shape)


def _shift(held: Floats, mean: Floats, seen: NDArray[np.bool_]) -> float:
    """Return the longest shift along an axis that makes the level most like the mean, to first order, in voxels.

    Voxels outside of the mask `seen` do not count.
    """
    longest = 0.0
    inner = np.zeros(mean.shape, np.bool_)
    inner[tuple(slice(1, -1) if n > 4 else slice(None) for n in mean.shape)] = True
    inner &= seen
    slopes = [
        np.gradient(mean, axis=axis)[inner] if mean.shape[axis] > 4 else np.zeros(int(inner.sum())) for axis in range(3)
    ]
    if inner.sum() <= _LEAST_VOXELS:
        return 0.0
    matrix = np.stack([*slopes, mean[inner], np.ones(int(inner.sum()))], axis=1)
    found, *_ = np.linalg.lstsq(matrix, held[inner], rcond=None)
    gain = found[3] if found[3] > 0.1 else 1.0
    for axis in range(3):
        if slopes[axis].any():
            longest = max(longest, abs(float(found[axis] / gain)))
    return longest


def check_table(
    path: Path, texture: Json, window: tuple[float, float], points: tuple[Floats, Floats, Floats]
) -> WitnessCheck:
    """Compare the entries of a lookup table with the function; entry j of n is at j / (n - 1) of the window."""
    values, colours, extinctions = points
    texels = read_texture(path, texture["file"])[0, 0].astype(np.float64)
    largest = texture.get("max_extinction_per_mm")
    at = np.linspace(*window, len(texels))
    expected = np.column_stack([np.interp(at, values, column) for column in (*colours.T, extinctions)])
    step = at[1] - at[0]
    jumps = values[1:][np.diff(values) == 0.0]
    kept = np.abs(at[:, None] - jumps).min(axis=1, initial=np.inf) > step
    if largest is None:
        scale = np.maximum(np.abs(expected), 2.0**-14)
        # Half floats have 11 bits; larger extinctions are clamped.
        difference = np.abs(texels - np.minimum(expected, 65504.0)) / scale * 2.0**11
    else:
        root = np.sqrt(np.minimum(expected[:, 3], largest) / largest)
        difference = np.abs(texels / 255.0 - np.column_stack([expected[:, :3], root])) * 255.0
    return WitnessCheck(
        item=f"lookup table {texture['name']}",
        by=NUMPY,
        what="largest distance of an entry from the function, in steps of its format",
        found=float(difference[kept].max()),
        limit=0.5 + 1e-3 if largest is not None else 1.0,
    )


def check_normals(path: Path, texture: Json, fine: WitnessedScan, step: float) -> WitnessCheck:
    """Compare normals of level 0 with gradients of the scan, where these are steep."""
    meaning = texture["normals"]
    if texture.get("mosaic") or meaning["code"] != "biased8":
        raise CannotWitnessError(f"{texture['name']} is a mosaic, or has another code than biased8")
    texels = read_texture(path, texture["file"])[..., :3].astype(np.float64)
    held = texels / 127.5 - 1.0
    expected = normals(fine, meaning["kernel"]).astype(np.float64)
    slopes = np.sqrt(sum(np.gradient(fine.stored, axis=axis) ** 2 for axis in range(3) if fine.stored.shape[axis] > 1))
    steep = slopes > max(np.quantile(slopes, 0.8), 4.0 * step)
    if not steep.any():
        raise CannotWitnessError("nothing in the scan is steep")
    length = np.linalg.norm(held[steep], axis=-1) * np.linalg.norm(expected[steep], axis=-1)
    cosine = np.abs((held[steep] * expected[steep]).sum(axis=-1)) / np.maximum(length, 1e-9)
    return WitnessCheck(
        item=f"normals {texture['name']}",
        by=NUMPY,
        what="mean angle between normals where the scan is steep, in degrees",
        found=float(np.degrees(np.arccos(np.clip(cosine, 0.0, 1.0))).mean()),
        limit=_ANGLE_DEG,
    )


def as_scan(values: NDArray[Any], grid: Json, library: str) -> WitnessedScan:
    """Return physical values on a grid record as a scan."""
    return WitnessedScan(values, 1.0, 0.0, world_from_index(grid), library)
