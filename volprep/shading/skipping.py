"""Empty-space skipping in a ray caster: how a skip table is read, and how far its entries let a ray go.

Samples stay where they are without it: a jump goes on to the first sample behind the empty region, whose end is where
this ray leaves it. A table is read once for each block that a ray meets.
"""

from collections.abc import Sequence

from volprep.shading.compose import Dialect, Instance, Slot, literal
from volprep.shading.compositing import CELL_BY_CELL, SURFACES
from volprep.shading.feature import Feature
from volprep.shading.mosaic import Mosaic
from volprep_formats.grid import Vector
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.parts.skip.record import SkipTable
from volprep_formats.package.program import ProgramDesign, Sampler, Uniform
from volprep_formats.package.texture import MosaicLayout

SKIP_RUN = 16
"""Samples between two looks at the table. 8 take up to 7 % more time, 24 gain up to 3 % (MR heads, half a voxel)."""


def skipping_of(manifest: Manifest, program: ProgramDesign, dialect: Dialect) -> Feature | None:
    """Return what a program skips with; None where the manifest has no table for it.

    A program of 3D textures draws all levels: kind and size of blocks, which its text holds, are the same for all.
    """
    table = skip_table(manifest, program.transfer, min(program.levels))
    # Blocks of a level are not blocks of its pieces.
    if table is None or program.sampling in {"subvolumes", "on-demand"}:
        return None
    texture = next(texture for texture in manifest.textures if texture.name == table.texture)
    in_cells = program.compositing in CELL_BY_CELL
    # Of a segment both ends are sampled, or all between them, instead of its middle.
    segments = in_cells or program.classification == "preintegrated" or program.compositing in SURFACES
    feature = (
        _table_in_texture3d()
        if texture.mosaic is None
        else _table_in_mosaic(table, texture.mosaic, table.blocks_from_box(manifest.level(table.level).grid))
    )
    slots: dict[str, Slot] = {
        "skipping": "skip/skip",
        "skipping_start": "skip/skip:start",
        "look": "skip/look_segment" if segments else "skip/look",
        "jumped": None if in_cells else "skip/look_segment:front",
        "loop": f"ray/loop_cells:{dialect}_skip" if in_cells else f"ray/loop_{dialect}_skip",
        **feature.slots,
    }
    words = {"RUN": literal(SKIP_RUN), "HALF_VOXEL": literal(0.5 / table.block), **feature.words}
    return Feature(slots, words, uniforms=feature.uniforms, samplers=feature.samplers)


def skipping_on_grids(manifest: Manifest, program: ProgramDesign, transfers: Sequence[str], *, skips: bool) -> Feature:
    """Return the loop of a program through media on several grids, with these transfer functions.

    Each looks at the skip table that its own pictures have, if `skips`.
    """
    level = min(program.levels)
    tables = [skip_table(manifest, transfer, level) if skips else None for transfer in transfers]
    own: list[Instance] = []
    looks: list[Instance] = []
    alone: list[Instance] = []
    names = [f"_{number}" for number in range(len(transfers))]
    for name, table in zip(names, tables, strict=True):
        others = [f"seen{other}" for other in names if other != name]
        block = {} if table is None else {"BLOCK": literal(table.block)}
        held = None if table is None else "ray/loop_media:table"
        own.append(Instance("ray/loop_media:seen", {"OF": name, **block}, {"own_table": held}))
        alone.append(
            Instance(
                "ray/loop_media:alone", {"OF": name, "OTHERS": _least(others), "MEDIUM": f"classify_alone{name}(i)"}
            )
        )
        if table is not None:
            looks.append(Instance("skip/table_texture3d:entries", {"OF": name}))
    start, look, ahead = (
        tuple(Instance(f"ray/loop_media:{section}", {"OF": name}) for name in names)
        for section in ("start_of", "look", "ahead")
    )
    reach = [Instance("skip/skip")] if looks else []
    return Feature(
        slots={
            "skipping": (*reach, *own),
            "skip_table": tuple(looks),
            "skipping_start": (Instance("ray/loop_media:start"), *start),
            "loop": "ray/loop_media",
            "media_look": look,
            "media_ahead": ahead,
            "media_alone": tuple(alone),
        },
        words={"RUN": literal(SKIP_RUN), "FIRST_SEEN": _least([f"seen{name}" for name in names])},
        samplers=tuple(
            Sampler(name=f"u_skip{name}", role="skip", transfer=transfer)
            for name, table, transfer in zip(names, tables, transfers, strict=True)
            if table is not None
        ),
    )


def _least(names: Sequence[str]) -> str:
    """Return the GLSL of the least of some floats."""
    first, *others = names
    return f"min({first}, {_least(others)})" if others else first


def skip_table(manifest: Manifest, transfer: str, level: int) -> SkipTable | None:
    """Return the skip table of a transfer function on a level, if there is one."""
    tables = manifest.skipping.tables if manifest.skipping else ()
    return next((table for table in tables if (table.transfer, table.level) == (transfer, level)), None)


def _table_in_texture3d() -> Feature:
    return Feature(
        slots={"skip_table": "skip/table_texture3d", "skip_entries": "skip/table_texture3d:entries"},
        uniforms=(Uniform(name="u_blocks_from_box", type="vec3f", source="blocks_from_box"),),
        samplers=(Sampler(name="u_skip", role="skip"),),
    )


def _table_in_mosaic(table: SkipTable, layout: MosaicLayout, blocks_from_box: Vector) -> Feature:
    z, y, x = table.blocks_zyx
    mosaic = Mosaic(
        "The skip table as a mosaic: one texel a block, in tiles of one slice each.",
        layout,
        sampler="u_skip",
        role="skip",
        texel="skip_texel",
        prefix="SKIP_",
        centres=True,
    )
    return Feature(
        slots={"skip_table": "skip/table_mosaic", "skip_texels": (mosaic.texels,)},
        words={"BLOCKS_PER_MM": literal(*blocks_from_box), "LAST_BLOCK": literal(x - 1, y - 1, z - 1)},
        samplers=mosaic.samplers,
    )
