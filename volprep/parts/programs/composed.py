"""A program as it ships: its record, and the text of each of its shaders."""

from volprep.parts.programs.decision import MESH_VERTEX, VERTEX, pass_file, tile_files
from volprep.shading.program import compose_program
from volprep.shading.slices import OVER, TOWARDS
from volprep.shading.tiles import GROUPS, TILE, TileTexts
from volprep.shading.walk import PassText
from volprep_formats.package.program import (
    ComposedProgram,
    LightPass,
    Pass,
    Program,
    ProgramDesign,
    ProgramTraits,
    RaySampling,
    Tiles,
)
from volprep_formats.package.reader import Package


def composed(
    package: Package, design: ProgramDesign, rays: RaySampling, *, skips: bool = True
) -> tuple[ComposedProgram, dict[str, str]]:
    """Compose a program for the textures and tables of a package, which may be a draft: its record, and texts by file.

    Without `skips` it looks at no skip table.
    """
    shaders = compose_program(package, design, rays, skips=skips)
    before = tuple(_pass(design, value, number) for number, value in enumerate(shaders.before))
    texts = {design.vertex: shaders.vertex, design.fragment: shaders.fragment}
    for shader, made in zip(shaders.before, before, strict=True):
        texts[made.fragment] = shader.fragment
        if shader.vertex is not None:
            texts[made.vertex] = shader.vertex
    light_pass = None
    if shaders.light_pass is not None:
        made = _pass(design, shaders.light_pass, len(before))
        light_pass = LightPass(**dict(made), blend=TOWARDS, behind=OVER)
        texts[made.fragment] = shaders.light_pass.fragment
    tiles, sorting = _tiles(design, shaders.tiles)
    program = Program(
        **{name: getattr(design, name) for name in ProgramTraits.model_fields},
        uniforms=shaders.uniforms,
        samplers=tuple(sampler.name for sampler in shaders.samplers),
        geometry=shaders.geometry,
        before=before,
        light_pass=light_pass,
        tiles=tiles,
        blend=shaders.blend,
        target=shaders.target,
        slab_samples=shaders.slab_samples,
        step_mm_min=shaders.step_mm_min,
        opacity_cutoff=rays.opacity_cutoff,
    )
    found = ComposedProgram(
        program=program, picture=design.transfer, levels=design.levels, inputs=shaders.samplers, rays=rays
    )
    return found, texts | sorting


def _pass(design: ProgramDesign, text: PassText, number: int) -> Pass:
    """Return the record of a pass."""
    return Pass(
        vertex=design.vertex if text.vertex is None else MESH_VERTEX if text.geometry == "mesh" else VERTEX,
        fragment=pass_file(design, number),
        geometry=text.geometry,
        sampler=text.sampler,
        target=text.target,
        uniforms=text.uniforms,
        reads=text.reads,
        size=text.size,
    )


def _tiles(design: ProgramDesign, made: TileTexts | None) -> tuple[Tiles | None, dict[str, str]]:
    """Return the record of tiles, and the texts of what sorts them, by file."""
    if made is None:
        return None, {}
    cost, offsets, place = tile_files(design)
    record = Tiles(
        size=TILE, groups=GROUPS, cost=cost, offsets=offsets, place=place, uniforms=made.uniforms, reads=made.reads
    )
    return record, dict(zip((cost, offsets, place), made.texts, strict=True))
