"""A package as it would be without early ray termination, or without skip tables, to tell what they cost and save.

The shader is composed again from the manifest, with and without. Only where the text with everything is the package's
own, letter for letter, does the text without it say anything about the package.
"""

from volprep.shading import raycast_bricks, raycast_mosaic, raycast_texture3d
from volprep.shading.classification import Classification, classification_of
from volprep.shading.components import component_letter
from volprep.shading.lighting import Lighting, headlight
from volprep.shading.proxy import Entry
from volprep.shading.raycast import Additions, RayCaster, Sampling, ray_caster
from volprep.shading.skipping import skipping_of
from volprep.shading.together import drawn_together
from volprep.validation.altered import Altered
from volprep_formats.package.manifest import Manifest, RenderSettings
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package


def uncut(package: Package, program: Program, render: RenderSettings) -> Package | None:
    """Return the package in which rays of `program` run to their end.

    It is the package itself where its rays do so anyway, None where its shader is not the one that this version of
    volprep composes. The program may be one that begins at proxy geometry.
    """
    if render.opacity_cutoff is None:
        return package
    if _shaders(package, program, render).fragment != package.read_text(program.fragment):
        return None
    without = _shaders(package, program, render.model_copy(update={"opacity_cutoff": None}))
    return Altered(package, program.fragment, without.fragment)


def unskipped(package: Package, program: Program, render: RenderSettings) -> Package | None:
    """Return the package in which rays of `program` look at no skip table; itself and None as `uncut` does."""
    if all(sampler.role != "skip" for sampler in program.samplers):
        return package
    if _shaders(package, program, render).fragment != package.read_text(program.fragment):
        return None
    without = _shaders(package, program, render, skips=False)
    changed = program.model_copy(update={"uniforms": without.uniforms, "samplers": without.samplers})
    return Altered(package, program.fragment, without.fragment, changed)


def _shaders(package: Package, program: Program, render: RenderSettings, *, skips: bool = True) -> RayCaster:
    manifest = package.manifest
    z, y, x = manifest.levels[0].grid.extent_mm_zyx
    level = min(program.levels)
    if manifest.together is not None and program.transfer == manifest.together.name:
        skipping = skipping_of(manifest, program.transfer, level, program.classification) if skips else None
        return ray_caster(*_together(manifest, program, level), (x, y, z), render, Additions(skipping))
    classified = classification_of(manifest, program)
    additions = Additions(
        skipping_of(manifest, program.transfer, level, program.classification) if skips else None,
        _lighting(manifest, program, level),
        _entry(manifest, program, (x, y, z)),
    )
    return ray_caster(_sampling(package, program), classified, (x, y, z), render, additions)


def _together(manifest: Manifest, program: Program, level: int) -> tuple[Sampling, Classification]:
    channel_of = {name: channel.name for channel in manifest.channels for name in channel.transfers}
    transfers = manifest.together.transfers if manifest.together else ()
    spacing_mm_zyx = next(each.grid.spacing_mm_zyx for each in manifest.levels if each.index == level)
    drawn = {name: channel_of[name] for name in transfers}
    return drawn_together(manifest, drawn, level, spacing_mm_zyx, program.classification)


def _lighting(manifest: Manifest, program: Program, level: int) -> Lighting | None:
    if program.lighting == "none":
        return None
    return headlight(next(each for each in manifest.textures if (each.role, each.level) == ("normals", level)))


def _entry(manifest: Manifest, program: Program, extent_mm_xyz: tuple[float, float, float]) -> Entry | None:
    if manifest.proxy is None or manifest.grid is None or program not in manifest.proxy.programs:
        return None
    return Entry(extent_mm_xyz, min(manifest.grid.spacing_mm_zyx))


def _sampling(package: Package, program: Program) -> Sampling:
    manifest = package.manifest
    level = manifest.levels[[each.index for each in manifest.levels].index(min(program.levels))]
    volume = next(texture for texture in manifest.textures if (texture.role, texture.level) == ("volume", level.index))
    if volume.bricks is not None:
        return raycast_bricks.sampling_of(manifest, level.index)
    component = component_letter(volume.gl.format, package.component_of(volume))
    if volume.mosaic is None:
        wanted = None if program.classification == "preclassified" else component
        return raycast_texture3d.sampling(wanted, mipmaps=volume.mipmap is not None)
    return raycast_mosaic.sampling(volume.mosaic, level.grid.spacing_mm_zyx, component, volume.filter)
