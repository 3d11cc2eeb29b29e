"""Decode the bytes of normals as shaders do, in NumPy.

Codes of two numbers are the octahedron unfolded into a square (Meyer et al. 2010, Cigolle et al. 2014). Byte 0 of them
is free for "no gradient", because a number from -1 to 1 is encoded as 1 to 255.
"""

import numpy as np

from volprep_formats.arrays import Float32Array, Float64Array, UInt8Array
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES, NormalCode


def interpolated(octets: UInt8Array, code: NormalCode) -> Float32Array:
    """Return the vectors [..., 3] of codes [..., bytes] as a filter mixes them, where it may: about 1 long."""
    if code == "biased8":
        return ((octets[..., :3].astype(np.float32) - 128) / np.float32(127)).astype(np.float32)
    if code == "snorm8":
        return octets[..., :3].view(np.int8).astype(np.float32) / np.float32(127)
    return decoded(octets, code).astype(np.float32)


def decoded(octets: UInt8Array, code: NormalCode) -> Float64Array:
    """Return the unit vectors [..., 3] of codes [..., bytes]; the zero vector if there is no gradient."""
    numbers = octets.astype(np.int64)
    if code == "biased8":
        return unit((numbers[..., :3] - 128) / 127)
    if code == "snorm8":
        return unit(octets[..., :3].view(np.int8) / 127)
    if code == "oct8":
        square = (numbers[..., :2] - 128) / 127
    else:
        low, middle, high = np.moveaxis(numbers[..., :3], -1, 0)
        square = (np.stack([low + (middle & 15) * 256, (middle >> 4) + high * 16], axis=-1) - 2048) / 2047
    return np.where((numbers[..., : DIRECTION_BYTES[code]] == 0).all(axis=-1)[..., None], 0.0, _folded(square))


def _folded(square: Float64Array) -> Float64Array:
    u, v = square[..., 0], square[..., 1]
    height = 1 - np.abs(u) - np.abs(v)
    # Outside the inner diamond is the lower half, folded outwards.
    over = np.maximum(-height, 0)
    return unit(np.stack([u - np.copysign(over, u), v - np.copysign(over, v), height], axis=-1))


def unit(vectors: Float32Array | Float64Array) -> Float64Array:
    """Return vectors [..., 3] of length 1, or 0 where they are 0."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    unit: Float64Array = np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)
    return unit
