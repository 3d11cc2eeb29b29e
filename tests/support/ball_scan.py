"""A soft ball beside the middle of an anisotropic raw volume of odd sizes."""

from pathlib import Path

import numpy as np

SCENE = """
name = "ball"
profile = "{profile}"

[source]
path = "ball.raw"
raw = {{ shape_zyx = [12, 15, 17], dtype = "uint8", spacing_mm_zyx = [1.5, 1.0, 0.9] }}

[[transfer]]
name = "veil"
points = [
    {{ value = 20.0, colour = "#804020", extinction_per_mm = 0.0 }},
    {{ value = 120.0, colour = "#ffc080", extinction_per_mm = 0.2 }},
    {{ value = 200.0, colour = "#a0c0ff", extinction_per_mm = 0.5 }},
]

[render]
picture_size = 32
{render}

{tables}
"""


def write_ball(folder: Path) -> None:
    """Write `ball.raw`: 12×15×17 bytes, 1.5, 1 and 0.9 mm apart."""
    z, y, x = np.meshgrid(*(np.arange(n) * h for n, h in ((12, 1.5), (15, 1.0), (17, 0.9))), indexing="ij")
    ball = 220 * np.exp(-((z - 8) ** 2 + (y - 6) ** 2 + (x - 9) ** 2) / 30)
    ball.astype(np.uint8).tofile(folder / "ball.raw")


def write_ball_scene(folder: Path, render: str, profile: str = "gles3", tables: str = "") -> Path:
    """Write the ball and a scene of it; `render` holds keys of [render]."""
    write_ball(folder)
    scene = folder / "ball.toml"
    scene.write_text(SCENE.format(profile=profile, render=render, tables=tables), encoding="utf-8")
    return scene
