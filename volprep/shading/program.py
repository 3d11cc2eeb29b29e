"""Programs: from a package and the record of a program to the text of its shaders, and what they are given.

Ray casting, whatever the volume is sampled from: midpoint samples in equal segments. Each feature of the program fills
its slots; what the package does not need leaves no trace in the text.
"""

import math
from dataclasses import dataclass

from volprep.shading import raycast_bricks, raycast_mosaic, raycast_subvolumes, raycast_texture3d
from volprep.shading.classification import classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Slot, compose, literal
from volprep.shading.feature import Feature
from volprep.shading.lighting import headlight
from volprep.shading.rays import ray_feature, vertex_shader
from volprep.shading.skipping import skipping_of
from volprep.shading.together import drawn_together
from volprep_formats.grid import Grid
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.program import ProgramDesign, Sampler, Technique, Uniform
from volprep_formats.package.reader import Package

_DIALECTS: dict[Technique, Dialect] = {
    "raycast_texture3d": "es300",
    "raycast_mosaic": "es100",
    "raycast_subvolumes": "es300",
    "raycast_bricks": "es300",
}
_FINER = 8
"""A loop with a constant bound is long enough for steps this many times finer than the nominal one."""
_MOST_STEPS = 2**23
"""float32 counts halves exactly up to here, and a loop that cannot count on never ends."""
_OPTIONAL = ("skipping", "skipping_start", "lighting", "lighting_start", "light", "stop")
"""Slots that stay empty where no empty space is skipped, nothing is lit, and rays do not end early."""


@dataclass(frozen=True)
class Shaders:
    """The shaders of a program, and what they read."""

    vertex: str
    """Text of the vertex shader."""
    fragment: str
    """Text of the fragment shader."""
    uniforms: tuple[Uniform, ...]
    """Every uniform that is no sampler."""
    samplers: tuple[Sampler, ...]
    """Every sampler, in the order of texture units."""
    step_mm_min: float
    """Finest step for which the loop is long enough for the longest ray."""


def compose_program(
    package: Package, program: ProgramDesign, render: RenderSettings, *, ends_early: bool = True, skips: bool = True
) -> Shaders:
    """Compose the shaders of a program from the textures and tables of its package, which may be a draft.

    Without `ends_early` rays run to their end; without `skips` they look at no skip table.
    """
    grid = package.manifest.grid
    if grid is None:
        msg = "a package without a grid has no programs"
        raise ValueError(msg)
    dialect = _DIALECTS[program.technique]
    features = [
        *_features(package_of_transfer(package, program.transfer), program, grid, skips=skips),
        ray_feature(program.rays, grid),
        _compositing(package, program, render, ends_early=ends_early),
    ]
    slots: dict[str, Slot] = {
        **dict.fromkeys(_OPTIONAL),
        "dialect": f"ray/dialect_{dialect}",
        "box": "ray/box",
        "loop": f"ray/loop_{dialect}",
    }
    words = {"LOW_CORNER_MM": "vec3(0.0)", "HIGH_CORNER_MM": literal(*grid.extent_mm_zyx[::-1])}
    offered: dict[str, str] = {}
    for feature in features:
        slots |= feature.slots
        words |= feature.words
        offered |= feature.offers
    longest_mm = math.hypot(*grid.extent_mm_zyx)
    step_mm_min = longest_mm / _MOST_STEPS
    if dialect == "es100":
        step_mm_min = max(step_mm_min, render.step_mm / _FINER)
        # One more, because float32 may find a ray a rounding longer than the diagonal.
        words["MAX_STEPS"] = literal(math.ceil(longest_mm / step_mm_min) + 1)
    return Shaders(
        vertex=vertex_shader(program.rays, grid, dialect),
        fragment=compose("ray/fragment", dialect, slots, words, offered),
        uniforms=(
            Uniform(name="u_box_from_clip", type="mat4", source="box_from_clip"),
            Uniform(name="u_step_mm", type="float", source="step_mm"),
            *(uniform for feature in features for uniform in feature.uniforms),
        ),
        samplers=tuple(sampler for feature in features for sampler in feature.samplers),
        step_mm_min=step_mm_min,
    )


def _features(package: Package, program: ProgramDesign, grid: Grid, *, skips: bool) -> list[Feature]:
    """Return how a program samples and classifies, and, if it does, skips and lights; `package` is its channel's."""
    manifest = package.manifest
    if manifest.together is not None and program.transfer == manifest.together.name:
        features = [*drawn_together(manifest, program)]
    else:
        classified = classification(manifest, program.classification, program.transfer)
        features = [_sampling(package, program, grid), classified]
    skipping = skipping_of(manifest, program, _DIALECTS[program.technique]) if skips else None
    if skipping is not None:
        features.append(skipping)
    if program.lighting == "headlight":
        level = min(program.levels)
        normals = (each for each in manifest.textures if (each.role, each.level) == ("normals", level))
        features.append(headlight(next(normals)))
    return features


def _sampling(package: Package, program: ProgramDesign, grid: Grid) -> Feature:
    if program.technique == "raycast_subvolumes":
        return raycast_subvolumes.sampling(grid.spacing_mm_zyx)
    # Of several levels, which 3D textures have, all are read as the finest one.
    level = next(each for each in package.manifest.levels if each.index == min(program.levels))
    volumes = (each for each in package.manifest.textures if (each.role, each.level) == ("volume", level.index))
    volume = next(volumes)
    if volume.bricks is not None:
        return raycast_bricks.sampling(volume.bricks, level.grid)
    component = component_letter(volume.gl.format, package.component_of(volume))
    if volume.mosaic is not None:
        return raycast_mosaic.sampling(volume.mosaic, level.grid.spacing_mm_zyx, component, volume.filter)
    colours = program.classification == "preclassified"
    return raycast_texture3d.sampling(None if colours else component, mipmaps=volume.mipmap is not None)


def _compositing(package: Package, program: ProgramDesign, render: RenderSettings, *, ends_early: bool) -> Feature:
    """Return the parts of a compositing: the file of its name, whose section stop is for rays that may end early."""
    lengths = {each.name: each.reference_mm for each in package.manifest.transfer_functions}
    offers = {"REFERENCE_MM": literal(lengths.get(program.transfer, 1.0))}
    glsl = f"compositing/{program.compositing.replace('-', '_')}"
    slots: dict[str, Slot] = {
        "about": f"{glsl}:about",
        "compositing_start": f"{glsl}:start",
        "sample": f"{glsl}:sample",
        "picture": f"{glsl}:picture",
    }
    if render.opacity_cutoff is None or not ends_early:
        return Feature(slots, offers=offers)
    words = {"LEAST_TRANSMITTANCE": literal(1.0 - render.opacity_cutoff)}
    return Feature({**slots, "stop": f"{glsl}:stop"}, words, offers)
