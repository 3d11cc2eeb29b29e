"""Shaders are composed and specialised: the text that the package ships and the reference renderer runs."""

from volprep.parts.stage import Changes, Stage, present
from volprep.plan.products import ProgramPlan
from volprep.plan.records import Plan
from volprep.shading.program import compose_program
from volprep.shading.rays import depth_shader
from volprep_formats.package.program import Program
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


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
    package = Package(draft.folder, draft.manifest)
    programs = []
    for planned in wanted:
        shaders = compose_program(package, planned, plan.render, skips=_skips(plan, planned))
        texts |= {planned.vertex: shaders.vertex, planned.fragment: shaders.fragment}
        programs.append(
            Program(
                **dict(planned),
                uniforms=shaders.uniforms,
                samplers=shaders.samplers,
                step_mm_min=shaders.step_mm_min,
            )
        )
        progress.advance()
    return tuple(programs)


def _skips(plan: Plan, program: ProgramPlan) -> bool:
    """Return whether the plan has a skip table for a program: a draft may still hold tables of an earlier plan."""
    tables = () if plan.skip is None else plan.skip.tables
    together = () if plan.together is None else plan.together.skip_tables
    return any(table.transfer == program.transfer for table in (*tables, *together))


STAGE = Stage(
    name="shaders", reads=("transfer", "normals", "bricks", "skip", "proxy", "grid"), settings=_settings, run=_run
)
