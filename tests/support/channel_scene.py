"""A small scene of three registered raw files: two blobs that overlap, in different types and ranges, and a third."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from phantom_scene import with_filter

SHAPE_ZYX = (17, 22, 27)
LAYOUT = 'raw = {{ shape_zyx = [17, 22, 27], dtype = "{dtype}", spacing_mm_zyx = [1.5, 1.0, 0.75] }}'
SCENE = """
name = "tissues"
profile = "{profile}"

[[source.channels]]
name = "bone"
path = "bone.raw"
{bone}

[[source.channels]]
name = "skin"
path = "skin.raw"
{skin}

[[source.channels]]
name = "air"
path = "air.raw"
{bone}

[pyramid]
coarsest_longest_axis = 10

[render]
picture_size = 48

[[transfer]]
name = "red"
channel = "skin"
points = [
    {{ value = 0.2, colour = "#ff0000", extinction_per_mm = 0.0 }},
    {{ value = 0.9, colour = "#ff8080", extinction_per_mm = 0.4 }},
]

[[transfer]]
name = "white"
points = [
    {{ value = 300.0, colour = "#8080ff", extinction_per_mm = 0.0 }},
    {{ value = 900.0, colour = "#ffffff", extinction_per_mm = 0.3 }},
]

[[transfer]]
name = "blue"
channel = "skin"
points = [
    {{ value = 0.1, colour = "#0000ff", extinction_per_mm = 0.0 }},
    {{ value = 0.6, colour = "#0000ff", extinction_per_mm = 0.2 }},
]
"""


def blob(centre_zyx: tuple[float, float, float], radius: float) -> NDArray[np.float64]:
    """A smooth ball of height 1, in voxels."""
    at = np.meshgrid(*map(np.arange, SHAPE_ZYX), indexing="ij")
    return np.exp(-sum((a - b) ** 2 for a, b in zip(at, centre_zyx, strict=True)) / radius**2)


def channels() -> dict[str, NDArray[np.generic]]:
    """Values of the three."""
    return {
        "bone": np.rint(1000 * blob((8, 11, 9), 5)).astype("<i2"),
        "skin": blob((9, 8, 18), 6).astype("<f4"),
        "air": np.rint(1000 * blob((4, 4, 4), 3)).astype("<i2"),
    }


def write_channel_scene(folder: Path, profile: str = "gles3", level_filter: str = "box", more: str = "") -> Path:
    """Write the scene and its files; give the path of the scene.

    To choose the filter of levels, `auto`, takes most of a build: only tests of levels and of verdicts ask for it.
    `more` is added to the scene.
    """
    for name, values in channels().items():
        (folder / f"{name}.raw").write_bytes(values.tobytes())
    scene = folder / "tissues.toml"
    layouts = {"bone": LAYOUT.format(dtype="int16"), "skin": LAYOUT.format(dtype="float32")}
    scene.write_text(with_filter(SCENE.format(profile=profile, **layouts), level_filter) + more)
    return scene
