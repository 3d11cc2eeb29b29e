"""The visible list of stages, and how a draft goes through them."""

import hashlib
import json

from volprep.parts.bricks import stage as bricks
from volprep.parts.classification import stage as transfer
from volprep.parts.compression.whole import WholeSource
from volprep.parts.levels import stage as pyramid
from volprep.parts.levels.chosen import choices_of
from volprep.parts.levels.records import LevelChoice
from volprep.parts.mosaic import stage as mosaic
from volprep.parts.normals import stage as normals
from volprep.parts.programs import stage as shaders
from volprep.parts.proxy import stage as proxy
from volprep.parts.skip import stage as skip
from volprep.parts.slices import stage as slices
from volprep.parts.stage import Stage
from volprep.parts.subvolumes import stage as grid
from volprep.parts.texture import stage as texture
from volprep.parts.values import stage as quantize
from volprep.parts.work import FORMS, SCENE, generator, is_current, scene_bytes, source_volume
from volprep.pipeline import seal
from volprep.pipeline.make_plans import make_plans
from volprep.pipeline.merge import merged, plans_of, with_transfers
from volprep.plan.form_trial import FormTrial
from volprep.plan.records import Plan
from volprep.scan.statistics import Measured, measure_again
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest, StageRecord
from volprep_formats.package.parts.together.record import Together
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress, Silent

STAGES: tuple[Stage, ...] = (
    quantize.STAGE,
    pyramid.STAGE,
    transfer.STAGE,
    normals.STAGE,
    mosaic.STAGE,
    texture.STAGE,
    bricks.STAGE,
    skip.STAGE,
    proxy.STAGE,
    grid.STAGE,
    slices.STAGE,
    shaders.STAGE,
    seal.STAGE,
)
"""The stages that follow import, in order. Import comes before the plan, which needs what it measures."""


def run_stages(draft: Draft, plan: Plan, scene: Scene, progress: Progress) -> tuple[LevelChoice, ...]:
    """Run the stages that the plan needs and that have not run with these settings and inputs.

    Gives how the levels were made: the working data that says it goes when the draft is sealed.
    """
    choices: tuple[LevelChoice, ...] = ()
    for stage in STAGES:
        if stage is seal.STAGE:
            choices = tuple(choice for each in plan.every for choice in choices_of(draft, each))
        if stage.name in plan.stages:
            run_stage(draft, stage, plan, scene, progress)
    return choices


def run_stage(draft: Draft, stage: Stage, plan: Plan, scene: Scene, progress: Progress) -> None:
    """Run one stage, unless neither its settings nor its inputs have changed since it last ran."""
    key = stage_key(stage, plan, draft.manifest)
    if is_current(stage.name, key, draft.manifest):
        return
    each = [(one, stage.run(draft, one, progress)) for one in plans_of(stage, plan)]
    channels = with_transfers(draft.manifest.channels, scene)
    changes = merged(draft.manifest.model_copy(update={"channels": channels}), each, scene)
    # Every step leaves the scene that it was made for; only drafts hold it.
    draft.write(SCENE, "work", scene_bytes(scene))
    forms = [form for each in plan.every for form in each.forms]
    if forms:
        draft.write(FORMS, "work", json.dumps([form.model_dump(mode="json") for form in forms]).encode())
    common = {
        "name": scene.name,
        "channels": channels,
        "generator": generator(),
        "profile": plan.profile,
        "plan": plan.items,
        "render": plan.render,
        "together": _together(plan),
        "compression": tuple(form.as_record for form in forms),
    }
    names = [each.name for each in STAGES]
    # Of a draft whose stages ran in another order, or for another scene, nothing may stay that rests on older things.
    stale = {name for name in names if name not in plan.stages or names.index(name) > names.index(stage.name)}
    draft.commit(StageRecord(name=stage.name, key=key), stale, **(common | dict(changes)))


def _together(plan: Plan) -> Together | None:
    wanted = plan.together
    return None if wanted is None else Together(name=wanted.name, transfers=wanted.transfers)


def stage_key(stage: Stage, plan: Plan, manifest: Manifest) -> str:
    """Digest of all that the output of a stage depends on: program, profile, settings, and what it reads."""
    keys = {record.name: record.key for record in manifest.stages}
    text = json.dumps(
        {
            "stage": stage.name,
            "generator": generator(),
            "profile": plan.profile.model_dump(mode="json"),
            "settings": [
                record.model_dump(mode="json") for one in plans_of(stage, plan) for record in stage.settings(one)
            ],
            "reads": {name: keys[name] for name in stage.reads if name in keys and name in plan.stages},
        },
        sort_keys=True,
    )
    return hashlib.sha256(text.encode()).hexdigest()


def plan_draft(
    draft: Draft,
    scene: Scene,
    profile: DeviceProfile,
    measured: tuple[Measured, ...] | None = None,
    progress: Progress | None = None,
) -> Plan:
    """Make the plan for a draft whose source has been imported; `measured` is what import has just found, if it ran.

    A scene that wants compression has forms tried on the whole source, unless an earlier verb has done it. Raises what
    `make_plans` raises.
    """
    manifest = draft.manifest
    if manifest.channels is None:
        records = [(manifest.source, manifest.statistics, source_volume(draft, None))]
    else:
        records = [(each.source, each.statistics, source_volume(draft, each.name)) for each in manifest.channels]
    if measured is None:
        measured = tuple(measure_again(*record) for record in records)
    tried = _tried(draft)
    wholes = [
        WholeSource(volume, source.info, source.sha256, progress or Silent(), tried) for source, _, volume in records
    ]
    return make_plans(scene, profile, [record[0].info for record in records], measured, wholes)


def _tried(draft: Draft) -> list[FormTrial]:
    """Compressed forms that were tried when an earlier plan was made for the draft."""
    if all(record.path != FORMS for record in draft.manifest.files):
        return []
    return [FormTrial.model_validate(each) for each in json.loads(draft.read_bytes(FORMS))]


def require_inputs(draft: Draft, stage: Stage, plan: Plan) -> None:
    """Raise VP3023 if the plan does not need a stage, VP4040 if a stage that it reads has not run."""
    if stage.name not in plan.stages:
        raise VolprepError("VP3023", profile=plan.profile.name, stage=stage.name, needed=", ".join(plan.stages))
    for other in STAGES:
        if other.name not in stage.reads or other.name not in plan.stages:
            continue
        if not is_current(other.name, stage_key(other, plan, draft.manifest), draft.manifest):
            raise VolprepError("VP4040", path=draft.folder, stage=stage.name, missing=other.name)
