"""Programs: turn a package and the record of a program into the text of its shaders and their inputs.

Each feature of the program fills its slots, whatever its technique is and whatever the volume is sampled from; what the
package does not need leaves no trace in the text.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.shading import raycast_bricks, raycast_mosaic, raycast_subvolumes, raycast_texture3d
from volprep.shading.baked import with_baked_light
from volprep.shading.classification import VOXELS, classification, lit_in_voxels, splits_voxels, voxel_classification
from volprep.shading.components import component_letter
from volprep.shading.compose import Dialect, Slot, compose, literal
from volprep.shading.compositing import compositing
from volprep.shading.feature import Feature
from volprep.shading.groups import SINGLE_SAMPLES, in_groups
from volprep.shading.lighting import lighting
from volprep.shading.raycast import BACKWARDS
from volprep.shading.segments import drawn_with_segments, samples_of_group, values_alone
from volprep.shading.shadows import SHADOW_MAP, layer_feature, light_texels, map_feature
from volprep.shading.skipping import skipping_of
from volprep.shading.tiles import TileTexts, cost_feature, tile_texts
from volprep.shading.together import drawn_together
from volprep.shading.walk import PassText, TechniqueInput, Walk
from volprep.shading.walks import WALKS
from volprep_formats.grid import Grid
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.parts.bricks.record import BrickLayout
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, decode_grid
from volprep_formats.package.program import (
    Blend,
    Geometry,
    PassTarget,
    ProgramDesign,
    RaySampling,
    Sampler,
    Uniform,
    UniformSource,
)
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture

_OPTIONAL = (
    "cut",
    "skipping",
    "skipping_start",
    "lighting",
    "lighting_start",
    "lighting_run",
    "voxel_normals",
    "voxel_direction",
    "voxel_light",
    "light",
    "stop_start",
    "stop",
    "stop_picture",
    "restart",
    "of_group",
)
"""Slots that stay empty where no empty space is skipped, nothing is lit, and rays do not end early."""

_BOX = {"box": "ray/box", "inside": "ray/box:inside"}
"""Rays are cut at the volume's box by arithmetic, unless the technique knows better."""


@dataclass(frozen=True)
class Shaders:
    """The shaders of a program, and their inputs."""

    vertex: str
    """Text of the vertex shader."""
    fragment: str
    """Text of the fragment shader."""
    uniforms: tuple[Uniform, ...]
    """Every uniform that is no sampler."""
    samplers: tuple[Sampler, ...]
    """Every sampler, in the order of texture units."""
    step_mm_min: float
    """Finest step that the program can draw."""
    geometry: Geometry
    """The geometry that the vertex shader draws."""
    before: tuple[PassText, ...]
    """Passes that come first, with the vertex shader of the program."""
    light_pass: PassText | None
    """The pass that is drawn after each layer, from the light."""
    tiles: TileTexts | None
    """The shaders that sort the tiles of the picture."""
    blend: Blend | None
    """How fragments are blended."""
    target: PassTarget
    """Format of the picture."""
    slab_samples: int | None
    """Samples of a ray in each draw; None if there is one draw."""


def compose_program(
    package: Package, program: ProgramDesign, rays: RaySampling, *, ends_early: bool = True, skips: bool = True
) -> Shaders:
    """Compose the shaders of a program from the textures and tables of its package, which may be a draft.

    Without `ends_early` rays run to their end; without `skips` they look at no skip table.
    """
    own = package_of_transfer(package, program.transfer)
    grid = own.manifest.grid
    if grid is None:
        msg = "a package without a grid has no programs"
        raise ValueError(msg)
    dialect = package.manifest.profile.dialect
    walk = WALKS[program.technique](TechniqueInput(program, grid, dialect, rays.step_of(min(program.levels))))
    features = [
        walk.feature,
        *_features(own, program, grid, skips=skips and walk.loops, groups=_groups(own, program, rays, walk)),
        compositing(package.manifest, program, rays, walk, ends_early=ends_early),
    ]
    shadows = "none" if program.light is None else program.light.shadows
    shadow_map = (_shadow_map(own, program, grid, rays, skips=skips),) if shadows == "map" else ()
    return Shaders(
        vertex=walk.vertex,
        fragment=_composed(features, dialect, grid),
        uniforms=tuple(uniform for feature in features for uniform in feature.uniforms),
        samplers=tuple(sampler for feature in features for sampler in feature.samplers),
        step_mm_min=walk.step_mm_min,
        geometry=walk.geometry,
        before=(*walk.before, *shadow_map),
        tiles=_tiles(own, program, grid, rays, skips=skips) if program.technique == "tiles" else None,
        light_pass=_light_layers(own, program, grid, walk) if shadows == "half-angle" else None,
        blend=walk.blend,
        target=walk.target,
        slab_samples=walk.slab_samples,
    )


