"""Drafts carried on verb by verb: begun by importing a source, finished by seal."""

from collections.abc import Callable
from pathlib import Path

from volprep.parts.level_choices import choices_of
from volprep.pipeline.import_draft import scene_of
from volprep.pipeline.origin import Origin, read_origin, write_origin
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.stage_graph import STAGES
from volprep.pipeline.stages import keep_wishes, run_sources, run_stage
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress


def run_verb(folder: Path, name: str, change: Callable[[Scene], Scene], progress: Progress) -> Draft:
    """Run one stage on the draft at `folder`, after `change` has changed what the user wants.

    Stages that it reads run again first if the change concerns them, too. If the change takes away what the stage
    makes, for example `volprep stage skip --kind none`, this is dropped from the draft. If the stage seals the draft,
    the origin beside it gets the scene that the verbs have made of the first one. Raises VP4001 to VP4006 for an
    invalid draft, VP3023 if the scene does not need the stage, VP4040 if a stage that it reads has not run, and the
    errors of the stages.
    """
    draft = Draft.open(folder)
    before = scene_of(draft)
    scene = change(before)
    plan = plan_draft(draft, scene, draft.manifest.profile, progress)
    stage = next(stage for stage in STAGES if stage.name == name)
    if name not in plan.stages:
        if scene == before:
            raise VolprepError("VP3023", profile=plan.shared.profile.name, stage=name, needed=", ".join(plan.stages))
        keep_wishes(draft, plan, scene)
        return draft
    run_sources(draft, stage, plan, scene, progress)
    # Records of trials and choices go with the working data when the draft is sealed.
    made = tuple(choice.without_tables for channel in plan.channels for choice in choices_of(draft, channel))
    run_stage(draft, stage, plan, scene, progress)
    if draft.manifest.state != "sealed" and scene_of(draft) != scene:
        # The change concerns no stage that ran, but later ones.
        keep_wishes(draft, plan, scene)
    if draft.manifest.state == "sealed":
        require_sound(folder)
        older = read_origin(folder)
        if older is not None:
            # Only it says where the scan is; the draft does not.
            sealed = scene.with_source(older.scene.source)
            profile = draft.manifest.profile
            origin = Origin(scene_path=older.scene_path, scene=sealed, profile=profile, levels=made, forms=plan.forms)
            write_origin(folder, origin)
    return draft


def require_sound(package: Path) -> None:
    """Raise VP4042 if the build does not pass the check that readers of packages run."""
    findings = check(package)
    if findings:
        raise VolprepError("VP4042", finding=f"{findings[0].code} {findings[0].summary}")
