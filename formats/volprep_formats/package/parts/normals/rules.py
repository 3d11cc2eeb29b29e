"""Check the consistency of a manifest's normals; docs/CHECKS.md states the rules."""

from collections.abc import Iterator

from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.normals.record import DIRECTION_BYTES, FILTERED_CODES
from volprep_formats.package.texture import Texture
from volprep_formats.textures.texel_formats import COMPONENTS


def normals_contradictions(manifest: Manifest) -> Iterator[str]:
    """Return every problem of normals that can be seen without opening another file."""
    levels = {level.index: level for level in manifest.levels}
    parts = [(texture.level, texture.part) for texture in manifest.textures if texture.role == "normals"]
    if len(parts) != len(set(parts)):
        yield "two textures hold the normals of one level"
    for texture in manifest.textures:
        if texture.role != "normals":
            if texture.normals is not None:
                yield f"texture {texture.name} has the role {texture.role}, but has a record of normals"
            continue
        yield from (f"texture {texture.name} {problem}" for problem in _code(texture))
        level = levels.get(-1 if texture.level is None else texture.level)
        if level is None:
            yield f"texture {texture.name} holds normals of level {texture.level}, which is not among the levels"
        elif texture.mosaic is None and (texture.dimension != "3d" or texture.shape_zyx != level.grid.shape_zyx):
            yield (
                f"texture {texture.name} holds normals without a mosaic, so it must be 3D and have the shape "
                f"{level.grid.shape_zyx}"
            )
    for program in manifest.programs:
        if (program.light is not None) != (program.lighting in {"phong", "blinn-phong"}):
            yield f"program {program.name} has lighting {program.lighting}, and {'a' if program.light else 'no'} light"


def _code(texture: Texture) -> Iterator[str]:
    normals = texture.normals
    if normals is None:
        yield "holds normals, but has no record of them"
        return
    components = DIRECTION_BYTES[normals.code] + (normals.largest_gradient is not None)
    if COMPONENTS.get(texture.format) != components:
        yield f"holds normals of {components} components, its format is {texture.format}"
    if (normals.code == "snorm8") != texture.format.endswith("snorm"):
        yield f"holds normals of code {normals.code}, but texels of {texture.format}"
    if (texture.filter == "linear") != (normals.code in FILTERED_CODES):
        yield f"holds normals of code {normals.code}, but has the filter {texture.filter}"
    if texture.transfer is not None:
        yield "holds normals, but has a transfer function"
    if texture.mosaic is not None and (texture.mosaic.components_per_voxel != components or texture.mosaic.gutter):
        yield f"holds normals of {components} components, but has a mosaic with a gutter, or of other components"
