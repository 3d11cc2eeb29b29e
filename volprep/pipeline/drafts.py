"""Drafts carried on verb by verb: begun by importing a source, finished by seal."""

from collections.abc import Callable
from pathlib import Path

from volprep.pipeline.import_draft import scene_of
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.stages import STAGES, require_inputs, run_stage
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress


def run_verb(folder: Path, name: str, change: Callable[[Scene], Scene], progress: Progress) -> Draft:
    """Run one stage on the draft at `folder`, after `change` has changed what the user wants.

    Raises VP4001 to VP4006 for what is no draft, VP3023 and VP4040 if the stage is not needed or its inputs are
    missing, and what the stage raises.
    """
    draft = Draft.open(folder)
    scene = change(scene_of(draft))
    plan = plan_draft(draft, scene, draft.manifest.profile, progress)
    stage = next(stage for stage in STAGES if stage.name == name)
    require_inputs(draft, stage, plan)
    run_stage(draft, stage, plan, scene, progress)
    if draft.manifest.state == "sealed":
        require_sound(folder)
    return draft


def require_sound(package: Path) -> None:
    """Raise VP4042 if what was built does not pass the check that every reader of packages may make."""
    findings = check(package)
    if findings:
        raise VolprepError("VP4042", finding=f"{findings[0].code} {findings[0].summary}")
