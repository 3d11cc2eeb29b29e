"""The working data of a draft: volumes without a header, the scene, and the keys of what has run."""

from importlib.metadata import version
from typing import TYPE_CHECKING

import numpy as np

from volprep.slabs import RawVolume
from volprep_formats.grid import Grid
from volprep_formats.package.draft import Draft
from volprep_formats.package.manifest import Level, Manifest

if TYPE_CHECKING:
    from volprep.plan import Plan

SOURCE_VOLUME = "work/level0.raw"
"""Stored values of the source, in its type."""
SCENE = "work/scene.json"
"""The scene, with the absolute path of the source."""


def codes_name(level: int) -> str:
    """Give the name of the codes of a level."""
    return f"work/stored{level}.raw"


def code_type(plan: "Plan") -> np.dtype[np.generic]:
    """Type of a code."""
    return np.dtype(np.uint8 if plan.quantize.bits == 8 else np.uint16)


def source_volume(draft: Draft) -> RawVolume:
    """Give the stored values of the source, which import wrote."""
    info = draft.manifest.source.info
    return RawVolume(draft.folder / SOURCE_VOLUME, info.grid.shape_zyx, np.dtype(info.stored_type))


def codes_of_source(draft: Draft, plan: "Plan") -> RawVolume:
    """Give the codes at the resolution of the source, which quantize wrote."""
    return RawVolume(draft.folder / codes_name(0), plan.grid.shape_zyx, code_type(plan))


def codes_of_level(draft: Draft, plan: "Plan", index: int) -> RawVolume:
    """Give the codes of a level that the package holds, which quantize or pyramid wrote."""
    return RawVolume(draft.folder / codes_name(index), plan.level(index).shape_zyx, code_type(plan))


def levels_of(plan: "Plan") -> tuple[Level, ...]:
    """Give the levels that the package holds as the manifest lists them."""
    return tuple(
        Level(
            index=level.index,
            factors_zyx=level.factors_zyx,
            grid=(grid := _grid(plan.grid, level.factors_zyx)),
            texture_from_box_per_mm_xyz=_per_mm_xyz(grid),
            filter=level.filter,
        )
        for level in plan.levels
    )


def is_current(name: str, key: str, manifest: Manifest) -> bool:
    """Say whether a stage has run with this key."""
    return any(record.name == name and record.key == key for record in manifest.stages)


def generator() -> str:
    """Program and version, as manifests name them."""
    return f"volprep {version('volprep')}"


def _grid(grid: Grid, factors_zyx: tuple[int, int, int]) -> Grid:
    return grid if factors_zyx == (1, 1, 1) else grid.coarser(factors_zyx)


def _per_mm_xyz(grid: Grid) -> tuple[float, float, float]:
    z, y, x = (1 / (n * h) for n, h in zip(grid.shape_zyx, grid.spacing_mm_zyx, strict=True))
    return x, y, z