def _composed(features: Sequence[Feature], dialect: Dialect, grid: Grid) -> str:
    """Return the text of a fragment shader."""
    slots: dict[str, Slot] = {
        **dict.fromkeys(_OPTIONAL),
        "dialect": f"ray/dialect_{dialect}",
        **_BOX,
        **SINGLE_SAMPLES.slots,
    }
    words: dict[str, str] = {}
    offered = {
        **SINGLE_SAMPLES.offers,
        "LAST": "count",
        "NEAR": "stored_value",
        # Its name where the classification gives a stored_value of its own.
        "STORED": "stored_value",
        # The front of a segment is a value, unless the classification needs more of it.
        "FRONT": "float",
        "FRONT_AT": "stored_value",
        "GOING": "",
        "OF": "",
        "AROUND": "",
        "FROM_VIEWER": "ray",
        "LOW_CORNER_MM": "vec3(0.0)",
        "HIGH_CORNER_MM": literal(*grid.extent_mm_zyx[::-1]),
    }
    for feature in features:
        slots |= feature.slots
        words |= feature.words
        offered |= feature.offers
    if slots["voxel_light"] is not None:
        offered["LIT_AT"] = "middle"  # of a voxel of a label, wherever the compositing lights its samples
    offered.setdefault("FROM", offered.get("FIRST", ""))
    offered.setdefault("NORMAL", f"normal_at({offered.get('LIT_AT', '')})")
    return compose("ray/fragment", dialect, slots, words, offered)


def _shadow_map(package: Package, program: ProgramDesign, grid: Grid, rays: RaySampling, *, skips: bool) -> PassText:
    """Return the pass that draws the surface of a program from its light: rays through the same volume."""
    unlit = program.model_copy(update={"lighting": "none", "light": None, "baked": False})
    walk = WALKS["ray-casting"](TechniqueInput(unlit, grid, "es300", rays.step_of(min(program.levels))))
    sampling, classified, *skipping = _features(package, unlit, grid, skips=skips, groups=None)
    valued = values_alone(classified)
    sampled = (sampling, *valued, *skipping)
    surface = compositing(package.manifest, program, rays, walk, ends_early=False)
    features = [walk.feature, *sampled, surface, map_feature(valued[0].slots["classification"] if valued else None)]
    return PassText(
        _composed(features, "es300", grid),
        "triangle",
        SHADOW_MAP,
        "rgba32f",
        _from_light(features),
        vertex=walk.vertex,
        reads=tuple(sampler.name for feature in sampled for sampler in feature.samplers),
        size=light_texels(program, grid),
    )


def _light_layers(package: Package, program: ProgramDesign, grid: Grid, walk: Walk) -> PassText:
    """Return the pass that draws the layers of a program for its light."""
    unlit = program.model_copy(update={"lighting": "none", "light": None, "baked": False})
    sampled = _features(package, unlit, grid, skips=False, groups=None)
    features = [walk.feature, *sampled, layer_feature()]
    return PassText(
        _composed(features, "es300", grid),
        walk.geometry,
        SHADOW_MAP,
        "rgba16f",
        _from_light(features),
        reads=tuple(sampler.name for feature in sampled for sampler in feature.samplers),
        size=light_texels(program, grid),
    )


def _tiles(package: Package, program: ProgramDesign, grid: Grid, rays: RaySampling, *, skips: bool) -> TileTexts:
    """Return the shaders that sort the tiles of a picture: rays that count their samples.

    Lighting does not count, but groups of samples are the ones that the program draws.
    """
    unlit = program.model_copy(update={"lighting": "none", "light": None, "baked": False})
    walk = WALKS[program.technique](TechniqueInput(unlit, grid, "es300", rays.step_of(min(program.levels))))
    taken = compositing(package.manifest, unlit, rays, walk, ends_early=True)
    features = [
        walk.feature,
        *_features(package, unlit, grid, skips=skips, groups=_groups(package, program, rays, walk)),
        taken,
        cost_feature(grid, taken.slots["sample"], program.rays),
    ]
    return tile_texts(_composed(features, "es310", grid), features)


def _from_light(features: Sequence[Feature]) -> tuple[Uniform, ...]:
    """Return the uniforms of features, with the light's view in place of the viewer's."""
    views: dict[UniformSource, UniformSource] = {"box_from_clip": "box_from_light", "clip_from_box": "light_from_box"}
    uniforms = (uniform for feature in features for uniform in feature.uniforms)
    return tuple(
        uniform.model_copy(update={"source": views.get(uniform.source, uniform.source)}) for uniform in uniforms
    )


