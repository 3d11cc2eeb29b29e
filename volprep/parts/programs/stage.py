"""Shaders are composed and specialised: the text that the package ships and the reference renderer runs."""

from volprep.parts.proxy.decision import VERTEX as PROXY_VERTEX
from volprep.parts.stage import Stage, Work, present
from volprep.plan.products import ProgramPlan, SkipTablePlan, TogetherPlan
from volprep.plan.records import ChannelPlan, Plan, VolumePlan
from volprep.shading import raycast_bricks, raycast_mosaic, raycast_subvolumes, raycast_texture3d
from volprep.shading.classification import classification
from volprep.shading.components import component_letter
from volprep.shading.lighting import Lighting, headlight
from volprep.shading.proxy import Entry, depth_shader
from volprep.shading.raycast import Additions, RayCaster, Sampling, ray_caster
from volprep.shading.skipping import skipping_of
from volprep.shading.together import drawn_together
from volprep_formats.package.channels import channel_views
from volprep_formats.package.manifest import Contribution, SubvolumeFiles
from volprep_formats.package.parts.proxy.record import Proxy
from volprep_formats.package.program import Program
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record
from volprep_formats.textures.gl_formats import gl_format


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (
        plan.grid,
        plan.render,
        *plan.levels,
        *plan.volumes,
        *plan.tables,
        *plan.programs,
        *(() if plan.subvolumes is None else plan.subvolumes.programs),
        *(() if plan.proxy is None else plan.proxy.programs),
    )


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    around_points = () if plan.subvolumes is None or draft.manifest.subvolumes is None else plan.subvolumes.programs
    at_meshes = () if plan.proxy is None or draft.manifest.proxy is None else plan.proxy.programs
    progress.start("shaders", len(plan.programs) + len(around_points) + len(at_meshes))
    # Programs share the vertex shader, and two may have the same fragment shader.
    texts: dict[str, str] = {}
    programs = _programs(draft, plan, plan.programs, texts, progress)
    subvolumes, proxy = draft.manifest.subvolumes, draft.manifest.proxy
    if subvolumes is not None:
        around = _programs(draft, plan, around_points, texts, progress)
        subvolumes = SubvolumeFiles(grid=subvolumes.grid, programs=around)
    if proxy is not None:
        begun = _programs(draft, plan, at_meshes, texts, progress)
        texts[proxy.depth] = depth_shader("es100" if plan.profile.api == "es2.0" else "es300")
        proxy = Proxy(depth=proxy.depth, programs=begun)
    _write(draft, texts)
    return Contribution(programs=programs, subvolumes=subvolumes, proxy=proxy)


def _settings_together(plan: Plan) -> tuple[Record, ...]:
    parts = [(*each.levels, *each.volumes, *each.tables) for each in plan.drawn_together]
    return (*present(plan.together), plan.shared, *(record for part in parts for record in part))


def _run_together(draft: Draft, plan: Plan, progress: Progress) -> Contribution:
    """Write the programs of the picture of several channels."""
    if plan.together is None:
        return Contribution()
    progress.start("shaders", len(plan.together.programs))
    texts: dict[str, str] = {}
    programs = []
    for planned in plan.together.programs:
        shaders = _ray_caster_together(draft, plan, planned, plan.together)
        programs.append(_record(planned, shaders, texts))
        progress.advance()
    _write(draft, texts)
    return Contribution(programs=tuple(programs))


def _write(draft: Draft, texts: dict[str, str]) -> None:
    for path, text in texts.items():
        draft.write(path, "shader", text.encode("ascii"))


def _programs(
    draft: Draft, plan: ChannelPlan, wanted: tuple[ProgramPlan, ...], texts: dict[str, str], progress: Progress
) -> tuple[Program, ...]:
    """Return the records of programs; their texts are added to `texts`, by file."""
    programs = []
    for planned in wanted:
        programs.append(_record(planned, _ray_caster(draft, plan, planned), texts))
        progress.advance()
    return tuple(programs)


def _record(planned: ProgramPlan, shaders: RayCaster, texts: dict[str, str]) -> Program:
    texts |= {planned.vertex: shaders.vertex, planned.fragment: shaders.fragment}
    return Program(
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


def _ray_caster(draft: Draft, plan: ChannelPlan, program: ProgramPlan) -> RayCaster:
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


def _ray_caster_together(draft: Draft, plan: Plan, program: ProgramPlan, together: TogetherPlan) -> RayCaster:
    group = plan.drawn_together
    channel_of = {name: each.channel for name, each in zip(together.transfers, group, strict=True)}
    spacing_mm_zyx = _spacing_mm_zyx(group[0], program.levels[0])
    sampling, classified = drawn_together(
        draft.manifest, channel_of, program.levels[0], spacing_mm_zyx, program.classification
    )
    z, y, x = plan.shared.grid.extent_mm_zyx
    skipping = None
    if together.skip_tables:
        skipping = skipping_of(draft.manifest, program.transfer, program.levels[0], program.classification)
    return ray_caster(sampling, classified, (x, y, z), plan.shared.render, Additions(skipping))


def _skip_tables(plan: ChannelPlan) -> tuple[SkipTablePlan, ...]:
    return () if plan.skip is None else plan.skip.tables


def _lighting(draft: Draft, plan: ChannelPlan, program: ProgramPlan) -> Lighting | None:
    if program.lighting == "none" or plan.normals is None:
        return None
    # The program of 3D textures draws all levels: the code of normals, which its text holds, is the same for all.
    planned = next(each for each in plan.normals.textures if each.level == program.levels[0])
    return headlight(next(each for each in draft.manifest.textures if each.name == planned.names[0]))


def _sampling(draft: Draft, plan: ChannelPlan, program: ProgramPlan) -> Sampling:
    if program.technique == "raycast_texture3d":
        finest, classified = plan.volumes[0], program.classification == "preclassified"
        component = None if classified else _component(plan, finest)
        return raycast_texture3d.sampling(component, mipmaps=finest.mipmap is not None)
    if program.technique == "raycast_subvolumes":
        return raycast_subvolumes.sampling(plan.grid.spacing_mm_zyx)
    if program.technique == "raycast_bricks":
        return raycast_bricks.sampling_of(channel_views(draft.manifest)[plan.channel], program.levels[0])
    # The layout is constant in the shader, so a mosaic's program draws one level.
    (level,) = program.levels
    volume = next(each for each in plan.volumes if each.level == level)
    if volume.mosaic is None:
        msg = f"program {program.name} draws level {level}, which is no mosaic"
        raise ValueError(msg)
    component = _component(plan, volume)
    return raycast_mosaic.sampling(volume.mosaic, _spacing_mm_zyx(plan, level), component, volume.filter)


def _spacing_mm_zyx(plan: ChannelPlan, level: int) -> tuple[float, float, float]:
    return plan.grid.coarser(plan.level(level).factors_zyx).spacing_mm_zyx


def _component(plan: ChannelPlan, volume: VolumePlan) -> str:
    """Letter of the component of the texels that holds the plan's channel."""
    pixels = gl_format(volume.format, "TEXTURE_2D" if volume.mosaic else "TEXTURE_3D", plan.profile.api).format
    return component_letter(pixels, volume.channels.index(plan.channel))


STAGE = Stage(
    name="shaders",
    reads=("transfer", "normals", "bricks", "skip", "proxy", "grid"),
    channel=Work(_settings, _run),
    package=Work(_settings_together, _run_together),
)
