"""Volumes with what coarse levels lose first: thin vessels, struts, cracks, shells; beside them soft tissue and noise.

Each is made from a seed, so that some seeds can be kept out of tuning. Values are codes of 8 bits, a voxel is 1 mm.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from volprep_formats.arrays import Float64Array, UInt8Array

Points = tuple[tuple[float, tuple[float, float, float], float], ...]
"""Value, linear colour, extinction per millimetre."""


@dataclass(frozen=True)
class Phantom:
    """A volume, and how it is seen."""

    name: str
    """Name."""
    voxels: UInt8Array
    """Codes [z, y, x]."""
    points: Points
    """Control points of the transfer function."""
    thin: bool
    """Whether it shows thin things only, so that kept light counts."""
    held_out: bool = False
    """Whether nothing was tuned on it."""


_VESSEL: Points = ((120.0, (0.7, 0.05, 0.03), 0.0), (170.0, (0.8, 0.1, 0.05), 1.2), (255.0, (1.0, 0.5, 0.4), 2.0))
_METAL: Points = ((110.0, (0.4, 0.45, 0.5), 0.0), (130.0, (0.7, 0.75, 0.8), 3.0), (255.0, (0.9, 0.9, 1.0), 6.0))
_SOLID: Points = ((70.0, (0.3, 0.2, 0.1), 0.0), (110.0, (0.7, 0.6, 0.4), 0.25), (200.0, (0.9, 0.85, 0.7), 1.0))
_SHELL: Points = ((90.0, (0.1, 0.2, 0.5), 0.0), (150.0, (0.3, 0.5, 0.9), 0.5), (220.0, (0.9, 0.9, 1.0), 1.0))
_TISSUE: Points = (
    (40.0, (0.4, 0.2, 0.15), 0.0),
    (90.0, (0.7, 0.4, 0.3), 0.02),
    (140.0, (0.8, 0.6, 0.5), 0.1),
    (220.0, (1.0, 0.95, 0.85), 0.4),
)


def phantoms(size: int = 96) -> list[Phantom]:
    """Return all phantoms, `size` voxels along an edge."""
    vessels = [
        Phantom(f"vessels {seed}", vessel_tree(size, seed), _VESSEL, thin=True, held_out=seed >= _HELD_OUT_SEED)
        for seed in (1, 2, 3, 11, 12, 13)
    ]
    return [
        *vessels,
        Phantom("stent", stent(size, 1), _METAL, thin=True),
        Phantom("stent held out", stent(size, 12), _METAL, thin=True, held_out=True),
        Phantom("cracks", cracks(size, 1), _SOLID, thin=False),
        Phantom("shells", shells(size, 1), _SHELL, thin=True),
        Phantom("soft tissue", soft_tissue(size, 1), _TISSUE, thin=False),
        Phantom("soft tissue held out", soft_tissue(size, 12), _TISSUE, thin=False, held_out=True),
        Phantom("noise", noise(size, 1), _TISSUE, thin=False),
    ]


_HELD_OUT_SEED = 11


def vessel_tree(size: int, seed: int) -> UInt8Array:
    """Six curved vessels of 0.7 to 1.8 voxels in radius, in noise."""
    generator = np.random.default_rng(seed)
    inside = np.zeros((size, size, size))
    for _ in range(6):
        a, b, c = (generator.uniform(0.12, 0.88, 3) * size for _ in range(3))
        t = np.linspace(0.0, 1.0, 6 * size)[:, None]
        _stamp(inside, (1 - t) ** 2 * a + 2 * t * (1 - t) * b + t**2 * c, generator.uniform(0.7, 1.8))
    return _codes(60.0 + 150.0 * inside, 10.0, generator)


def stent(size: int, seed: int) -> UInt8Array:
    """Two families of helical struts of 0.6 to 0.9 voxels in radius on a cylinder, in noise."""
    generator = np.random.default_rng(seed)
    inside = np.zeros((size, size, size))
    radius = generator.uniform(0.22, 0.3) * size
    turns = generator.uniform(1.2, 1.8)
    thickness = generator.uniform(0.6, 0.9)
    t = np.linspace(0.1, 0.9, 12 * size)
    for sign in (-1.0, 1.0):
        for phase in np.arange(7) * 2 * np.pi / 7:
            angle = phase + sign * 2 * np.pi * turns * t
            path = np.stack([t * size, size / 2 + radius * np.sin(angle), size / 2 + radius * np.cos(angle)], axis=1)
            _stamp(inside, path, thickness)
    return _codes(40.0 + 200.0 * inside, 6.0, generator)


def cracks(size: int, seed: int) -> UInt8Array:
    """A ball with dark slits of 0.8 to 1.6 voxels."""
    generator = np.random.default_rng(seed)
    places = _places(size)
    solid = _soft_step(0.4 * size - np.linalg.norm(places - size / 2, axis=-1))
    for _ in range(5):
        normal = generator.normal(size=3)
        normal /= np.linalg.norm(normal)
        aside = (places - size / 2 - generator.uniform(-0.2, 0.2, 3) * size) @ normal
        bend = 0.03 * size * np.sin(places[..., 0] / size * 6.0 + generator.uniform(0, 6))
        solid *= 1.0 - _soft_step(generator.uniform(0.4, 0.8) - np.abs(aside + bend))
    return _codes(30.0 + 150.0 * solid, 4.0, generator)


def shells(size: int, seed: int) -> UInt8Array:
    """Concentric shells of 1.2 voxels, cut open."""
    generator = np.random.default_rng(seed)
    places = _places(size)
    radius = np.linalg.norm((places - size / 2) * (1.0, 1.1, 0.9), axis=-1)
    inside = np.zeros(radius.shape)
    for share in (0.2, 0.31, 0.42):
        inside = np.maximum(inside, _soft_step(0.6 - np.abs(radius - share * size)))
    inside[(places[..., 0] < 0.4 * size) & (places[..., 2] < 0.4 * size)] = 0.0
    return _codes(50.0 + 150.0 * inside, 4.0, generator)


def soft_tissue(size: int, seed: int) -> UInt8Array:
    """Smooth lumps of several sizes in a body, in noise."""
    generator = np.random.default_rng(seed)
    places = _places(size)
    body = _soft_step((0.43 * size - np.linalg.norm(places - size / 2, axis=-1)) / 2)
    value = 80.0 * body
    for _ in range(60):
        centre = size / 2 + generator.normal(size=3) * 0.17 * size
        width = generator.uniform(0.02, 0.09) * size
        value += generator.uniform(-40, 90) * body * np.exp(-((places - centre) ** 2).sum(axis=-1) / (2 * width**2))
    return _codes(20.0 + value, 5.0, generator)


def noise(size: int, seed: int) -> UInt8Array:
    """A ball that is mostly noise."""
    generator = np.random.default_rng(seed)
    body = _soft_step(0.4 * size - np.linalg.norm(_places(size) - size / 2, axis=-1))
    return _codes(20.0 + 90.0 * body, 30.0, generator)


PhantomMaker = Callable[[int, int], UInt8Array]


def _stamp(inside: Float64Array, path_zyx: Float64Array, radius: float) -> None:
    """Write a tube around a path, as the share of a voxel that it fills, roughly."""
    reach = int(radius + 2)
    offsets = np.stack(np.meshgrid(*[np.arange(-reach, reach + 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    nearest = np.floor(path_zyx).astype(int)
    for offset in offsets:
        voxel = nearest + offset
        kept = ((voxel >= 0) & (voxel < inside.shape[0])).all(axis=1)
        distance = np.linalg.norm(voxel[kept] + 0.5 - path_zyx[kept], axis=1)
        np.maximum.at(inside, tuple(voxel[kept].T), np.clip(radius + 0.5 - distance, 0.0, 1.0))


def _places(size: int) -> Float64Array:
    centres = np.arange(size) + 0.5
    return np.stack(np.meshgrid(centres, centres, centres, indexing="ij"), axis=-1)


def _soft_step(distance: Float64Array) -> Float64Array:
    return np.clip(distance + 0.5, 0.0, 1.0)


def _codes(values: Float64Array, deviation: float, generator: np.random.Generator) -> UInt8Array:
    noisy = values + generator.normal(scale=deviation, size=values.shape)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
