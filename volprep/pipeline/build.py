"""The main job: a scene becomes a sealed package. It gets its name only when it is complete."""

import fcntl
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from volprep.pipeline.drafts import import_draft, require_sound, scene_of
from volprep.pipeline.make_plans import make_plans
from volprep.pipeline.origin import Origin, write_origin
from volprep.pipeline.stages import plan_draft, run_stages
from volprep.plan.records import Plan
from volprep.scan.channels import opened_channel
from volprep.scan.statistics import Measured, measure
from volprep.scene.channels import drawn_channels, with_listed_channels
from volprep.scene.request import Request, with_grey_ramp
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import output_errors
from volprep_formats.package.storage.publish import check_target, publish
from volprep_formats.progress import Progress
from volprep_formats.source import SourceInfo


def build(request: Request, target: Path, progress: Progress) -> Manifest:
    """Build the package of a scene at `target`; an older package there stays until the new one is whole.

    The draft lies beside the target, under the hidden name .NAME.partial. A killed build leaves it; the next one
    goes on after the last stage that was done. Raises VP4021 and VP4022 if something else is at the target, VP4041
    while another build is making the same package, VP402x where nothing can be written, and what stages raise.
    """
    target = target.absolute()
    with output_errors(target):
        target.parent.mkdir(parents=True, exist_ok=True)
    check_target(target)
    partial = target.with_name(f".{target.name}.partial")
    with _locked(partial, target):
        _drop_unusable(partial)
        request = request.with_listed_channels()
        imported = import_draft(request, partial, progress)
        draft = imported.draft
        progress.start("plan", 1)
        # Trying compressed forms begins tasks of its own.
        progress.advance()
        # Import gave a scan without a scene its transfer function.
        scene = scene_of(draft) if request.scene_path is None else request.scene
        plan = plan_draft(draft, scene, request.profile, imported.measured, progress)
        made = run_stages(draft, plan, scene, progress)
        progress.start("check", 1)
        require_sound(partial)
        progress.advance()
        # Before the package, so that a package never stands without it.
        levels = tuple(choice.model_copy(update={"tables": ()}) for choice in made)
        forms = tuple(form for each in plan.every for form in each.forms)
        scene_path = None if request.scene_path is None else str(request.scene_path)
        origin = Origin(scene_path=scene_path, scene=scene, levels=levels, forms=forms)
        write_origin(target, origin)
        publish(partial, target)
        return draft.manifest


def plan_build(request: Request, progress: Progress) -> Plan:
    """Return the plan of a scene without building anything: one pass over the source. Raises what `build` raises."""
    scene = with_listed_channels(request.scene)
    found: list[tuple[SourceInfo, Measured]] = []
    channels = drawn_channels(scene)
    for channel in channels:
        first = (channels[0].name, found[0][0].grid) if found else None
        with opened_channel(channel.name, channel.spec, first, progress) as source:
            found.append((source.info, measure(source, progress)))
    if request.scene_path is None:
        scene = with_grey_ramp(scene, found[0][1].statistics, found[0][0].grid)
    return make_plans(scene, request.profile, [info for info, _ in found], [measured for _, measured in found])


@contextmanager
def _locked(partial: Path, target: Path) -> Iterator[None]:
    """Hold the folder `partial` for this process; the system lets go of it when the process ends, however it ends."""
    with output_errors(target):
        descriptor = _open_folder(partial)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise VolprepError("VP4041", path=target) from error
        if not partial.exists() or not os.path.samestat(os.fstat(descriptor), partial.stat()):
            # The build that held it has just published it: what is locked here is the finished package.
            raise VolprepError("VP4041", path=target)
        try:
            yield
        except VolprepError:
            # A draft that failed is of no use to anybody; one that was killed is carried on.
            with output_errors(partial):
                _empty(partial)
                partial.rmdir()
            raise
    finally:
        os.close(descriptor)


def _open_folder(partial: Path) -> int:
    partial.mkdir(exist_ok=True)
    return os.open(partial, os.O_RDONLY | os.O_DIRECTORY)


def _drop_unusable(partial: Path) -> None:
    """Empty the folder if a build was killed so that it cannot go on: a package of another version, or a sealed one.

    The folder itself stays, because it is the lock.
    """
    try:
        Draft.open(partial)
    except VolprepError:
        with output_errors(partial):
            _empty(partial)


def _empty(folder: Path) -> None:
    for child in folder.iterdir():
        if child.is_dir() and not child.is_symlink():
            shutil.rmtree(child)
        else:
            child.unlink()
