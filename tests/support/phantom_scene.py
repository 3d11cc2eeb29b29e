"""A small scene of a raw volume: odd sizes, one anisotropic axis, values that no symmetry hides."""

from pathlib import Path

import numpy as np

from volprep_formats.package.manifest import Manifest

SHAPE_ZYX = (21, 34, 45)
SPACING_MM_ZYX = (2.5, 0.75, 1.0)

SCENE = """
name = "phantom"
profile = "{profile}"

[source]
path = "phantom.raw"

[source.raw]
shape_zyx = [21, 34, 45]
dtype = "uint16"
spacing_mm_zyx = [2.5, 0.75, 1.0]

[pyramid]
coarsest_longest_axis = 16

[[transfer]]
name = "shell"
points = [
    {{ value = 200.0, colour = "#804020", extinction_per_mm = 0.0 }},
    {{ value = 600.0, colour = "#ffc080", extinction_per_mm = 0.2 }},
    {{ value = 900.0, colour = "#ffffff", extinction_per_mm = 0.6 }},
]

[[transfer]]
name = "core"
points = [
    {{ value = 700.0, colour = [0.1, 0.2, 0.9], extinction_per_mm = 0.0 }},
    {{ value = 700.0, colour = [0.1, 0.2, 0.9], extinction_per_mm = 0.5 }},
]
"""


def with_filter(scene: str, level_filter: str) -> str:
    """Return a scene that asks for a filter of levels; as it is for the default."""
    wish = f'[pyramid]\nfilter = "{level_filter}"\n'
    return scene if level_filter == "auto" else scene.replace("[pyramid]\n", wish)


def phantom() -> np.ndarray:
    """Two blobs of different size and height in noise, uint16 [z, y, x]; the noise makes 12 bits used."""
    z, y, x = np.meshgrid(*(np.arange(n) * h for n, h in zip(SHAPE_ZYX, SPACING_MM_ZYX, strict=True)), indexing="ij")
    field = np.zeros(SHAPE_ZYX)
    for centre, radius, height in (((20.0, 9.0, 14.0), 9.0, 900.0), ((36.0, 16.0, 32.0), 6.0, 500.0)):
        distance2 = sum((a - b) ** 2 for a, b in zip((z, y, x), centre, strict=True))
        field += height * np.exp(-distance2 / radius**2)
    return (field + np.random.default_rng(7).integers(0, 60, SHAPE_ZYX)).astype("<u2")


def seen_phantom(manifest: Manifest) -> np.ndarray:
    """Give the part of the phantom that a package holds: without the border that no transfer function shows."""
    source, grid = manifest.source.info.grid, manifest.grid
    start_xyz = np.linalg.inv(source.world_from_index) @ [*grid.origin_mm_xyz, 1.0]
    start_zyx = np.rint(start_xyz[2::-1]).astype(int)
    return phantom()[tuple(slice(k, k + n) for k, n in zip(start_zyx, grid.shape_zyx, strict=True))]


def write_phantom_scene(folder: Path, profile: str = "gles3", level_filter: str = "box", more: str = "") -> Path:
    """Write the raw file and its scene to a folder; gives the path of the scene.

    To choose the filter of levels, `auto`, takes most of a build: only tests of levels and of verdicts ask for it.
    `more` is added to the scene.
    """
    phantom().tofile(folder / "phantom.raw")
    scene = folder / "phantom.toml"
    scene.write_text(with_filter(SCENE.format(profile=profile), level_filter) + more, encoding="utf-8")
    return scene
