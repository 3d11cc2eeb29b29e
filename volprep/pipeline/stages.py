"""The visible list of stages, and how a draft goes through them."""

import hashlib
import json
from collections.abc import Iterator

from volprep.parts.bricks.stage import STAGE as BRICKS
from volprep.parts.classification.stage import STAGE as TRANSFER
from volprep.parts.levels.chosen import choices_of
from volprep.parts.levels.records import LevelChoice
from volprep.parts.levels.stage import STAGE as PYRAMID
from volprep.parts.mosaic.stage import STAGE as MOSAIC
from volprep.parts.normals.stage import STAGE as NORMALS
from volprep.parts.programs.stage import STAGE as SHADERS
from volprep.parts.proxy.stage import STAGE as PROXY
from volprep.parts.skip.stage import STAGE as SKIP
from volprep.parts.slices.stage import STAGE as SLICES
from volprep.parts.stage import Planned, Stage, Work
from volprep.parts.subvolumes.stage import STAGE as GRID
from volprep.parts.texture.stage import STAGE as TEXTURE
from volprep.parts.values.stage import STAGE as QUANTIZE
from volprep.parts.work import FORMS, SCENE, generator, is_current, scene_bytes
from volprep.pipeline.seal import STAGE as SEAL
from volprep.pipeline.seal import settled
from volprep.plan.records import Plan
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Contribution, Heading, Manifest, PlanItem, StageRecord
from volprep_formats.package.parts.together.record import Together
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

STAGES: tuple[Stage, ...] = (
    QUANTIZE,
    PYRAMID,
    TRANSFER,
    NORMALS,
    MOSAIC,
    TEXTURE,
    BRICKS,
    SKIP,
    PROXY,
    GRID,
    SLICES,
    SHADERS,
    SEAL,
)
"""The stages that follow import, in order. Import comes before the plan, which needs what it measures."""


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
    """Run one stage, unless neither its settings nor its inputs have changed since it last ran."""
    key = stage_key(stage, plan, draft.manifest)
    if is_current(stage.name, key, draft.manifest):
        return
    record = StageRecord(name=stage.name, key=key, made=tuple(_made(stage, draft, plan, progress)))
    # Every step leaves the scene that it was made for; only drafts hold it.
    draft.write(SCENE, "work", scene_bytes(scene))
    if plan.forms:
        draft.write(FORMS, "work", json.dumps([form.model_dump(mode="json") for form in plan.forms]).encode())
    heading = _heading(plan, scene, settled(draft, plan) if stage is SEAL else plan.items)
    names = [each.name for each in STAGES]
    # Of a draft whose stages ran in another order, or for another scene, nothing may stay that rests on older things.
    stale = {name for name in names if name not in plan.stages or names.index(name) > names.index(stage.name)}
    draft.commit(record, heading, stale, seal=stage is SEAL)


def _made(stage: Stage, draft: Draft, plan: Plan, progress: Progress) -> Iterator[Contribution]:
    """Return what a stage makes. Raises VP4042 if a texture is not as large as its budget was checked for."""
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
    wanted = plan.together
    return Heading(
        name=scene.name,
        generator=generator(),
        profile=plan.shared.profile,
        grid=plan.shared.grid,
        together=None if wanted is None else Together(name=wanted.name, transfers=wanted.transfers),
        compression=tuple(form.as_record for form in plan.forms),
        render=plan.shared.render,
        plan=items,
    )


def stage_key(stage: Stage, plan: Plan, manifest: Manifest) -> str:
    """Digest of all that the output of a stage depends on: program, profile, settings, and what it reads."""
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


def require_inputs(draft: Draft, stage: Stage, plan: Plan) -> None:
    """Raise VP3023 if the plan does not need a stage, VP4040 if a stage that it reads has not run."""
    if stage.name not in plan.stages:
        profile = plan.shared.profile.name
        raise VolprepError("VP3023", profile=profile, stage=stage.name, needed=", ".join(plan.stages))
    for other in STAGES:
        if other.name not in stage.reads or other.name not in plan.stages:
            continue
        if not is_current(other.name, stage_key(other, plan, draft.manifest), draft.manifest):
            raise VolprepError("VP4040", path=draft.folder, stage=stage.name, missing=other.name)
