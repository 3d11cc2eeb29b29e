"""Pixels in colour as the channels of a colour volume: premultiplied linear light, and extinction.

Each pixel has a number from 0 to 1 that decides its share of the largest extinction. Channel "opacity" is that share;
"red", "green" and "blue" are linear light times the share, so that whatever mixes voxels mixes light by how much of it
is there (Wittenbrink, Malzbender and Goss 1998). Integers are sRGB (IEC 61966-2-1), floats linear light.
"""

from functools import cache
from pathlib import Path
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.source import ColourChannel, ColourPart, SourceInfo, StoredType
from volprep_formats.srgb import linear_of_srgb, srgb_of_linear

PARTS: tuple[ColourPart, ...] = get_args(ColourPart)
"""Channels of a volume in colour, in the order of the components of a texel."""
_COLOUR_TYPE: StoredType = "uint16"
"""Type of a channel: 65535 is 1."""
_WEIGHTS = (0.299, 0.587, 0.114)
_PIXELS_AT_ONCE = 2**16


def of_colour(info: SourceInfo) -> SourceInfo:
    """Return the description of a channel of a source in colour."""
    return info.model_copy(update={"stored_type": _COLOUR_TYPE, "slope": 1 / 65535, "intercept": 0.0})


def colour_remarks(wanted: ColourChannel, *, has_alpha: bool, is_linear: bool) -> list[str]:
    """Return the remark about pictures whose colours are kept, once: for the first channel."""
    if wanted.part not in {PARTS[0], "all"}:
        return []
    meaning = "linear light" if is_linear else "sRGB"
    alpha = " times alpha" if has_alpha and wanted.opacity_of != "alpha" else ""
    return [f"colours are read as {meaning}; extinction follows {wanted.opacity_of}{alpha}"]


def channel_of_colours(
    path: Path,
    wanted: ColourChannel,
    colours: NDArray[np.generic],
    alpha: NDArray[np.generic] | None,
    *,
    multiplied_by: NDArray[np.generic] | None = None,
) -> NDArray[np.generic]:
    """Return one channel [...] of pixels [..., 3] with an alpha [...] or without; all are packed, see `unpacked`.

    Integers are sRGB over the whole range of their type, floats linear light from 0 to 1. `multiplied_by` is the alpha
    that the stored colours are multiplied by, if they are. Raises VP1290 for other colours than three, for numbers
    outside of 0 to 1, and for an extinction from alpha without an alpha channel.
    """
    count = colours.shape[-1]
    if count != 3:
        raise VolprepError("VP1290", path=path, problem=f"it has {count} colour channel(s), and three are needed")
    if wanted.opacity_of == "alpha" and alpha is None:
        raise VolprepError("VP1290", path=path, problem="its pixels have no alpha, which extinction should follow")
    parts = PARTS if wanted.part == "all" else (wanted.part,)
    result = np.empty((*colours.shape[:-1], len(parts)), "<u2")
    flat, pixels = result.reshape(-1, len(parts)), colours.reshape(-1, 3)
    each = [None if plane is None else plane.reshape(-1) for plane in (alpha, multiplied_by)]
    # A part at a time: numbers of 64 bits take many times the memory of bytes.
    for first in range(0, len(flat), _PIXELS_AT_ONCE):
        part = slice(first, first + _PIXELS_AT_ONCE)
        opacity, premultiplied = (None if plane is None else _numbers(path, plane[part]) for plane in each)
        light, encoded = _light(path, pixels[part], premultiplied)
        share = _share(wanted, encoded, opacity)
        for channel, name in zip(flat[part].T, parts, strict=True):
            channel[...] = np.rint(65535 * (share if name == "opacity" else share * light[:, PARTS.index(name)]))
    return result.view("<u8" if len(parts) > 1 else "<u2")[..., 0].astype(wanted.dtype, copy=False)


def unpacked(values: NDArray[np.generic]) -> NDArray[np.uint16]:
    """Return the channels [..., 4] of values [...] that hold all of them."""
    return np.ascontiguousarray(values, "<u8")[..., None].view("<u2")


def _share(wanted: ColourChannel, encoded: Float64Array, alpha: Float64Array | None) -> Float64Array:
    """Return the share [n] of the largest extinction, from 0 to 1, of sRGB colours [n, 3]."""
    values, shares = zip(*wanted.shares, strict=True)
    share: Float64Array = np.interp(_number(wanted, encoded, alpha), values, shares)
    if alpha is not None and wanted.opacity_of != "alpha":
        share = share * alpha
    return share


def _number(wanted: ColourChannel, encoded: Float64Array, alpha: Float64Array | None) -> Float64Array:
    """Return the number [n] that extinction follows."""
    kind = wanted.opacity_of
    if kind == "alpha":
        assert alpha is not None  # noqa: S101 - checked before
        return alpha
    if kind == "luminance":
        return np.asarray(encoded @ np.array(_WEIGHTS))
    if kind == "background":
        return np.asarray(np.linalg.norm(encoded - np.array(wanted.background), axis=1) / np.sqrt(3.0))
    return np.asarray(encoded[:, PARTS.index(kind)])


def _light(path: Path, pixels: NDArray[np.generic], alpha: Float64Array | None) -> tuple[Float64Array, Float64Array]:
    """Return linear light and sRGB colours [n, 3] of stored ones, which `alpha` has multiplied unless it is None."""
    if pixels.dtype.kind != "f" and alpha is None:
        return _decoded(pixels.dtype.itemsize)[pixels], _numbers(path, pixels)
    stored = _numbers(path, pixels)
    if alpha is not None:
        stored = np.minimum(np.divide(stored, alpha[:, None], out=np.zeros_like(stored), where=alpha[:, None] > 0), 1.0)
    if pixels.dtype.kind == "f":
        return stored, srgb_of_linear(stored)
    return linear_of(stored), stored


def _numbers(path: Path, stored: NDArray[np.generic]) -> Float64Array:
    """Return stored values as numbers from 0 to 1."""
    if stored.dtype.kind == "u":
        return np.asarray(stored.astype(np.float64) / (256**stored.dtype.itemsize - 1))
    numbers = stored.astype(np.float64)
    if not ((numbers >= 0.0) & (numbers <= 1.0)).all():
        raise VolprepError("VP1290", path=path, problem="a pixel has a number outside of 0 to 1, or NaN")
    return numbers


def linear_of(encoded: Float64Array) -> Float64Array:
    """Decode sRGB numbers from 0 to 1 to linear light."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


@cache
def _decoded(itemsize: int) -> Float64Array:
    """Return the linear light of each integer of a type."""
    largest = 256**itemsize - 1
    return np.array([linear_of_srgb(code / largest) for code in range(largest + 1)])
