"""Error of stacks of slices, measured when the package is sealed: no step makes it smaller, so the build says it.

The stack that faces an oblique view is blended in double precision, and compared with the oracle on the same codes.
"""

from collections.abc import Iterator

import numpy as np

from volprep.parts.work import codes_of_level
from volprep.plan.item_kinds import BEYOND
from volprep.plan.products import SlicesPlan
from volprep.plan.records import ChannelPlan, Plan
from volprep.transfer.preclassified import code_colours, largest_opacity
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import SeenError, in_8_bits, rounded_like, seen_error, seen_flip
from volprep.truth.stacks import brightness, facing_axis, stack_picture
from volprep.truth.volume import Volume
from volprep_formats.arrays import UInt8Array
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.transfer_function import TransferFunction

_PIXELS = 48
_DRAFT = 1e-3
"""Bound of the oracle."""
_VIEW = "anterior-left"


def settle(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Add the error of slices where it is beyond the tolerance."""
    return (*items, *(item for channel in plan.channels for item in _items(draft, channel)))


def _items(draft: Draft, plan: ChannelPlan) -> Iterator[PlanItem]:
    slices, allowed = plan.part(SlicesPlan), plan.render.tolerance
    if slices is None:
        return
    codes = np.asarray(
        codes_of_level(draft, plan, slices.level).read_slab(0, plan.level(slices.level).shape_zyx[0]), np.uint8
    )
    for function in plan.transfer_functions:
        error, flip = _error(plan, slices, codes, function)
        if error.rmse > allowed.rmse or error.maximum > allowed.maximum or flip > allowed.flip:
            yield PlanItem(
                name=f"error of slices of {function.name}",
                kind=BEYOND,
                transfer=function.name,
                kept=True,
                reason=f"slices are classified before they are interpolated, and seen at an angle they are too bright "
                f"or too far apart: in an oblique view {function.name} is off by RMSE {error.rmse:.3g}, "
                f"{error.maximum:.2g} at most, FLIP {flip:.2g}, and the tolerance is {allowed.rmse:g}, "
                f"{allowed.maximum:g}, {allowed.flip:g}; a profile with shaders keeps it, or allow more in [tolerance]",
            )


def _error(
    plan: ChannelPlan, slices: SlicesPlan, codes: UInt8Array, function: TransferFunction
) -> tuple[SeenError, float]:
    level, (low, high) = plan.level(slices.level), plan.quantize.window
    grid = plan.grid.coarser(level.factors_zyx)
    camera = standard_views(grid, plan.render.projection)[_VIEW].box_from_clip(grid, 1.0)
    stacks = {stack.textures[0].layout.axis: stack for stack in slices.stacks if stack.transfer == function.name}
    axis, cosine = facing_axis(camera, stacks)
    colours = code_colours(function, plan.quantize.window, stacks[axis].distance_mm)
    texels = colours[np.moveaxis(codes, 2 - "xyz".index(axis), 0)]
    longer = brightness(cosine, largest_opacity(colours))
    shown = stack_picture(
        texels, axis, grid, camera, (_PIXELS, _PIXELS), longer, stacks[axis].textures[0].layout.layers
    )
    volume = Volume(codes, grid, (high - low) / 255, low, plan.quantize.labels)
    truth = oracle_picture(volume, function, camera, (_PIXELS, _PIXELS), _DRAFT).rgba
    held = in_8_bits(shown)
    flip = seen_flip(held, rounded_like(truth, held))
    return seen_error(shown, truth), max(flip.black, flip.white)
