"""Tiles of the picture, sorted by their cost (Díaz-García et al. 2018, section 4.2): compute shaders.

The picture is that of ray casting, tile by tile: an app draws the number of tiles in a frame that its time allows. The
cheapest tiles come first. The cost of a tile is the number of samples of the ray in its middle, counted by the loop of
the program itself; 256 groups of costs are sorted by counting.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from volprep.shading.compose import Instance, Slot, compose, literal
from volprep.shading.feature import Feature
from volprep_formats.grid import Grid
from volprep_formats.package.program import Rays, Uniform

TILE = 8
"""Pixels of an edge of a tile."""
GROUPS = 256
"""Groups of costs."""
_SIZES = (
    Uniform(name="u_picture_width", type="f32", source="picture_width"),
    Uniform(name="u_picture_height", type="f32", source="picture_height"),
)


@dataclass(frozen=True)
class TileTexts:
    """Compute shaders that sort tiles, and what the first of them is given."""

    texts: tuple[str, str, str]
    """Texts: cost, offsets, place."""
    uniforms: tuple[Uniform, ...]
    """Every active uniform of the first that is not a sampler."""
    reads: tuple[str, ...]
    """Its samplers, which are some of the program's."""


def cost_feature(grid: Grid, sample: Slot, rays: Rays) -> Feature:
    """Return what counts the samples of a ray, behind the part that takes one of them."""
    part = "tiles/cost"
    taken = () if sample is None else (Instance(sample),) if isinstance(sample, str) else sample
    return Feature(
        slots={
            "dialect": part,
            "rays": (Instance(f"{part}:rays"), *((Instance("ray/from_mesh"),) if rays == "mesh" else ())),
            "rays_ends": f"{part}:ends",
            "sample": (*taken, Instance(f"{part}:sample")),
            "picture": f"{part}:picture",
        },
        words={
            "NEAR_END": "near_end",
            "FAR_END": "far_end",
            "TILE": literal(TILE),
            "GROUPS": literal(GROUPS),
            "LONGEST_MM": literal(math.hypot(*grid.extent_mm_zyx)),
            **({"PLACE": "0.5 * ndc + 0.5"} if rays == "mesh" else {}),
        },
        uniforms=_SIZES,
    )


def tile_texts(cost: str, features: Sequence[Feature]) -> TileTexts:
    """Return the shaders of tiles whose cost the shader `cost` of these features counts."""
    return TileTexts(
        texts=(cost, compose("tiles/offsets", "es310", {}, {}), compose("tiles/place", "es310", {}, {})),
        uniforms=tuple(uniform for feature in features for uniform in feature.uniforms),
        reads=tuple(sampler.name for feature in features for sampler in feature.samplers),
    )
