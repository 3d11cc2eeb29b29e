"""The main job: a scene becomes a sealed package. It gets its name only when it is complete."""

import fcntl
import math
import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep.pipeline.drafts import require_sound
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.machine_start import START, start_of_machine
from volprep.pipeline.make_plan import Scanned, make_plan
from volprep.pipeline.origin import Origin, read_origin, write_origin
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import Prepared, prepare
from volprep.pipeline.stages import run_stages
from volprep.plan.device_files import require_same_scan
from volprep.plan.device_records import DeviceRecord
from volprep.plan.level_choice import LevelChoice
from volprep.plan.records import Plan
from volprep.scan.import_segments import find_segments
from volprep.scan.in_memory import InMemory
from volprep.scan.statistics import measure
from volprep.scene.channels import SceneChannel
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.output import output_errors
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.publish import check_target, publish
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress


def check_replaced(request: Request, target: Path, *, force: bool) -> bool:
    """Return whether there is a package at `target` that the build will replace.

    A package that was built of the same scene file, or of the same scan without one, may be replaced. Raises VP1303 for
    another one, unless `force` is given, and VP4020 if the folder of `target` may not be entered.
    """
    with output_errors(target):
        there = (target / MANIFEST).exists()
    if not there:
        return False
    try:
        origin = read_origin(target.absolute())
    except VolprepError:
        origin = None
    if origin is not None:
        here = None if request.scene_path is None else path_text(request.scene_path)
        same_scan = origin.scene.source.path == request.scene.source.path
        if origin.scene_path == here and (here is not None or same_scan):
            return True
    if not force:
        raise VolprepError("VP1303", path=target)
    return True


_MOST_KEPT = 128_000_000
"""Bytes of a scan that is kept in memory while it is planned without being imported."""


# Decoders start once, not each time that a source is opened: a third of a second for each channel of a stack in colour.
@workers()
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
    prepared = prepare(request)
    partial = target.with_name(f".{target.name}.partial")
    with _locked(partial, target):
        _require_drawing(prepared)
        start = start_of_machine()
        _drop_unusable(partial, start)
        imported = import_draft(prepared, partial, progress, start)
        draft, scene = imported.draft, imported.scene
        progress.start("plan", 1)
        # Trying compressed forms begins tasks of its own.
        progress.advance()
        plan = plan_draft(draft, scene, prepared.profile, progress, imported.measured)
        made = run_stages(draft, plan, scene, progress)
        progress.start("check", 1)
        require_sound(partial)
        progress.advance()
        # Before the package, so that a package never stands without it.
        write_origin(target, _origin(prepared, scene, plan, made))
        publish(partial, target)
        return draft.manifest


def _require_drawing(prepared: Prepared) -> None:
    """Raise VP5001 where the preview cannot be drawn, before the time of all other stages is spent."""
    from volprep.render.egl import require_library  # noqa: PLC0415 - a plan needs no OpenGL, a build always

    require_library(prepared.profile.api)


def _origin(prepared: Prepared, scene: Scene, plan: Plan, made: tuple[LevelChoice, ...]) -> Origin:
    scene_path = None if prepared.scene_path is None else path_text(prepared.scene_path)
    levels = tuple(choice.without_tables for choice in made)
    return Origin(scene_path=scene_path, scene=scene, profile=prepared.profile, levels=levels, forms=plan.forms)


@workers()
def plan_build(request: Request, progress: Progress, device: tuple[Path, DeviceRecord] | None = None) -> Plan:
    """Return the plan of a scene without building anything: one pass over the source. Raises the errors of `build`.

    Of a scan of more than 128 MB the steps are an estimate, along rays through parts of it: a build may choose others.

    With a measurement of a `device`, and its file, also VP7037 if that is of another scan or profile.
    """
    prepared, read = _read(request, progress)
    if device is not None:
        sources = {channel.name: source.measured.sha256 for channel, source in read}
        require_same_scan(*device, prepared.profile.name, sources)
    scanned = [value for _, value in read]
    if prepared.frames:
        scanned = [_with_frames(prepared, scanned[0], progress)]
    segmented = [find_segments(wanted, scanned[0].info.grid, progress) for wanted in prepared.segments]
    measured = [(channel.info, channel.measured) for channel in scanned]
    scene = prepared.looked_at(measured, (segments for segments, _ in segmented))
    segments, labels = next(((segments, InMemory.of(found)) for segments, found in segmented), (None, None))
    return make_plan(scene, prepared.profile, scanned, segments, labels)


def scan_digests(request: Request, progress: Progress) -> dict[str, str]:
    """Return the digest of each channel's scan, by the name of the channel, as a manifest has it."""
    _, read = _read(request, progress)
    return {channel.name: source.measured.sha256 for channel, source in read}


def _read(request: Request, progress: Progress) -> tuple[Prepared, list[tuple[SceneChannel, Scanned]]]:
    prepared = prepare(request)
    try:
        return prepared, _measured(prepared, progress)
    except VolprepError as error:
        prepared = prepared.after(error)
        return prepared, _measured(prepared, progress)


def _measured(prepared: Prepared, progress: Progress) -> list[tuple[SceneChannel, Scanned]]:
    found = []
    for channel, info, source in prepared.sources(progress):
        size = math.prod(info.grid.shape_zyx) * np.dtype(info.stored_type).itemsize
        if size > _MOST_KEPT:
            found.append((channel, Scanned(info, measure(source, progress))))
            continue
        slabs: list[NDArray[np.generic]] = []
        measured = measure(source, progress, keep=slabs.append)
        found.append((channel, Scanned(info, measured, voxels=InMemory.of(np.concatenate(slabs)))))
    return found


def _with_frames(prepared: Prepared, first: Scanned, progress: Progress) -> Scanned:
    """Measure the later frames of a series; keep the voxels of the frame that represents all."""
    found, voxels = first.measured, first.voxels
    frames = tuple(frame for _, frame in prepared.frames)
    for number, source in enumerate(prepared.later_frames(first.info, progress), 1):
        slabs: list[NDArray[np.generic]] = []
        later = measure(source, progress, keep=slabs.append if voxels is not None else None)
        found = found.with_frame(later, number, len(frames))
        if voxels is not None and found.frame == number:
            voxels = InMemory.of(np.concatenate(slabs))
    return replace(first, measured=found, voxels=voxels, frames=frames)


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
            # The build that held it has just published it: the lock is on the finished package.
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


def _drop_unusable(partial: Path, start: bytes) -> None:
    """Empty the folder if what a killed build left is of no use: a sealed package, or one of another version.

    So is a draft of another start of the machine. The folder itself stays, because it is the lock.
    """
    try:
        draft = Draft.open(partial)
        is_usable = not start or draft.read_bytes(START) == start
    except VolprepError:
        is_usable = False
    if not is_usable:
        with output_errors(partial):
            _empty(partial)


def _empty(folder: Path) -> None:
    for child in folder.iterdir():
        if child.is_dir() and not child.is_symlink():
            shutil.rmtree(child)
        else:
            child.unlink()
