"""The stage import: the source becomes working data of a draft, and is measured in the same pass.

It comes before the plan, which needs its measurements. This file needs neither the plan nor OpenGL, so that `volprep
import` starts at once.
"""

import hashlib
import shutil
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from volprep.parts.work import SCENE, is_current, scene_bytes
from volprep.pipeline.machine_start import START
from volprep.pipeline.origin import Origin, write_origin
from volprep.pipeline.prepare import Prepared, prepare
from volprep.scan.frames import UNTIMED
from volprep.scan.import_segments import import_segments
from volprep.scan.import_volume import NAME, import_key, import_volume
from volprep.scan.statistics import Measured
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.output import output_errors
from volprep_formats.package.channel import ChannelPart, SourceRecord
from volprep_formats.package.manifest import Contribution, Heading, StageRecord
from volprep_formats.package.storage.draft import Draft, require_room
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.package.storage.publish import remove_package
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress


def begin_draft(request: Request, folder: Path, progress: Progress) -> Draft:
    """Import a source into the draft at `folder`: a new one, which vanishes if that fails, or one that is there.

    Raises the errors of `import_draft`, before anything is read where `folder` is in the way.
    """
    with output_errors(folder):
        is_new = not (folder / MANIFEST).exists()
    if is_new:
        require_room(folder)
    try:
        imported = import_draft(prepare(request), folder, progress)
    except VolprepError:
        if is_new and (folder / MANIFEST).exists():
            with suppress(VolprepError):  # the first error is the one to report
                remove_package(folder)
        raise
    scene_path = None if request.scene_path is None else path_text(request.scene_path)
    write_origin(folder, Origin(scene_path=scene_path, scene=imported.scene, profile=request.profile))
    return imported.draft


@dataclass(frozen=True)
class Imported:
    """A draft whose source has been imported."""

    draft: Draft
    """The draft."""
    scene: Scene
    """The scene; if it had no transfer functions, one was made from the measurements."""
    measured: tuple[Measured, ...] | None
    """Measurements of each channel; None if an earlier import made them."""


def import_draft(prepared: Prepared, folder: Path, progress: Progress, start: bytes = b"") -> Imported:
    """Return the draft at `folder` with the source imported: a new one, or the old one if the source is unchanged.

    With the `start` of the machine the draft is good until the next one only, and faster. Raises the errors of the
    readers, VP1090 for NaN or infinite voxels unless the scene says how to replace them, VP4006 for a sealed package,
    VP4020 and VP4023 if the draft cannot be written.
    """
    try:
        return _imported(prepared, folder, progress, start)
    except VolprepError as error:
        return _imported(prepared.after(error), folder, progress, start)


def _imported(prepared: Prepared, folder: Path, progress: Progress, start: bytes) -> Imported:
    key = import_key([channel.spec for channel in prepared.channels], generator(), prepared.segments)
    draft = Draft.open(folder, lasting=not start) if (folder / MANIFEST).exists() else None
    if draft is not None and is_current(NAME, key, draft.manifest):
        return Imported(draft, _scene_of_earlier(prepared, draft), None)
    frames = tuple(frame for _, frame in prepared.frames)
    heading = Heading(name=prepared.scene.name, generator=generator(), profile=prepared.profile, frames=frames or None)
    measured: list[Measured] = []
    records: list[SourceRecord] = []
    for channel, opened, source in prepared.sources(progress, folder.parent):
        draft = draft or Draft.create(folder, heading, lasting=not start)
        found = import_volume(draft, source, progress, channel.name)
        # Some remarks are about the pixels, which have only now been read.
        late = tuple(remark for remark in source.info.remarks if remark not in opened.remarks)
        untimed = (UNTIMED,) * any(frame.time_s is None for frame in frames)
        info = opened.model_copy(update={"remarks": (*opened.remarks, *late, *untimed)})
        record = SourceRecord(info=info, sha256=found.sha256)
        records.append(record)
        for number, later in enumerate(_later_frames(prepared, draft, heading, record, key, progress), 1):
            found = found.with_frame(later, number, len(frames))
        measured.append(found)
    assert draft is not None  # noqa: S101 - a scene has at least one channel
    grid = records[0].info.grid
    segments = [import_segments(draft, wanted, grid, progress) for wanted in prepared.segments]
    scene = prepared.looked_at([*zip((record.info for record in records), measured, strict=True)], segments)
    draft.write(SCENE, "work", scene_bytes(scene))
    if start:
        draft.write(START, "work", start)
    made = tuple(
        Contribution(channel=ChannelPart(name=channel.name, source=record, statistics=found.statistics))
        for channel, record, found in zip(prepared.channels, records, measured, strict=True)
    )
    # Everything that was made of an older source goes.
    draft.commit(StageRecord(name=NAME, key=key, made=made), heading, {record.name for record in draft.manifest.stages})
    return Imported(draft, scene, tuple(measured))


def _later_frames(  # noqa: PLR0917 - the draft, and what drafts of frames share with it
    prepared: Prepared, draft: Draft, heading: Heading, record: SourceRecord, key: str, progress: Progress
) -> Iterator[Measured]:
    """Import the frames of a series after the first one, each to a draft of its own."""
    name, own = prepared.channels[0].name, heading.model_copy(update={"frames": None})
    for number, source in enumerate(prepared.later_frames(record.info, progress), 1):
        folder = draft.of_frame(number)
        shutil.rmtree(folder, ignore_errors=True)
        frame = Draft.create(folder, own, lasting=False)
        found = import_volume(frame, source, progress, name)
        part = ChannelPart(
            name=name, source=record.model_copy(update={"sha256": found.sha256}), statistics=found.statistics
        )
        frame_key = hashlib.sha256(f"{key} {number}".encode()).hexdigest()
        frame.commit(StageRecord(name=NAME, key=frame_key, made=(Contribution(channel=part),)))
        yield found


def _scene_of_earlier(prepared: Prepared, draft: Draft) -> Scene:
    """Return the scene of a request, with the transfer function that an earlier import made if none was given."""
    if not prepared.first_look:
        return prepared.scene
    scene, wanted = scene_of(draft).with_source(prepared.scene.source), prepared.scene.segments
    if scene.segments and wanted:
        return scene.with_segments(scene.segments.model_copy(update={"source": wanted.source}))
    return scene


def scene_of(draft: Draft) -> Scene:
    """Return the scene that a draft is made for; where the source is, only its origin says."""
    return Scene.model_validate_json(draft.read_bytes(SCENE))