def _groups(package: Package, program: ProgramDesign, rays: RaySampling, walk: Walk) -> Feature | None:
    """Return the loop of a program that reads once what a group of samples shares; None if they share nothing."""
    size = samples_of_group(package.manifest, program, rays, walk)
    return in_groups(walk, size) if size > 1 else None


def _features(
    package: Package, program: ProgramDesign, grid: Grid, *, skips: bool, groups: Feature | None
) -> list[Feature]:
    """Return how a program samples and classifies, and, if it does, skips and lights; `package` is its channel's.

    `groups` is the loop over groups of samples, if it has one.
    """
    manifest = package.manifest
    pieces = _pieces(package) if program.sampling == "subvolumes" else None
    picture = manifest.picture(program.transfer)
    mixing = "one" if picture is None else picture.mixing
    if picture is not None and mixing in {"sum", "colour"}:
        features = [*drawn_together(manifest, picture, program, skips=skips)]
    elif mixing == "labels":
        sampled = _sampling(package, program, grid, pieces)
        group = 1 if groups is None else int(groups.offers["GROUP"])
        features = [*drawn_with_segments(manifest, program, sampled, pieces, group=group)]
    else:
        features = [_sampling(package, program, grid, pieces), _classification(package, program)]
    skipping = skipping_of(manifest, program, manifest.profile.dialect) if skips else None
    features += [value for value in (skipping, groups) if value is not None]
    lit = None
    if program.lighting != "none" and mixing != "sum":
        level = min(program.levels)
        normals = (texture for texture in manifest.textures if (texture.role, texture.level) == ("normals", level))
        lit = lighting(program, next(normals, None), grid, manifest.profile.dialect, mixing)
        lit = lit_in_voxels(lit) if features[1].slots["classification"] == VOXELS else lit
    if program.baked:
        held = manifest.lights()[program.transfer]
        features[1], lit = with_baked_light(
            features[1], lit, held, manifest.profile.dialect, in_runs=skipping is not None
        )
    return features if lit is None else [*features, lit]


def _classification(package: Package, program: ProgramDesign) -> Feature:
    manifest = package.manifest
    choice = (manifest, program.classification, program.transfer, manifest.profile.dialect)
    level = min(program.levels)
    filters = {texture.filter for texture in manifest.textures if (texture.role, texture.level) == ("volume", level)}
    if "nearest" in filters and splits_voxels(program.technique, program.compositing, program.classification):
        return voxel_classification(*choice, backwards=program.compositing in BACKWARDS)
    return classification(*choice)


def _pieces(package: Package) -> SubvolumeGrid:
    """Return the grid of sub-volumes of a package, which says how their textures are laid out."""
    files = package.manifest.subvolumes
    assert files is not None  # noqa: S101 - a program that draws them
    return decode_grid(package.read_bytes(files.grid), package.path, files.grid)


def _sampling(package: Package, program: ProgramDesign, grid: Grid, pieces: SubvolumeGrid | None) -> Feature:
    if pieces is not None:
        return raycast_subvolumes.sampling(grid, pieces)
    if program.sampling == "on-demand":
        assert package.manifest.on_demand is not None  # noqa: S101 - a program that draws them
        return raycast_bricks.on_demand(package.manifest.on_demand, grid, gradients=program.normals_from != "volume")
    # Of several levels, which 3D textures have, all are read as the finest one.
    level = next(level for level in package.manifest.levels if level.index == min(program.levels))
    volumes = (
        texture for texture in package.manifest.textures if (texture.role, texture.level) == ("volume", level.index)
    )
    volume = next(volumes)
    if volume.bricks is not None:
        return _bricks(package, volume, volume.bricks, level.grid, gradients=program.normals_from != "volume")
    component = component_letter(volume.format, package.component_of(volume), package.manifest.profile.dialect)
    read = None if program.classification == "preclassified" else component
    if volume.mosaic is not None:
        return raycast_mosaic.sampling(volume.mosaic, level.grid.spacing_mm_zyx, read, volume.filter)
    return raycast_texture3d.sampling(read, mipmaps=volume.mipmap is not None, extent_mm_zyx=grid.extent_mm_zyx)


def _bricks(package: Package, pool: Texture, layout: BrickLayout, grid: Grid, *, gradients: bool) -> Feature:
    held = (texture for texture in package.manifest.textures if (texture.role, texture.level) == ("bricks", pool.level))
    index = next(texture for texture in held if texture.channels == pool.channels)
    flat = None
    if pool.mosaic is not None and index.mosaic is not None:
        component = component_letter(pool.format, package.component_of(pool), package.manifest.profile.dialect)
        flat = raycast_bricks.flat_pool(pool.mosaic, index.mosaic, component, pool.filter)
    return raycast_bricks.sampling(layout, grid, gradients=gradients, flat=flat)
