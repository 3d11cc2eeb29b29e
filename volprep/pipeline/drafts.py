"""Drafts carried on verb by verb: begun by importing a source, finished by seal."""

from collections.abc import Callable
from pathlib import Path

from volprep.parts.levels.chosen import choices_of
from volprep.pipeline.import_draft import scene_of
from volprep.pipeline.origin import Origin, read_origin, write_origin
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.stages import STAGES, require_inputs, run_stage
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress


def run_verb(folder: Path, name: str, change: Callable[[Scene], Scene], progress: Progress) -> Draft:
    """Run one stage on the draft at `folder`, after `change` has changed what the user wants.

    If it seals the draft, the origin beside it gets the scene that the verbs have made of the first one. Raises VP4001
    to VP4006 for what is no draft, VP3023 and VP4040 if the stage is not needed or its inputs are missing, and what
    the stage raises.
    """
    draft = Draft.open(folder)
    scene = change(scene_of(draft))
    plan = plan_draft(draft, scene, draft.manifest.profile, progress)
    stage = next(stage for stage in STAGES if stage.name == name)
    require_inputs(draft, stage, plan)
    # What tried and chose goes with the working data when the draft is sealed.
    made = tuple(choice.without_tables for channel in plan.channels for choice in choices_of(draft, channel))
    run_stage(draft, stage, plan, scene, progress)
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
    """Raise VP4042 if what was built does not pass the check that every reader of packages may make."""
    findings = check(package)
    if findings:
        raise VolprepError("VP4042", finding=f"{findings[0].code} {findings[0].summary}")
