"""A program as it ships: its record, and the text of each of its shaders."""

from volprep.parts.programs.decision import pass_file
from volprep.shading.program import compose_program
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.program import Pass, Program, ProgramDesign
from volprep_formats.package.reader import Package


def composed(
    package: Package, design: ProgramDesign, render: RenderSettings, *, skips: bool = True
) -> tuple[Program, dict[str, str]]:
    """Compose a program for the textures and tables of a package, which may be a draft: its record, and texts by file.

    Without `skips` it looks at no skip table.
    """
    shaders = compose_program(package, design, render, skips=skips)
    before = tuple(
        Pass(
            vertex=design.vertex,
            fragment=pass_file(design, number),
            geometry=each.geometry,
            sampler=each.sampler,
            target=each.target,
            uniforms=each.uniforms,
        )
        for number, each in enumerate(shaders.before)
    )
    program = Program(
        **dict(design),
        uniforms=shaders.uniforms,
        samplers=shaders.samplers,
        geometry=shaders.geometry,
        before=before,
        blend=shaders.blend,
        slab_samples=shaders.slab_samples,
        step_mm_min=shaders.step_mm_min,
    )
    passes = {each.fragment: made.fragment for each, made in zip(before, shaders.before, strict=True)}
    return program, {design.vertex: shaders.vertex, design.fragment: shaders.fragment, **passes}
