"""A field and a table as a GPU samples them, for proofs that nothing visible is skipped."""

import numpy as np


def field_at(values, position):
    """Trilinear field at texture coordinates times size, [n, zyx], as OpenGL defines it."""
    shape = np.array(values.shape)
    centred = np.clip(position - 0.5, 0, shape - 1)
    lower = np.floor(centred).astype(np.int64)
    fraction = centred - lower
    upper = np.minimum(lower + 1, shape - 1)
    flat = values.reshape(-1)
    strides = np.array([shape[1] * shape[2], shape[2], 1])
    below, above = lower * strides, upper * strides
    found = 0.0
    for corner in np.ndindex(2, 2, 2):
        index = sum((above if far else below)[:, axis] for axis, far in enumerate(corner))
        weight = np.prod([fraction[:, a] if far else 1 - fraction[:, a] for a, far in enumerate(corner)], axis=0)
        found = found + weight * flat[index]
    return found


def extinction_at(table, value):
    return np.interp(value * (len(table) - 1), np.arange(len(table)), table)


def blocks_at(position, shape, block, blocks):
    """The block of a sample as the shader finds it: in float32, and clamped to the table."""
    at = (position.astype(np.float32) - np.float32(0.5)) / np.float32(block)
    return np.clip(np.floor(at).astype(np.int64), 0, np.array(blocks) - 1)
