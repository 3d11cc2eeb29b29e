"""How much of its light each segment keeps at a coarse level: measured when labels are made, told in the plan.

Validation measures the same on what the package holds, and judges it (volprep/validation/subjects/labelled.py).
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from volprep.parts.segments.level_labels import LEAST_SHARE, LevelLight
from volprep.plan.item_kinds import SEGMENT_LIGHT
from volprep.plan.products import SegmentsPlan
from volprep.plan.records import Plan
from volprep.truth.kept_segments import kept_segments, shown_labels
from volprep_formats.arrays import Float64Array
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft
from volprep_formats.record import Record
from volprep_formats.segmentations.records import LabelArray


class LevelKept(Record):
    """Kept light of visible segments at a level; each has at least half a voxel of the level."""

    level: int
    """The level."""
    least: str | None
    """Segment that keeps the least; None without a segment of this size."""
    share: float
    """Part of its light that it keeps."""
    lost: int
    """Number of segments that keep less than half."""
    segments: int
    """Number of segments of this size."""


def level_kept(
    segments: SegmentsPlan, level: int, light: LevelLight, labels: LabelArray, enough: NDArray[np.bool_]
) -> LevelKept:
    """Return what `labels` [z, y, x] of a coarse level keep; `enough` says which labels have half a voxel of it."""
    every, own = np.arange(labels.size), labels.reshape(-1)
    held: Float64Array = np.bincount(own, light.of(every, own), len(light.wanted)).astype(np.float64)
    kept = kept_segments(segments, light.wanted, held, shown_labels(segments, light.wanted) & enough)
    least = min(kept, key=lambda name: kept[name], default=None)
    return LevelKept(
        level=level,
        least=least,
        share=1.0 if least is None else kept[least],
        lost=sum(share < LEAST_SHARE for share in kept.values()),
        segments=len(kept),
    )


def kept_name(level: int) -> str:
    """Return the name of the working file of a level's kept light."""
    return f"work/segment-light{level}.json"


def settle(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Add the kept light of segments at each coarse level."""
    return (*items, *_items(draft, plan))


def _items(draft: Draft, plan: Plan) -> Iterator[PlanItem]:
    written = {record.path for record in draft.manifest.files}
    for level in plan.channels[0].levels if plan.segments is not None else ():
        if kept_name(level.index) not in written:
            continue
        found = LevelKept.model_validate_json(draft.read_bytes(kept_name(level.index)))
        if found.least is None:
            continue
        reason = (
            f"{found.least} keeps {found.share:.2f} of its light at level {level.index}, the least of {found.segments}"
        )
        if found.lost:
            reason += f"; {found.lost} of them keep less than {LEAST_SHARE:g}"
        yield PlanItem(
            name=f"light of segments at level {level.index}",
            kind=SEGMENT_LIGHT,
            level=level.index,
            channel=plan.channels[0].channel,
            kept=not found.lost,
            reason=reason,
        )
