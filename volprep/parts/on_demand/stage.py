"""Every level in bricks, each compressed by itself, and an index with the loss of a picture without each."""

import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.appearance import Looks
from volprep.parts.levels.fitted import fitted_slabs
from volprep.parts.on_demand.levels import Voxels, rows_of_bricks
from volprep.parts.on_demand.loss import BrickLosses, CodeLook
from volprep.parts.stage import Stage, Work, any_channel, required
from volprep.parts.texels import texels_of
from volprep.parts.work import codes_of_source
from volprep.plan.products import OnDemandPlan
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import RawVolume
from volprep.transfer.lookup import lookup_table
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.parts.normals.record import SOFT_SLOPE
from volprep_formats.package.parts.on_demand.brick import encode_brick
from volprep_formats.package.parts.on_demand.index import RECORD, Records
from volprep_formats.package.parts.on_demand.record import OnDemand
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

_ENTRIES = 256
"""Entries of the tables that levels are made for."""


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    return (required(plan.part(OnDemandPlan)), plan.quantize, *plan.transfer_functions, plan.shared.crop)


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    wanted = required(plan.part(OnDemandPlan))
    progress.start("bricks on demand", len(wanted.factors_zyx))
    records: list[Records] = []
    draft.write(wanted.bricks, "bricks", _bricks(draft, plan, wanted, records, progress))
    draft.write(wanted.index, "bricks", np.concatenate(records).tobytes())
    return Contribution(on_demand=OnDemand(**{name: getattr(wanted, name) for name in OnDemand.model_fields}))


def _bricks(
    draft: Draft, plan: ChannelPlan, wanted: OnDemandPlan, records: list[Records], progress: Progress
) -> Iterator[bytes]:
    """Yield the bricks of all levels, the coarsest first, and collect their records."""
    source, spacing = codes_of_source(draft, plan), plan.grid.spacing_mm_zyx
    looks = [
        CodeLook.of(Table.exact(function), plan.quantize.window, plan.quantize.bits)
        for function in plan.transfer_functions
    ]
    visible = COMPOSITINGS[plan.shared.compositing].visible_table
    shown = [visible(Table.exact(function)) for function in plan.transfer_functions]
    window = plan.quantize.window
    seen = Looks([lookup_table(function, window, _ENTRIES) for function in plan.transfer_functions], source, spacing)
    lit = wanted.programs[0].lighting != "none"
    # Codes in place of normalised stored values.
    soft_per_mm = SOFT_SLOPE / min(spacing) * (2**plan.quantize.bits - 1) if lit else None
    coarser, before = None, wanted.factors_zyx[-1]
    with TemporaryDirectory(dir=draft.folder) as folder, ThreadPoolExecutor() as beside:
        for number, factors in reversed([*enumerate(wanted.factors_zyx)]):
            level = _level(
                source, wanted.shape_zyx(number, source.shape_zyx), factors, seen, Path(folder) / str(number)
            )
            z, y, x = (f * h for f, h in zip(factors, spacing, strict=True))
            losses = BrickLosses(looks, (z, y, x), soft_per_mm)
            steps = tuple(c // f for c, f in zip(before, factors, strict=True))
            for row in rows_of_bricks(level, coarser, (steps[0], steps[1], steps[2]), wanted.size, wanted.ghost):
                # Bricks are compressed while their losses are measured.
                waiting = [beside.submit(_stored, plan, wanted, brick, shown) for brick in row.bricks]
                numbers = losses.of_row(row)
                stored = [brick.result() for brick in waiting]
                records.append(_records(stored, numbers))
                yield from (data for data, _, _ in stored)
            coarser, before = level, factors
            progress.advance()


def _level(
    source: RawVolume, shape_zyx: tuple[int, int, int], factors: tuple[int, int, int], seen: Looks, path: Path
) -> RawVolume:
    """Return a level made for the transfer functions, whose common tables draw all levels.

    Means of values are three to four times as far from level 0 where a function is steep (docs/MEASURED.md).
    """
    if factors == (1, 1, 1):
        return source
    level = RawVolume(path, shape_zyx, source.dtype)
    with level.writing() as append:
        for slices, _ in fitted_slabs(source, factors, seen.of_level(factors)):
            append(slices)
    return level


def _stored(plan: ChannelPlan, wanted: OnDemandPlan, texels: Voxels, shown: Sequence[Table]) -> tuple[bytes, int, int]:
    """Return the bytes of a brick, and its least and greatest code."""
    low, high = int(texels.min()), int(texels.max())
    return b"" if _is_empty(plan, shown, low, high) else encode_brick(texels_of(texels, wanted.format)), low, high


def _records(stored: Sequence[tuple[bytes, int, int]], numbers: Float64Array) -> Records:
    """Return the records of a row of bricks."""
    records = np.zeros(len(stored), RECORD)
    records["size_bytes"] = [len(data) for data, _, _ in stored]
    records["crc32"] = [zlib.crc32(data) for data, _, _ in stored]
    records["low"], records["high"] = ([found[at] for found in stored] for at in (1, 2))
    # Rounded up: a bound must not shrink on its way into the file.
    loss = numbers[:, :-4].astype(np.float16)
    records["loss"] = np.where(loss < numbers[:, :-4], np.nextafter(loss, np.float16(np.inf)), loss)
    records["opacity_xyz"] = np.floor(numbers[:, -4:-1] * 255)
    records["cover"] = np.floor(numbers[:, -1] * 255)
    return records


def _is_empty(plan: ChannelPlan, shown: Sequence[Table], low: int, high: int) -> bool:
    """Return whether a brick looks like one value, `low`, in each picture."""
    if low == high:
        return True
    first, last = plan.quantize.window
    width = (last - first) / (2**plan.quantize.bits - 1)
    # The filter of a table reaches to the next entry.
    ends = first + low * width - plan.value_slack, first + high * width + plan.value_slack
    return all(table.largest_extinction(*ends) == 0.0 for table in shown)


STAGE = Stage(
    name="on-demand",
    summary="Write every level in bricks that readers fetch one by one, for scans that a device cannot hold at once.",
    options=("on_demand", ("size",)),
    reads=("quantize",),
    channel=Work(_settings, _run),
    is_needed=any_channel(lambda plan: plan.part(OnDemandPlan)),
)
