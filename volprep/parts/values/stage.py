"""Physical values become codes of 8 or 16 bits, and the loss is recorded.

Linear over the plan's window, rounded half to even, clamped at its ends; slab by slab, in one pass.
"""

import math
import operator
from collections.abc import Iterator
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.kernels import _native
from volprep.parts.stage import Stage, Work
from volprep.parts.work import code_type, codes_name, codes_of_source, finest_level, source_info, source_volume
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import bytes_of, slab_ranges
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import ChannelPart, Quantization
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (plan.crop, plan.quantize, *plan.levels[:1])


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    losses: list[_native.QuantizationLoss] = []
    size = codes_of_source(draft, plan).size_bytes
    draft.write(codes_name(0, plan.channel), "work", _codes(draft, plan, losses, progress), needed_bytes=size)
    part = ChannelPart(
        name=plan.channel,
        stored_type="uint8" if plan.quantize.bits == 8 else "uint16",
        quantization=_quantization(plan, losses),
        levels=finest_level(plan),
    )
    return Contribution(channel=part)


def _codes(
    draft: Draft, plan: ChannelPlan, losses: list[_native.QuantizationLoss], progress: Progress
) -> Iterator[memoryview]:
    """Return the codes slab by slab; what each slab lost is added to `losses`."""
    source = source_volume(draft, plan.channel)
    info = source_info(draft.manifest, plan.channel)
    histogram = np.zeros(2**plan.quantize.bits, np.uint64)
    (z_start, y0, x0), (z_stop, y1, x1) = plan.crop.start_zyx, plan.crop.stop_zyx
    progress.start("quantize", z_stop - z_start)
    for z0, z1 in slab_ranges(z_stop - z_start, source.slice_bytes):
        slices: NDArray[Any] = source.read_slab(z_start + z0, z_start + z1)
        slab = np.ascontiguousarray(slices[:, y0:y1, x0:x1])
        codes = np.empty(slab.shape, code_type(plan))
        losses.append(_native.quantize(slab, info.slope, info.intercept, *plan.quantize.window, codes, histogram))
        yield bytes_of(codes)
        progress.advance(z1 - z0)


def _quantization(plan: ChannelPlan, losses: list[_native.QuantizationLoss]) -> Quantization:
    low, high = plan.quantize.window
    # The kernel's losses add up exactly: the slabs leave no trace.
    total = reduce(operator.add, losses)
    if plan.quantize.labels and total.max_abs_error > 0:
        raise VolprepError("VP3025", problem=f"a voxel is {total.max_abs_error:.2g} away from any")
    return Quantization(
        bits=plan.quantize.bits,
        window=(low, high),
        slope=(high - low) / (2**plan.quantize.bits - 1),
        intercept=low,
        rmse=math.sqrt(total.sum_squared_error / total.in_window) if total.in_window else 0.0,
        max_error=total.max_abs_error,
        clipped_below=total.clipped_below,
        clipped_above=total.clipped_above,
    )


STAGE = Stage(
    name="quantize",
    summary="Turn values into codes of 8 or 16 bits, and record the loss.",
    options=("quantize", ("bits", "window")),
    reads=("import",),
    channel=Work(_settings, _run),
)
