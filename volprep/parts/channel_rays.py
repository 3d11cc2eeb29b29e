"""Rays of views through level 0 of a channel, along which steps and classifications are measured."""

from functools import partial

from volprep.compositing import COMPOSITINGS
from volprep.parts.case import Case
from volprep.parts.headlight import soft_slope
from volprep.parts.levels.label_rays import LabelLooks
from volprep.parts.levels.view_rays import FINER_PER_VOXEL, view_rays
from volprep.parts.programs.source_rays import SourceRays
from volprep.parts.programs.step import measures_steps
from volprep.parts.segments.looks import segments_of, style_looks
from volprep.parts.skip.occupancy import shown_blocks
from volprep_formats.package.function_table import Table
from volprep_formats.package.program import LAID_OVER


def with_rays(case: Case) -> Case:
    """Return the channel with rays through the part of the source that is level 0, if they are needed."""
    scene = case.scene
    if case.voxels is None or not case.profile.has_shaders or not measures_steps(scene):
        return case
    compositing = COMPOSITINGS[scene.render.compositing]
    tables = [Table.exact(function) for function in case.functions]
    seen = shown_blocks(case.measured.blocks, [compositing.visible_table(table) for table in tables])
    lit = None
    if scene.render.lighting != "none":
        # Samples are hidden only behind samples that are blended.
        lit = tables if compositing.ends_early else ()
    soft, labelled = soft_slope(scene.lighting.normals), _labelled(case)
    rays = partial(
        view_rays, case.voxels, case.info, case.measured, seen, case.crop, case.grid, lit=lit, soft_slope=soft
    )
    sample = partial(rays, labelled=labelled)
    return case.plus(SourceRays(sample(), partial(sample, per_voxel=FINER_PER_VOXEL)))


def _labelled(case: Case) -> LabelLooks | None:
    """Return the labels of segments that are laid over each other, and their looks; None without them."""
    wanted, found = case.scene.segments, case.segments
    if wanted is None or found is None or case.labels is None or case.scene.render.compositing not in LAID_OVER:
        return None
    record, order = segments_of(found, wanted, [transfer.name for transfer in case.scene.transfer], case.scene.name)
    boxes = [box for box, members in zip(found.boxes, found.members, strict=True) if box is not None and members]
    return LabelLooks(case.labels, style_looks(record)[:, list(order)], boxes)
