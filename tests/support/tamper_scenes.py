"""Tiny scenes, one for each kind of package that there is to damage."""

from pathlib import Path

import numpy as np

SHAPE_ZYX = (10, 15, 18)
SCENE = """
name = "tried"
profile = "{profile}"
{top}
[source]
path = "tried.raw"
raw = {{ shape_zyx = [10, 15, 18], dtype = "uint8", spacing_mm_zyx = [1.5, 1.0, 0.75] }}

[quantize]
bits = 8

[pyramid]
coarsest_longest_axis = 5
filter = "{filter}"

[[transfer]]
name = "shell"
points = [
    {{ value = 60.0, colour = "#802040", extinction_per_mm = 0.0 }},
    {{ value = 140.0, colour = "#ffc080", extinction_per_mm = 0.3 }},
    {{ value = 220.0, colour = "#40ffff", extinction_per_mm = 0.9 }},
]
{more}
"""
CHANNELS = """
name = "tried"

[[source.channels]]
name = "one"
path = "tried.raw"
raw = { shape_zyx = [10, 15, 18], dtype = "uint8", spacing_mm_zyx = [1.5, 1.0, 0.75] }

[[source.channels]]
name = "two"
path = "other.raw"
raw = { shape_zyx = [10, 15, 18], dtype = "uint8", spacing_mm_zyx = [1.5, 1.0, 0.75] }

[quantize]
bits = 8

[[transfer]]
name = "first"
points = [
    { value = 60.0, colour = "#802040", extinction_per_mm = 0.0 },
    { value = 220.0, colour = "#ffff80", extinction_per_mm = 0.9 },
]

[[transfer]]
name = "second"
channel = "two"
points = [
    { value = 60.0, colour = "#204080", extinction_per_mm = 0.0 },
    { value = 220.0, colour = "#80ffff", extinction_per_mm = 0.9 },
]
"""
KINDS: dict[str, dict[str, str]] = {
    "house": {
        "top": 'crop = "none"',
        "more": '[proxy]\nblock = 2\n[skip]\nkind = "distance"\nblock = 2\n[grid]\nsize = 8\nlayout = "both"\n'
        '[render]\nlighting = "headlight"\nopacity_cutoff = 0.998\nstep_voxels = 0.5\n'
        "[tolerance]\nrmse = 0.02\nflip = 0.2\nkept_light = 0.0",
    },
    "mosaic": {"profile": "gles2-2048", "more": '[render]\nclassification = "preintegrated"'},
    "bricks": {"more": '[bricks]\nsize = 4\n[render]\nclassification = "palette"'},
    "bricks-in-mosaics": {"profile": "gles2-2048", "more": "[bricks]\nsize = 4"},
    "editable": {"top": "editable = true", "more": "[skip]\nranges = true"},
    "mipmaps": {"more": "[textures]\nmipmaps = true"},
    "slices": {"profile": "gles1"},
    "classified": {
        "more": '[render]\nclassification = "preclassified"\n[tolerance]\nrmse = 0.03\nflip = 0.2\nkept_light = 0.0',
        "filter": "transmittance",
    },
    "compressed": {
        "profile": "gles3-astc",
        "more": '[textures]\ncompression = "astc-4x4"\n[tolerance]\nrmse = 0.2\nflip = 1.0',
    },
    "fitted": {"top": 'crop = "none"', "filter": "auto", "more": '[skip]\nkind = "none"'},
}


def blobs(seed: int) -> np.ndarray:
    """Two blobs that no mirror changes into themselves, in noise."""
    z, y, x = np.meshgrid(*map(np.arange, SHAPE_ZYX), indexing="ij")
    field = np.zeros(SHAPE_ZYX)
    for centre, radius, height in (((4, 6, 6), 3.5, 220.0), ((6, 9, 12), 2.5, 150.0)):
        field += height * np.exp(-sum((a - b) ** 2 for a, b in zip((z, y, x), centre, strict=True)) / radius**2)
    noise = np.random.default_rng(seed).integers(0, 12, SHAPE_ZYX)
    return np.clip(field + noise, 0, 255).astype(np.uint8)


def write_kind(folder: Path, kind: str) -> Path:
    """Write the scene of a kind and its scan; give the path of the scene."""
    (folder / "tried.raw").write_bytes(blobs(1).tobytes())
    (folder / "other.raw").write_bytes(blobs(2)[:, ::-1].tobytes())
    given = {"profile": "gles3", "top": "", "filter": "box", "more": ""} | KINDS.get(kind, {})
    (folder / "tried.toml").write_text(CHANNELS if kind == "channels" else SCENE.format(**given), encoding="utf-8")
    return folder / "tried.toml"
