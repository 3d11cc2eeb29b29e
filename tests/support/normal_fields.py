"""Fields whose gradients are known in closed form, and directions to try kernels and codes on."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.truth.normal_codes import decoded
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES, GradientKernel, NormalCode

Array = NDArray[np.float64]
WHOLE = (False, False)
EVEN = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class AnalyticField:
    """Values and gradients at positions [..., (x, y, z)] in voxels from the middle of the volume."""

    value: Callable[[Array], Array]
    gradient: Callable[[Array], Array]


def sphere(radius: float, width: float) -> AnalyticField:
    """Step of this width at a distance from the middle: 0 outside, 1 inside."""

    def gradient(at: Array) -> Array:
        distance = np.linalg.norm(at, axis=-1)
        slope = -_step_slope((radius - distance) / width) / width
        return at * (slope / np.maximum(distance, 1e-9))[..., None]

    return AnalyticField(lambda at: _step((radius - np.linalg.norm(at, axis=-1)) / width), gradient)


def torus(ring: float, radius: float, width: float) -> AnalyticField:
    """Step of this width at a distance from a circle around z."""

    def from_ring(at: Array) -> Array:
        return np.hypot(at[..., 0], at[..., 1]) - ring

    def gradient(at: Array) -> Array:
        across = np.maximum(np.hypot(at[..., 0], at[..., 1]), 1e-9)
        distance = np.maximum(np.hypot(from_ring(at), at[..., 2]), 1e-9)
        slope = -_step_slope((radius - distance) / width) / width / distance
        planar = slope * from_ring(at) / across
        return np.stack([planar * at[..., 0], planar * at[..., 1], slope * at[..., 2]], axis=-1)

    return AnalyticField(lambda at: _step((radius - np.hypot(from_ring(at), at[..., 2])) / width), gradient)


def marschner_lobb(half: float, frequency: float = 6.0, depth: float = 0.25) -> AnalyticField:
    """The test signal of Marschner and Lobb (1994) on the cube from -half to half, 0 to 1."""

    def gradient(at: Array) -> Array:
        x, y, z = np.moveaxis(at / half, -1, 0)
        radius = np.maximum(np.hypot(x, y), 1e-9)
        inner = 2 * np.pi * frequency * np.cos(np.pi / 2 * radius)
        slope = depth * np.sin(inner) * 2 * np.pi * frequency * np.pi / 2 * np.sin(np.pi / 2 * radius)
        parts = [slope * x / radius, slope * y / radius, -np.pi / 2 * np.cos(np.pi / 2 * z)]
        return np.stack(parts, axis=-1) / (2 * (1 + depth) * half)

    def value(at: Array) -> Array:
        x, y, z = np.moveaxis(at / half, -1, 0)
        rings = np.cos(2 * np.pi * frequency * np.cos(np.pi / 2 * np.hypot(x, y)))
        return (1 - np.sin(np.pi / 2 * z) + depth * (1 + rings)) / (2 * (1 + depth))

    return AnalyticField(value, gradient)


def positions(size: int) -> Array:
    """Centres of the voxels of a cube, [z, y, x, (x, y, z)], from its middle."""
    at = np.arange(size) - (size - 1) / 2
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    return np.stack([x, y, z], axis=-1)


def directions(count: int) -> Array:
    """Unit vectors evenly over the sphere: a Fibonacci spiral."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    angle = np.pi * (1 + 5**0.5) * k
    across = np.sqrt(1 - z * z)
    return np.stack([across * np.cos(angle), across * np.sin(angle), z], axis=-1)


def angles(found: Array, true: Array) -> Array:
    """Degrees between vectors of any length but zero."""
    a = found / np.linalg.norm(found, axis=-1, keepdims=True)
    b = true / np.linalg.norm(true, axis=-1, keepdims=True)
    # Twice the arc sine of half the chord: the arc cosine loses small angles.
    return np.degrees(2 * np.arcsin(np.minimum(np.linalg.norm(a - b, axis=-1) / 2, 1)))


def coded(vectors: Array, code: NormalCode) -> Array:
    """Vectors [n, 3] through the native encoder and the decoder: as central differences of n cubes of 3³ voxels."""
    cubes = np.zeros((3, 3, 3 * len(vectors)), np.float32)
    cubes[1, 1, 2::3], cubes[1, 2, 1::3], cubes[2, 1, 1::3] = vectors.T
    octets = np.empty((*cubes.shape, DIRECTION_BYTES[code]), np.uint8)
    _native.normals(cubes, "central", WHOLE, EVEN, code, octets)
    return decoded(octets[1, 1, 1::3], code)


def wave_gradients(kernel: GradientKernel, waves: Array) -> Array:
    """What a kernel finds in plane waves sin(k · x) where they rise, for wave vectors [n, 3] per voxel."""
    offset = np.arange(-1, 2)
    z, y, x = np.meshgrid(offset, offset, offset, indexing="ij")
    phase = waves @ np.stack([x, y, z]).reshape(3, 27)
    cubes = np.sin(phase).reshape(-1, 3, 3, 3).transpose(1, 2, 0, 3).reshape(3, 3, -1).astype(np.float32)
    vectors = np.empty((*cubes.shape, 3), np.float32)
    _native.gradient(cubes, kernel, WHOLE, EVEN, vectors)
    return vectors[1, 1, 1::3].astype(np.float64)


def _step(distance: Array) -> Array:
    return 1 / (1 + np.exp(-4 * distance))


def _step_slope(distance: Array) -> Array:
    # 4 s (1 - s) of a logistic step, without overflow.
    return 1 / np.cosh(2 * distance) ** 2
