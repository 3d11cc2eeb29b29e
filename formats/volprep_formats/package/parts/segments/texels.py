"""Texels of segments: labels with a flag for each voxel, and the table of looks."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from volprep_formats.arrays import Float64Array, UInt8Array
from volprep_formats.package.parts.segments.record import LARGEST_SMALL_LABEL, table_shape
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2
from volprep_formats.textures.mosaic import slices_of_mosaic
from volprep_formats.textures.texel_formats import LookupFormat

FLAG_BITS = {False: 7, True: 15}
"""Place of the flag, by whether labels have two bytes."""


def flagged(labels: NDArray[np.uint16], following: NDArray[np.uint16] | None) -> NDArray[np.bool_]:
    """Return which voxels [z, y, x] begin a cell with several labels.

    A cell reaches to the next voxel along each axis; behind the last one the edge is repeated. `following` is the
    slice [y, x] behind the last one, None at the end of the volume.
    """
    last = labels[-1:] if following is None else following[None]
    behind = np.concatenate([labels, last])
    low, high = behind[:-1], behind[1:]
    least, most = np.minimum(low, high), np.maximum(low, high)
    for axis in (1, 2):
        least = np.minimum(least, _next(least, axis))
        most = np.maximum(most, _next(most, axis))
    several: NDArray[np.bool_] = least != most
    return several


def _next(array: NDArray[np.uint16], axis: int) -> NDArray[np.uint16]:
    moved = np.roll(array, -1, axis)
    last = [slice(None)] * array.ndim
    last[axis] = slice(-1, None)
    moved[tuple(last)] = array[tuple(last)]
    return moved


def label_texels(labels: NDArray[np.uint16], flags: NDArray[np.bool_], *, wide: bool) -> UInt8Array:
    """Return texels [z, y, x], or [z, y, x, 2] with the low byte first if labels are `wide`."""
    codes = labels | (flags.astype(np.uint16) << FLAG_BITS[wide])
    if not wide:
        return codes.astype(np.uint8)
    return np.ascontiguousarray(codes.astype("<u2")).view(np.uint8).reshape(*codes.shape, 2)


def labels_of_texels(texels: UInt8Array) -> NDArray[np.uint16]:
    """Return the labels [z, y, x] of texels, without their flags."""
    if texels.ndim == 3:
        return (texels & LARGEST_SMALL_LABEL).astype(np.uint16)
    codes = np.ascontiguousarray(texels).view("<u2")[..., 0]
    labels: NDArray[np.uint16] = codes & np.uint16(2 ** FLAG_BITS[True] - 1)
    return labels


def held_labels(textures: Sequence[Texture], level: int, read: Callable[[str], bytes]) -> NDArray[np.uint16]:
    """Return the labels [z, y, x] of a level, as its texture or the textures of its mosaic hold them.

    `read` gives the bytes of a file.
    """
    parts = sorted(
        (texture for texture in textures if (texture.role, texture.level) == ("labels", level)),
        key=lambda texture: texture.part,
    )
    texels = [np.asarray(ktx2.decode(read(part.file), part.file).data, np.uint8) for part in parts]
    mosaic = parts[0].mosaic
    if mosaic is None:
        return labels_of_texels(texels[0])
    return labels_of_texels(np.asarray(slices_of_mosaic([texel[0] for texel in texels], mosaic), np.uint8))


def look_texels(looks: Sequence[tuple[float, float, float, float]], texel_format: LookupFormat) -> NDArray[np.generic]:
    """Return the table of looks [1, rows, columns, 4]: square roots of tints and opacity factors."""
    rows, columns = table_shape(len(looks))
    roots = np.zeros((rows * columns, 4))
    roots[: len(looks)] = np.sqrt(looks)
    texels = roots.astype("<f2") if texel_format == "rgba16float" else np.rint(roots * 255).astype(np.uint8)
    return texels.reshape(1, rows, columns, 4)


def visible_labels(looks: Sequence[tuple[float, float, float, float]], texel_format: LookupFormat) -> NDArray[np.bool_]:
    """Return for each label whether it is visible: an opacity factor that the table of looks rounds to 0 is not."""
    opacity = looks_of_texels(look_texels(looks, texel_format))[: len(looks), 3]
    return np.asarray(opacity > 0, np.bool_)


def looks_of_texels(texels: NDArray[np.generic]) -> Float64Array:
    """Return linear tint and opacity factor of each label [label, 4]."""
    roots = texels.reshape(-1, 4).astype(np.float64)
    found: Float64Array = (roots / (255.0 if texels.dtype == np.uint8 else 1.0)) ** 2
    return found
