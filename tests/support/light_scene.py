"""A scene of a bowl with light that is computed once."""

import numpy as np

SCENE = """name = "ball"
{head}
profile = "{profile}"
[source]
path = "ball.raw"
raw = {{ shape_zyx = [15, 13, 17], dtype = "uint8", spacing_mm_zyx = [1.2, 1.0, 0.9] }}
[render]
picture_size = 32
{render}
[lighting]
baked = "{baked}"
{lighting}
[[transfer]]
name = "tissue"
points = [
    {{ value = 60.0, colour = "#d0a890", extinction_per_mm = 0.0 }},
    {{ value = 110.0, colour = "#e0d0c0", extinction_per_mm = 1.2 }},
]
{more}
"""


def scene_of(folder, *, baked="scattering", lighting="", render="", more="", profile="gles3", head=""):
    """A bowl, open to the top: its bottom gets less light than its rim."""
    z, y, x = np.mgrid[:15, :13, :17]
    radius = np.sqrt(((z - 7) * 1.2) ** 2 + (y - 6.0) ** 2 + ((x - 8) * 0.9) ** 2)
    voxels = np.where((z < 9) & (radius < 6), 255 - 90 * np.abs(radius - 4.5), 0)
    np.clip(voxels, 0, 255).astype(np.uint8).tofile(folder / "ball.raw")
    path = folder / "ball.toml"
    settings = {"baked": baked, "lighting": lighting, "render": render, "more": more, "profile": profile, "head": head}
    path.write_text(SCENE.format(**settings))
    return path
