"""Ray casting tile by tile, those that cost least first (Díaz-García et al. 2018, section 4.2)."""

from dataclasses import replace

from volprep.techniques.ray_casting import RAY_CASTING

TILES = replace(
    RAY_CASTING,
    name="tiles",
    text="ray casting tile by tile",
    # What sorts them is in the language of OpenGL ES 3.1.
    samplings=frozenset(("texture3d", "bricks")),
)
