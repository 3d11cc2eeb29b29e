"""Shaders are composed and specialised: the text that the package ships and the reference renderer runs."""

from volprep.parts.proxy.decision import VERTEX as PROXY_VERTEX
from volprep.parts.stage import Changes, Stage, present
from volprep.plan.products import ProgramPlan, SkipTablePlan
from volprep.plan.records import Plan, VolumePlan
from volprep.shading import raycast_bricks, raycast_mosaic, raycast_subvolumes, raycast_texture3d
from volprep.shading.classification import classification
from volprep.shading.components import component_letter
from volprep.shading.lighting import Lighting, headlight
from volprep.shading.proxy import Entry, depth_shader
from volprep.shading.raycast import Additions, RayCaster, Sampling, ray_caster
from volprep.shading.skipping import skipping_of
from volprep.shading.together import drawn_together
from volprep_formats.package.program import Program
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures.gl_formats import gl_format


def _settings(plan: Plan) -> tuple[Record, ...]:
    return (
        plan.grid,
        plan.render,
        *plan.levels,
        *plan.volumes,
        *plan.tables,
        *plan.programs,
        *(() if plan.subvolumes is None else plan.subvolumes.programs),
        *(() if plan.proxy is None else plan.proxy.programs),
        *present(plan.together),
    )


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    around_points = () if plan.subvolumes is None else plan.subvolumes.programs
    together = () if plan.together is None else plan.together.programs
    at_meshes = () if plan.proxy is None or draft.manifest.proxy is None else plan.proxy.programs
    progress.start("shaders", len(together) + len(plan.programs) + len(around_points) + len(at_meshes))
    # Programs share the vertex shader, and two may have the same fragment shader.
    texts: dict[str, str] = {}
    changes: dict[str, object] = {"programs": _programs(draft, plan, (*together, *plan.programs), texts, progress)}
    subvolumes = draft.manifest.subvolumes
    if subvolumes is not None:
        programs = _programs(draft, plan, around_points, texts, progress)
        changes["subvolumes"] = subvolumes.model_copy(update={"programs": programs})
    if draft.manifest.proxy is not None:
        programs = _programs(draft, plan, at_meshes, texts, progress)
        changes["proxy"] = draft.manifest.proxy.model_copy(update={"programs": programs})
        texts[draft.manifest.proxy.depth] = depth_shader("es100" if plan.profile.api == "es2.0" else "es300")
    for path, text in texts.items():
        draft.write(path, "shader", text.encode("ascii"))
    return changes


def _programs(
    draft: Draft, plan: Plan, wanted: tuple[ProgramPlan, ...], texts: dict[str, str], progress: Progress
) -> tuple[Program, ...]:
    """Return the records of programs; their texts are added to `texts`, by file."""
    programs = []
    for planned in wanted:
        shaders = _ray_caster(draft, plan, planned)
        texts |= {planned.vertex: shaders.vertex, planned.fragment: shaders.fragment}
        programs.append(
            Program(
                name=planned.name,
                technique=planned.technique,
                classification=planned.classification,
                lighting=planned.lighting,
                vertex=planned.vertex,
                fragment=planned.fragment,
                levels=planned.levels,
                transfer=planned.transfer,
                uniforms=shaders.uniforms,
                samplers=shaders.samplers,
                step_mm_min=shaders.step_mm_min,
            )
        )
        progress.advance()
    return tuple(programs)


def _ray_caster(draft: Draft, plan: Plan, program: ProgramPlan) -> RayCaster:
    if plan.together is not None and program in plan.together.programs:
        return _ray_caster_together(draft, plan, program, plan.together.transfers)
    manifest = draft.manifest
    classified = classification(program.classification, program.transfer, manifest.textures, manifest.palettes)
    z, y, x = plan.grid.extent_mm_zyx
    # Blocks of a level are not blocks of its pieces.
    whole_levels = program.technique != "raycast_subvolumes"
    # A draft may still hold tables that are no longer wanted.
    skips = whole_levels and any(each.transfer == program.transfer for each in _skip_tables(plan))
    additions = Additions(
        skipping_of(manifest, program.transfer, program.levels[0], program.classification) if skips else None,
        _lighting(draft, plan, program),
        Entry((x, y, z), min(plan.grid.spacing_mm_zyx)) if program.vertex == PROXY_VERTEX else None,
    )
    return ray_caster(_sampling(draft, plan, program), classified, (x, y, z), plan.render, additions)


def _ray_caster_together(draft: Draft, plan: Plan, program: ProgramPlan, transfers: tuple[str, ...]) -> RayCaster:
    channel_of = {function.name: each.channel or "" for each in plan.every for function in each.transfer_functions}
    sampling, classified = drawn_together(
        draft.manifest,
        {name: channel_of[name] for name in transfers},
        program.levels[0],
        _spacing_mm_zyx(plan, program.levels[0]),
        program.classification,
    )
    z, y, x = plan.grid.extent_mm_zyx
    skips = plan.together is not None and plan.together.skip_tables
    skipping = skipping_of(draft.manifest, program.transfer, program.levels[0], program.classification)
    return ray_caster(sampling, classified, (x, y, z), plan.render, Additions(skipping if skips else None))


def _skip_tables(plan: Plan) -> tuple[SkipTablePlan, ...]:
    return () if plan.skip is None else plan.skip.tables


def _lighting(draft: Draft, plan: Plan, program: ProgramPlan) -> Lighting | None:
    if program.lighting == "none" or plan.normals is None:
        return None
    # The program of 3D textures draws all levels: the code of normals, which its text holds, is the same for all.
    planned = next(each for each in plan.normals.textures if each.level == program.levels[0])
    return headlight(next(each for each in draft.manifest.textures if each.name == planned.names[0]))


def _sampling(draft: Draft, plan: Plan, program: ProgramPlan) -> Sampling:
    if program.technique == "raycast_texture3d":
        finest, classified = plan.volumes[0], program.classification == "preclassified"
        component = None if classified else _component(plan, finest)
        return raycast_texture3d.sampling(component, mipmaps=finest.mipmap is not None)
    if program.technique == "raycast_subvolumes":
        return raycast_subvolumes.sampling(plan.grid.spacing_mm_zyx)
    if program.technique == "raycast_bricks":
        return raycast_bricks.sampling_of(draft.manifest, program.levels[0])
    # The layout is constant in the shader, so a mosaic's program draws one level.
    (level,) = program.levels
    volume = next(each for each in plan.volumes if each.level == level)
    if volume.mosaic is None:
        msg = f"program {program.name} draws level {level}, which is no mosaic"
        raise ValueError(msg)
    component = _component(plan, volume)
    return raycast_mosaic.sampling(volume.mosaic, _spacing_mm_zyx(plan, level), component, volume.filter)


def _spacing_mm_zyx(plan: Plan, level: int) -> tuple[float, float, float]:
    return plan.grid.coarser(plan.level(level).factors_zyx).spacing_mm_zyx


def _component(plan: Plan, volume: VolumePlan) -> str:
    """Letter of the component of the texels that holds the plan's channel."""
    pixels = gl_format(volume.format, "TEXTURE_2D" if volume.mosaic else "TEXTURE_3D", plan.profile.api).format
    return component_letter(pixels, volume.channels.index(plan.channel or "") if volume.channels else 0)


STAGE = Stage(
    name="shaders", reads=("transfer", "normals", "bricks", "skip", "proxy", "grid"), settings=_settings, run=_run
)
