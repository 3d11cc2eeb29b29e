"""The stage import: the source becomes working data of a draft, and is measured in the same pass.

It comes before the plan, which needs what it measures. This file needs neither the plan nor OpenGL, so that
`volprep import` starts at once.
"""

from dataclasses import dataclass
from pathlib import Path

from volprep.parts.work import SCENE, generator, is_current, scene_bytes
from volprep.pipeline.machine_start import START
from volprep.pipeline.prepare import Prepared
from volprep.scan.import_volume import NAME, import_key, import_volume
from volprep.scan.statistics import Measured
from volprep.scene.first_look import with_first_look
from volprep.scene.scene import Scene
from volprep_formats.package.channel import ChannelPart, SourceRecord
from volprep_formats.package.manifest import Contribution, Heading, StageRecord
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import MANIFEST
from volprep_formats.progress import Progress


@dataclass(frozen=True)
class Imported:
    """A draft whose source has been imported."""

    draft: Draft
    """The draft."""
    scene: Scene
    """The scene; one without transfer functions has got one from what was measured."""
    measured: tuple[Measured, ...] | None
    """What the import measured of each channel; None where an earlier one has done it."""


def import_draft(prepared: Prepared, folder: Path, progress: Progress, start: bytes = b"") -> Imported:
    """Return the draft at `folder` with the source imported: a new one, or the old one if the source is unchanged.

    With the `start` of the machine the draft is good until the next one only, and faster. Raises what the readers
    raise, VP1090 for voxels that are no numbers, VP4006 for a sealed package, VP4020 and VP4023 where the draft cannot
    be written.
    """
    key = import_key([channel.spec for channel in prepared.channels], generator())
    draft = Draft.open(folder, lasting=not start) if (folder / MANIFEST).exists() else None
    if draft is not None and is_current(NAME, key, draft.manifest):
        return Imported(draft, _scene_of_earlier(prepared, draft), None)
    heading = Heading(name=prepared.scene.name, generator=generator(), profile=prepared.profile)
    measured: list[Measured] = []
    records: list[SourceRecord] = []
    for channel, info, source in prepared.sources(progress):
        draft = draft or Draft.create(folder, heading, lasting=not start)
        found = import_volume(draft, source, progress, channel.name)
        records.append(SourceRecord(info=info, sha256=found.sha256))
        measured.append(found)
    assert draft is not None  # noqa: S101 - a scene has at least one channel
    scene = prepared.scene
    if prepared.first_look:
        scene = with_first_look(scene, prepared.profile, records[0].info, measured[0].statistics)
    draft.write(SCENE, "work", scene_bytes(scene))
    if start:
        draft.write(START, "work", start)
    made = tuple(
        Contribution(channel=ChannelPart(name=channel.name, source=record, statistics=found.statistics))
        for channel, record, found in zip(prepared.channels, records, measured, strict=True)
    )
    draft.commit(StageRecord(name=NAME, key=key, made=made), heading)
    return Imported(draft, scene, tuple(measured))


def _scene_of_earlier(prepared: Prepared, draft: Draft) -> Scene:
    """Return the scene of a request; an earlier import made the transfer function that nobody gave."""
    if not prepared.first_look:
        return prepared.scene
    return scene_of(draft).with_source(prepared.scene.source)


def scene_of(draft: Draft) -> Scene:
    """Return the scene that a draft is made for; where the source is, only its origin says."""
    return Scene.model_validate_json(draft.read_bytes(SCENE))
