"""A package without early ray termination, or without skip tables, to measure their cost and savings.

The shader is composed again from the manifest, with and without. Only if the text with everything is identical to the
package's own does the text without it say anything about the package.
"""

from volprep.shading.program import compose_program
from volprep.validation.comparison.altered import Altered
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package


def uncut(package: Package, program: PictureProgram) -> Package | None:
    """Return the package in which rays of `program` run to their end.

    Return the package itself if its rays already do, None if its shader is not the one that this version of volprep
    composes. The program may be one that begins at proxy geometry.
    """
    rays = package.manifest.rays(program)
    whole = compose_program(package, program, rays)
    without = compose_program(package, program, rays, ends_early=False)
    if without.fragment == whole.fragment:
        return package
    if whole.fragment != package.read_text(program.fragment):
        return None
    return Altered(package, {program.fragment: without.fragment})


def unskipped(package: Package, program: PictureProgram) -> Package | None:
    """Return the package in which rays of `program` look at no skip table; itself and None as `uncut` does."""
    if not package.manifest.skips(program):
        return package
    rays = package.manifest.rays(program)
    if compose_program(package, program, rays).fragment != package.read_text(program.fragment):
        return None
    without = compose_program(package, program, rays, skips=False)
    names = tuple(sampler.name for sampler in without.samplers)
    changed = program.model_copy(update={"uniforms": without.uniforms, "samplers": names})
    return Altered(package, {program.fragment: without.fragment}, changed)
