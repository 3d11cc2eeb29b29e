"""The plan of a draft whose source has been imported."""

import json
from collections.abc import Sequence

import numpy as np

from volprep.parts.work import FORMS, frame_drafts, source_volume
from volprep.pipeline.make_plan import Scanned, make_plan
from volprep.plan.form_trial import FormTrial
from volprep.plan.records import Plan
from volprep.plan.whole_source import WholeSource
from volprep.scan.segments.record import FoundSegments
from volprep.scan.slabs import RawVolume
from volprep.scan.statistics import Measured, measure_again
from volprep.scene.scene import Scene
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import FOUND_SEGMENTS, SEGMENT_LABELS
from volprep_formats.progress import Progress


def plan_draft(
    draft: Draft,
    scene: Scene,
    profile: DeviceProfile,
    progress: Progress,
    measured: tuple[Measured, ...] | None = None,
    *,
    tried: Sequence[FormTrial] | None = None,
) -> Plan:
    """Make the plan for a draft; `measured` is what import has just found, if it ran.

    A scene that wants compression has forms tried on the whole source, unless an earlier verb has done it, or `tried`
    holds the results. Raises the errors of `make_plan`.
    """
    channels = draft.manifest.channels
    drafts = (draft, *frame_drafts(draft))
    if measured is None:
        measured = tuple(_measured_again(drafts, channel.name) for channel in channels)
    volumes = [
        source_volume(drafts[found.frame], channel.name) for channel, found in zip(channels, measured, strict=True)
    ]
    forms = _tried(draft) if tried is None else [*tried]
    scanned = [
        Scanned(
            channel.source.info,
            found,
            WholeSource(volume, channel.source.info, channel.source.sha256, progress, forms),
            volume,
            draft.manifest.frames or (),
        )
        for channel, found, volume in zip(channels, measured, volumes, strict=True)
    ]
    return make_plan(scene, profile, scanned, *_segments(draft))


def _measured_again(drafts: Sequence[Draft], name: str) -> Measured:
    """Measure a channel again, in all frames."""
    found: Measured | None = None
    for number, draft in enumerate(drafts):
        channel = next(channel for channel in draft.manifest.channels if channel.name == name)
        again = measure_again(channel.source, channel.statistics, source_volume(draft, name))
        found = again if found is None else found.with_frame(again, number, len(drafts))
    assert found is not None  # noqa: S101 - the draft itself is the first
    return found


def _segments(draft: Draft) -> tuple[FoundSegments, RawVolume] | tuple[()]:
    """Return what the import found of the segments of the scan, and their labels, if the scene has any."""
    if all(record.path != FOUND_SEGMENTS for record in draft.files):
        return ()
    shape_zyx = draft.manifest.channels[0].source.info.grid.shape_zyx
    labels = RawVolume(draft.folder / SEGMENT_LABELS, shape_zyx, np.dtype(np.uint16))
    return FoundSegments.model_validate_json(draft.read_bytes(FOUND_SEGMENTS)), labels


def _tried(draft: Draft) -> list[FormTrial]:
    """Compressed forms that were tried when an earlier plan was made for the draft."""
    if all(record.path != FORMS for record in draft.manifest.files):
        return []
    return [FormTrial.model_validate(load) for load in json.loads(draft.read_bytes(FORMS))]
