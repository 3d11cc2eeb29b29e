"""Ray casting tile by tile, the cheapest first (Díaz-García et al. 2018, section 4.2)."""

from dataclasses import replace

from volprep.techniques.ray_casting import RAY_CASTING

TILES = replace(
    RAY_CASTING,
    name="tiles",
    text="ray casting tile by tile",
    # The sorting shaders are in the language of OpenGL ES 3.1.
    samplings=frozenset(("texture3d", "bricks")),
)
