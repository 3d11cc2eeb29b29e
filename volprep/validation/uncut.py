"""A package as it would be without early ray termination, so that what termination costs can be told apart.

The shader is composed again from the manifest, with and without termination. Only where the text with termination is
the package's own, letter for letter, does the text without it say anything about the package.
"""

from volprep.render.techniques import raycast_mosaic, raycast_texture3d
from volprep.render.techniques.classification import classification_of
from volprep.render.techniques.raycast import Additions, Sampling, ray_caster
from volprep.render.techniques.skipping import skipping_of
from volprep.validation.altered import Altered
from volprep_formats.package.manifest import Manifest, Program, RenderSettings
from volprep_formats.package.reader import Package


def uncut(package: Package, program: Program, render: RenderSettings) -> Package | None:
    """Give the package in which rays of `program` run to their end.

    It is the package itself where its rays do so anyway, None where its shader is not the one that this version of
    volprep composes.
    """
    if render.opacity_cutoff is None:
        return package
    if _fragment(package.manifest, program, render) != package.read_text(program.fragment):
        return None
    without = _fragment(package.manifest, program, render.model_copy(update={"opacity_cutoff": None}))
    return Altered(package, program.fragment, without)


def _fragment(manifest: Manifest, program: Program, render: RenderSettings) -> str:
    z, y, x = manifest.levels[0].grid.extent_mm_zyx
    classified = classification_of(manifest, program)
    skips = skipping_of(manifest, program.transfer, min(program.levels), program.classification)
    return ray_caster(_sampling(manifest, program), classified, (x, y, z), render, Additions(skips)).fragment


def _sampling(manifest: Manifest, program: Program) -> Sampling:
    level = manifest.levels[[each.index for each in manifest.levels].index(min(program.levels))]
    volume = next(texture for texture in manifest.textures if (texture.role, texture.level) == ("volume", level.index))
    if volume.mosaic is None:
        return raycast_texture3d.sampling(classified=program.classification == "preclassified")
    return raycast_mosaic.sampling(volume.mosaic, level.grid.spacing_mm_zyx)
