"""A package as it would be without early ray termination, so that what termination costs can be told apart.

The shader is composed again from the manifest, with and without termination. Only where the text with termination is
the package's own, letter for letter, does the text without it say anything about the package.
"""

from pathlib import Path

from volprep.render.techniques import raycast_mosaic, raycast_texture3d
from volprep.render.techniques.classification import classification_of
from volprep.render.techniques.raycast import Sampling, ray_caster
from volprep_formats.package.manifest import Manifest, Program, RenderSettings
from volprep_formats.package.reader import Package


class _Altered(Package):
    """A package in which one text file is another."""

    def __init__(self, path: Path, manifest: Manifest, altered: str, text: str) -> None:
        super().__init__(path, manifest)
        self._altered = altered
        self._text = text

    def read_text(self, path: str) -> str:
        """Read a text file of the package, or the other text in its place."""
        return self._text if path == self._altered else super().read_text(path)


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
    return _Altered(package.path, package.manifest, program.fragment, without)


def _fragment(manifest: Manifest, program: Program, render: RenderSettings) -> str:
    z, y, x = manifest.levels[0].grid.extent_mm_zyx
    return ray_caster(_sampling(manifest, program), classification_of(manifest, program), (x, y, z), render).fragment


def _sampling(manifest: Manifest, program: Program) -> Sampling:
    level = manifest.levels[[each.index for each in manifest.levels].index(min(program.levels))]
    volume = next(texture for texture in manifest.textures if (texture.role, texture.level) == ("volume", level.index))
    if volume.mosaic is None:
        return raycast_texture3d.sampling()
    return raycast_mosaic.sampling(volume.mosaic, level.grid.spacing_mm_zyx)
