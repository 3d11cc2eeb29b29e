"""Run stages on a draft, each only if its settings or its inputs have changed."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence

from volprep.parts.level_choices import choices_of
from volprep.parts.stage import Planned, Stage, Work
from volprep.parts.work import FORMS, SCENE, frame_drafts, is_current, scene_bytes
from volprep.pipeline.seal import STAGE as SEAL
from volprep.pipeline.seal import settled
from volprep.pipeline.stage_graph import STAGES, dependents, sources
from volprep.plan.level_choice import LevelChoice, MeasuredStep
from volprep.plan.pictures import pictures_of
from volprep.plan.records import ChannelPlan, Plan
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.manifest import Contribution, Heading, Manifest, PlanItem, StageRecord
from volprep_formats.package.parts.segments.record import Segments
from volprep_formats.package.program import LevelStep, RaySampling
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

_Key = tuple[str | None, int]
"""Channel and level."""


def with_measured_steps(drafts: Sequence[Draft], plan: Plan) -> Plan:
    """Return the plan with the steps that were measured when levels were made.

    Of several channels, and of the frames of a series, each with a draft, the finest step counts. Without such levels
    the plan is returned as it is.
    """
    if not plan.shared.measure_steps:
        return plan
    measured: dict[_Key, MeasuredStep] = {}
    for channel in plan.channels:
        for choice in (choice for draft in drafts for choice in choices_of(draft, channel)):
            key = channel.channel, choice.level
            if choice.step is not None and (key not in measured or choice.step.step_mm < measured[key].step_mm):
                measured[key] = choice.step
    if not measured:
        return plan
    shared = plan.shared.model_copy(update={"rays": _rays(plan, measured)})
    channels = tuple(
        channel.model_copy(update={"shared": channel.shared.model_copy(update={"rays": shared.rays})})
        for channel in plan.channels
    )
    items = tuple(_described(item, measured, shared.rays) for item in plan.items)
    return plan.model_copy(update={"shared": shared, "channels": channels, "items": items})


def _rays(plan: Plan, measured: Mapping[_Key, MeasuredStep]) -> RaySampling:
    planned = plan.shared.rays
    indices = sorted({level.index for channel in plan.channels for level in channel.levels})
    by_level = {index: _finest(plan.channels, index, measured, planned) for index in indices}
    kept = {step.level: step.step_mm for step in planned.level_steps if step.level not in by_level}
    by_level |= kept
    first = by_level[indices[0]]
    others = (LevelStep(level=index, step_mm=step) for index, step in sorted(by_level.items()) if step != first)
    return planned.model_copy(update={"step_mm": first, "level_steps": tuple(others)})


def _finest(
    channels: tuple[ChannelPlan, ...], index: int, measured: Mapping[_Key, MeasuredStep], planned: RaySampling
) -> float:
    """Return the finest step of a level that was measured in any channel; the planned one if none was."""
    found = [measured[channel.channel, index].step_mm for channel in channels if (channel.channel, index) in measured]
    return min(found, default=planned.step_of(index))


def _described(item: PlanItem, measured: Mapping[_Key, MeasuredStep], rays: RaySampling) -> PlanItem:
    """Return an item about a step with the measurement."""
    found = None if item.kind != "step" or item.level is None else measured.get((item.channel, item.level))
    if found is None or item.level is None:
        return item
    step_mm = rays.step_of(item.level)
    shared = "" if step_mm == found.step_mm else f"; here {step_mm:.3g} mm, for another channel"
    return item.model_copy(update={"reason": f"{found.step_mm:.3g} mm, {found.reason}{shared}"})


ORDER = tuple(stage.name for stage in STAGES)
"""Names of the stages, in the order of their output in a manifest."""


def run_stages(draft: Draft, plan: Plan, scene: Scene, progress: Progress) -> tuple[LevelChoice, ...]:
    """Run the stages that the plan needs and that have not run with these settings and inputs.

    Returns how the levels were made: the working data that says it goes when the draft is sealed.
    """
    choices: tuple[LevelChoice, ...] = ()
    for stage in STAGES:
        if stage is SEAL:
            choices = tuple(choice for channel in plan.channels for choice in choices_of(draft, channel))
        if stage.name in plan.stages:
            run_stage(draft, stage, plan, scene, progress)
    return choices


def run_stage(draft: Draft, stage: Stage, plan: Plan, scene: Scene, progress: Progress) -> None:
    """Run one stage, unless neither its settings nor its inputs have changed since it last ran.

    Most stages also run for the later frames of a series.
    """
    later = frame_drafts(draft)
    plan = with_measured_steps((draft, *later), plan)
    for frame_draft in (draft, *(later if stage.each_frame else ())):
        _run(frame_draft, stage, plan, scene, progress)


def _run(draft: Draft, stage: Stage, plan: Plan, scene: Scene, progress: Progress) -> None:
    key = stage_key(stage, plan, draft.manifest)
    if is_current(stage.name, key, draft.manifest):
        return
    record = StageRecord(name=stage.name, key=key, made=tuple(_made(stage, draft, plan, progress)))
    _write_wishes(draft, plan, scene)
    heading = _heading(plan, scene, settled(draft, plan) if stage is SEAL else plan.items)
    heading = heading.model_copy(update={"frames": draft.manifest.frames})
    # The output of its readers rests on the older one.
    stale = dependents(stage.name) | _unplanned(plan)
    draft.commit(record, heading, stale, order=ORDER, seal=stage is SEAL)


def _unplanned(plan: Plan) -> set[str]:
    """Return the names of the stages that a plan does not need."""
    return {stage.name for stage in STAGES if stage.name not in plan.stages}


def _made(stage: Stage, draft: Draft, plan: Plan, progress: Progress) -> Iterator[Contribution]:
    """Return the output of a stage. Raises VP4042 if a texture is not as large as its budget was checked for."""
    if stage.package is not None:
        yield _done(stage.package, draft, plan, progress)
    if stage.channel is not None:
        for channel in plan.channels:
            yield _done(stage.channel, draft, channel, progress)


def _done(work: Work[Planned], draft: Draft, plan: Planned, progress: Progress) -> Contribution:
    made = work.run(draft, plan, progress)
    found = {texture.file: texture.shape_zyx for texture in made.textures}
    planned = found if work.shapes is None else work.shapes(draft, plan)
    if found != planned:
        raise VolprepError("VP4042", finding=f"textures are {found}, planned {planned}")
    return made


def _heading(plan: Plan, scene: Scene, items: tuple[PlanItem, ...]) -> Heading:
    return Heading(
        name=scene.name,
        generator=generator(),
        profile=plan.shared.profile,
        grid=plan.shared.grid,
        pictures=pictures_of(plan),
        segments=_segments(plan),
        compression=tuple(form.as_record for form in plan.forms),
        render=plan.shared.render,
        plan=items,
    )


def _segments(plan: Plan) -> Segments | None:
    wanted = plan.segments
    return None if wanted is None else Segments(**{name: getattr(wanted, name) for name in Segments.model_fields})


def stage_key(stage: Stage, plan: Plan, manifest: Manifest) -> str:
    """Digest of all dependencies of a stage: program, profile, settings, and the output that it reads."""
    keys = {record.name: record.key for record in manifest.stages}
    text = json.dumps(
        {
            "stage": stage.name,
            "generator": generator(),
            "profile": plan.shared.profile.model_dump(mode="json"),
            "settings": [record.model_dump(mode="json") for record in _settings(stage, plan)],
            "reads": {name: keys[name] for name in stage.reads if name in keys and name in plan.stages},
        },
        sort_keys=True,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def _settings(stage: Stage, plan: Plan) -> Iterator[Record]:
    if stage.package is not None:
        yield from stage.package.settings(plan)
    if stage.channel is not None:
        for channel in plan.channels:
            yield from stage.channel.settings(channel)


def keep_wishes(draft: Draft, plan: Plan, scene: Scene) -> None:
    """Keep a changed scene in the draft, and drop the output of stages that its plan no longer needs."""
    _write_wishes(draft, plan, scene)
    gone = _unplanned(plan) & {record.name for record in draft.manifest.stages}
    stale = gone.union(*(dependents(name) for name in gone))
    draft.drop(stale, _heading(plan, scene, plan.items))


def _write_wishes(draft: Draft, plan: Plan, scene: Scene) -> None:
    """Write the scene of a draft, and the forms that were tried for it: the next verb goes on with them."""
    draft.write(SCENE, "work", scene_bytes(scene))
    if plan.forms:
        draft.write(FORMS, "work", json.dumps([form.model_dump(mode="json") for form in plan.forms]).encode())


def run_sources(draft: Draft, stage: Stage, plan: Plan, scene: Scene, progress: Progress) -> None:
    """Run again the stages that a stage uses if their settings have changed since they ran.

    Raises VP4040 if one of them has never run, or has to run again because one that it uses did.
    """
    for other in sources(stage, plan):
        if is_current(other.name, stage_key(other, plan, draft.manifest), draft.manifest):
            continue
        if all(record.name != other.name for record in draft.manifest.stages):
            raise VolprepError("VP4040", path=draft.folder, stage=stage.name, missing=other.name)
        run_stage(draft, other, plan, scene, progress)
