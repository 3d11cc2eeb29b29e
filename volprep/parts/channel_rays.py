"""Rays of views through level 0 of a channel, along which steps and classifications are measured."""

from dataclasses import replace
from functools import partial

from volprep.compositing import COMPOSITINGS
from volprep.parts.channel_scan import ChannelScan
from volprep.parts.headlight import soft_slope
from volprep.parts.levels.label_rays import LabelLooks
from volprep.parts.levels.view_rays import FINER_PER_VOXEL, view_rays
from volprep.parts.programs.step import has_error_of_steps
from volprep.parts.segments.looks import segments_of, style_looks
from volprep.parts.skip.occupancy import shown_blocks
from volprep.plan.records import CropPlan
from volprep_formats.grid import Grid
from volprep_formats.package.function_table import Table
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import LAID_OVER


def with_rays(scan: ChannelScan, crop: CropPlan, grid: Grid, profile: DeviceProfile) -> ChannelScan:
    """Return the channel with rays through the part of the source that is level 0, if they are needed."""
    if scan.voxels is None or not profile.has_shaders or not has_error_of_steps(scan.scene):
        return scan
    if scan.scene.render.step_voxels != "auto" and scan.scene.render.classification != "auto":
        return scan
    compositing = COMPOSITINGS[scan.scene.render.compositing]
    tables = [Table.exact(each) for each in scan.functions]
    seen = shown_blocks(scan.measured.blocks, [compositing.visible_table(each) for each in tables])
    lit = None
    if scan.scene.render.lighting != "none":
        # Samples are hidden only behind samples that are blended.
        lit = tables if compositing.ends_early else ()
    soft, labelled = soft_slope(scan.scene.lighting.normals), _labelled(scan)
    rays = partial(view_rays, scan.voxels, scan.info, scan.measured, seen, crop, grid, lit=lit, soft_slope=soft)
    sample = partial(rays, labelled=labelled)
    return replace(scan, finest=sample(), finer=partial(sample, per_voxel=FINER_PER_VOXEL))


def _labelled(scan: ChannelScan) -> LabelLooks | None:
    """Return the labels of segments that are laid over each other, and their looks; None without them."""
    wanted, found = scan.scene.segments, scan.segments
    if wanted is None or found is None or scan.labels is None or scan.scene.render.compositing not in LAID_OVER:
        return None
    record, order = segments_of(found, wanted, [each.name for each in scan.scene.transfer], scan.scene.name)
    boxes = [box for box, members in zip(found.boxes, found.members, strict=True) if box is not None and members]
    return LabelLooks(scan.labels, style_looks(record)[:, list(order)], boxes)
