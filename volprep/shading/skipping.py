"""Empty-space skipping in a ray caster: how a skip table is read, and how far its entries let a ray go.

Samples stay where they are without it: a jump goes on to the first sample behind the empty region, whose end is where
this ray leaves it. A table is read once for each block that a ray meets.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from volprep.shading.compose import literal
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.skip.record import SkipKind, SkipTable
from volprep_formats.package.program import ClassificationName, Sampler, Uniform
from volprep_formats.package.texture import MosaicLayout

_REACH: dict[SkipKind, str] = {
    "blocks": "skip_reach_box",
    "table16": "skip_reach_box",
    "distance": "skip_reach_box",
    "octants": "skip_reach_box",
    "pyramid": "skip_reach_pyramid",
    "euclidean": "skip_reach_sphere",
}


_RUN = 8
"""Samples between two looks at the table."""


@dataclass(frozen=True)
class Skipping:
    """What a ray caster needs in order to skip."""

    parts: Mapping[str, str | None]
    """Files of the slots of fragment.glsl, and of the slots in them."""
    constants: Mapping[str, str]
    """Words that these files use."""
    uniforms: tuple[Uniform, ...]
    """Uniforms that these files declare."""
    sampler: Sampler
    """Sampler that they declare."""


def skipping_of(manifest: Manifest, transfer: str, level: int, classification: ClassificationName) -> Skipping | None:
    """Return what a program of this transfer function skips with; None where the manifest has no table for it.

    A program of 3D textures draws all levels: kind and size of blocks, which its text holds, are the same for all.
    """
    tables = manifest.skipping.tables if manifest.skipping else ()
    table = next((each for each in tables if (each.transfer, each.level) == (transfer, level)), None)
    if table is None:
        return None
    texture = next(each for each in manifest.textures if each.name == table.texture)
    return skipping(table, texture.mosaic, segments=classification == "preintegrated")


def skipping(table: SkipTable, layout: MosaicLayout | None, *, segments: bool) -> Skipping:
    """Skip with a table as a 3D texture, or as a mosaic of this layout; one of several levels stands for all.

    `segments` says that both ends of a segment are sampled instead of its middle.
    """
    octants = table.kind == "octants"
    form = "texture3d" if layout is None else "mosaic"
    parts = {
        "skipping": "skip",
        "skip_table": f"skip_table_{form}",
        "skip_octant": f"skip_octant_{form}" if octants else None,
        "skip_reach": _REACH[table.kind],
        "skip_start": "skip_start",
        "skip_look": "skip_look_segment" if segments else "skip_look",
        "loop_end": "loop_end_skip",
    }
    constants = {"RUN": literal(_RUN), "HALF_VOXEL": literal(0.5 / table.block)}
    uniforms: tuple[Uniform, ...] = ()
    if layout is None:
        constants["OCTANT_TABLES"] = " / ivec3(1, 1, 8)" if octants else ""
        uniforms = (Uniform(name="u_blocks_from_box", type="vec3", source="blocks_from_box"),)
    else:
        height, width = layout.tile_shape_yx
        rows, columns = layout.texture_shape_yx
        z, y, x = table.blocks_zyx
        constants |= {
            "BLOCKS_PER_MM": literal(*table.blocks_from_box_per_mm_xyz),
            "LAST_BLOCK": literal(x - 1, y - 1, z - 1),
            "SKIP_TILE": literal(width, height),
            "SKIP_MOSAIC": literal(columns, rows),
            "SKIP_TILES_X": literal(layout.tiles_x),
        }
    return Skipping(parts, constants, uniforms, Sampler(name="u_skip", role="skip"))
