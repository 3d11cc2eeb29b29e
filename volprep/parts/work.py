"""The working data of a draft: volumes without a header, the scene, and the keys of what has run."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Literal

import numpy as np

from volprep.scan.slabs import RawVolume
from volprep.scene.scene import Scene
from volprep_formats.grid import Grid
from volprep_formats.package.channel import Level, LevelFilter
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import source_name
from volprep_formats.source import SourceInfo

if TYPE_CHECKING:
    from volprep.plan.records import ChannelPlan, LevelPlan

SCENE = "work/scene.json"
"""The scene, without where the source is."""
FORMS = "work/forms.json"
"""Compressed forms that were tried: what trying them took is not spent again by the next verb."""


def scene_bytes(scene: Scene) -> bytes:
    """Return the scene as a draft holds it.

    A name of a file or a series may be that of a patient. Once the source is imported no stage asks for it; the origin
    beside the package keeps it.
    """
    imported = scene.with_source(scene.source.without_place())
    if scene.segments is not None:
        imported = imported.with_segments(scene.segments.model_copy(update={"source": "imported"}))
    return imported.model_dump_json().encode()


def codes_name(level: int, channel: str) -> str:
    """Return the name of the codes of a level of a channel."""
    return f"work/stored{level}-{channel}.raw"


def classified_name(level: int) -> str:
    """Return the name of the voxels of a coarser level, RGBA, where a package has classified voxels."""
    return f"work/classified{level}.raw"


def code_type(plan: "ChannelPlan") -> np.dtype[np.generic]:
    """Type of a code."""
    return np.dtype(np.uint8 if plan.quantize.bits == 8 else np.uint16)


def source_info(manifest: Manifest, channel: str) -> SourceInfo:
    """Return the description of the source of a channel."""
    return next(listed.source.info for listed in manifest.channels if listed.name == channel)


def source_volume(draft: Draft, channel: str) -> RawVolume:
    """Return the stored values of the source of a channel, which import wrote."""
    info = source_info(draft.manifest, channel)
    return RawVolume(draft.folder / source_name(channel), info.grid.shape_zyx, np.dtype(info.stored_type))


def frame_drafts(draft: Draft) -> tuple[Draft, ...]:
    """Return the drafts of the frames of a series after the first one, which import made."""
    numbers = range(1, len(draft.manifest.frames or ()))
    return tuple(Draft.open(draft.of_frame(number), lasting=False) for number in numbers)


def codes_of_source(draft: Draft, plan: "ChannelPlan") -> RawVolume:
    """Return the codes of the plan's channel at the resolution of the source, which quantize wrote."""
    return RawVolume(draft.folder / codes_name(0, plan.channel), plan.grid.shape_zyx, code_type(plan))


def codes_of_level(draft: Draft, plan: "ChannelPlan", index: int, channel: str | None = None) -> RawVolume:
    """Return the codes of a level that the package holds, which quantize or pyramid wrote.

    Of the plan's channel, or of another one that has the same bits and levels.
    """
    name = codes_name(index, channel or plan.channel)
    return RawVolume(draft.folder / name, plan.level(index).shape_zyx, code_type(plan))


def finest_level(plan: "ChannelPlan") -> tuple[Level, ...]:
    """Return level 0 as the manifest lists it, if the package holds it."""
    return tuple(_level(plan, level, "none") for level in plan.levels if level.index == 0)


def coarser_levels(plan: "ChannelPlan", filters: Mapping[int, LevelFilter]) -> tuple[Level, ...]:
    """Return the levels that `filters` made as the manifest lists them."""
    return tuple(_level(plan, level, filters[level.index]) for level in plan.levels if level.index in filters)


def is_current(name: str, key: str, manifest: Manifest) -> bool:
    """Return whether a stage has run with this key."""
    return any(record.name == name and record.key == key for record in manifest.stages)


def _level(plan: "ChannelPlan", level: "LevelPlan", made_by: Literal["none"] | LevelFilter) -> Level:
    return Level(index=level.index, factors_zyx=level.factors_zyx, grid=grid_of_level(plan, level), filter=made_by)


def grid_of_level(plan: "ChannelPlan", level: "LevelPlan") -> Grid:
    """Return the grid of a level."""
    return plan.grid if level.factors_zyx == (1, 1, 1) else plan.grid.coarser(level.factors_zyx)
