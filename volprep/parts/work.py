"""The working data of a draft: volumes without a header, the scene, and the keys of what has run."""

from collections.abc import Mapping
from functools import cache
from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from volprep.scan.slabs import RawVolume
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import Level, LevelFilter, Manifest
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.storage.files import source_name
from volprep_formats.source import SourceInfo

if TYPE_CHECKING:
    from volprep.plan.records import Plan

SCENE = "work/scene.json"
"""The scene, with the absolute path of the source."""
FORMS = "work/forms.json"
"""Compressed forms that were tried: what trying them took is not spent again by the next verb."""


def codes_name(level: int, channel: str | None = None) -> str:
    """Return the name of the codes of a level; of a channel where there are several."""
    return f"work/stored{level}.raw" if channel is None else f"work/stored{level}-{channel}.raw"


def classified_name(level: int) -> str:
    """Return the name of the voxels of a coarser level, RGBA, where a package has classified voxels."""
    return f"work/classified{level}.raw"


def choice_name(level: int, channel: str | None = None) -> str:
    """Return the name of what was decided about a level when it was made; of a channel where there are several."""
    return f"work/choice{level}.json" if channel is None else f"work/choice{level}-{channel}.json"


def code_type(plan: "Plan") -> np.dtype[np.generic]:
    """Type of a code."""
    return np.dtype(np.uint8 if plan.quantize.bits == 8 else np.uint16)


def source_info(manifest: Manifest, channel: str | None) -> SourceInfo:
    """Return the description of the source; of a channel if there are several."""
    if channel is None:
        return manifest.source.info
    return next(each.source.info for each in manifest.channels or () if each.name == channel)


def source_volume(draft: Draft, channel: str | None) -> RawVolume:
    """Return the stored values of the source, which import wrote; of a channel where there are several."""
    info = source_info(draft.manifest, channel)
    return RawVolume(draft.folder / source_name(channel), info.grid.shape_zyx, np.dtype(info.stored_type))


def codes_of_source(draft: Draft, plan: "Plan") -> RawVolume:
    """Return the codes of the plan's channel at the resolution of the source, which quantize wrote."""
    return RawVolume(draft.folder / codes_name(0, plan.channel), plan.grid.shape_zyx, code_type(plan))


def codes_of_level(draft: Draft, plan: "Plan", index: int, channel: str | None = None) -> RawVolume:
    """Return the codes of a level that the package holds, which quantize or pyramid wrote.

    Of the plan's channel, or of another one that has the same bits and levels.
    """
    name = codes_name(index, channel or plan.channel)
    return RawVolume(draft.folder / name, plan.level(index).shape_zyx, code_type(plan))


def levels_of(plan: "Plan", filters: Mapping[int, LevelFilter]) -> tuple[Level, ...]:
    """Give level 0 and those that `filters` made, as far as the package holds them, as the manifest lists them."""
    return tuple(
        Level(
            index=level.index,
            factors_zyx=level.factors_zyx,
            grid=(grid := _grid(plan.grid, level.factors_zyx)),
            texture_from_box_per_mm_xyz=_per_mm_xyz(level.texels_zyx, grid.spacing_mm_zyx),
            filter=filters[level.index] if level.index else "none",
        )
        for level in plan.levels
        if level.index == 0 or level.index in filters
    )


def is_current(name: str, key: str, manifest: Manifest) -> bool:
    """Return whether a stage has run with this key."""
    return any(record.name == name and record.key == key for record in manifest.stages)


@cache
def generator() -> str:
    """Program and version, as manifests name them."""
    return f"volprep {version('volprep')}"


def _grid(grid: Grid, factors_zyx: tuple[int, int, int]) -> Grid:
    return grid if factors_zyx == (1, 1, 1) else grid.coarser(factors_zyx)


def _per_mm_xyz(
    texels_zyx: tuple[int, int, int], spacing_mm_zyx: tuple[float, float, float]
) -> tuple[float, float, float]:
    z, y, x = (1 / (n * h) for n, h in zip(texels_zyx, spacing_mm_zyx, strict=True))
    return x, y, z
