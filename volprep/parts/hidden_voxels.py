"""Voxels that no picture can show, and the texels of a level in which they have one value."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.kernels import _native
from volprep.parts.level_choices import own_tables
from volprep.parts.texels import texels_of, volume_reader
from volprep.parts.work import codes_of_level
from volprep.plan.products import FlattenedPlan
from volprep.plan.records import ChannelPlan, VolumePlan
from volprep_formats.arrays import Float64Array, Texels
from volprep_formats.package.function_table import Table
from volprep_formats.package.storage.draft import Draft
from volprep_formats.record import Record

Runs = list[tuple[int, int]]
"""First and last code of each run, both included."""


def flattened_reader(draft: Draft, plan: ChannelPlan, volume: VolumePlan) -> Callable[[int, int], Texels]:
    """Return a function that reads slices z0 to z1 - 1 of a level as the texels of its textures, as `volume_reader`.

    Hidden voxels are flattened if the plan contains that decision.
    """
    flattened = plan.part(FlattenedPlan)
    if flattened is None:
        return volume_reader(draft, plan, volume)
    codes, reach = codes_of_level(draft, plan, volume.level), flattened.reach
    runs = hidden_runs(draft, plan, volume.level)

    def read(z0: int, z1: int) -> Texels:
        below, above = max(0, z0 - reach), min(codes.shape_zyx[0], z1 + reach)
        slab: NDArray[Any] = codes.read_slab(below, above)
        return texels_of(flatten(slab, runs, reach)[z0 - below : z1 - below], volume.format)

    return read


def flattening(plan: ChannelPlan) -> tuple[Record, ...]:
    """Return the decisions of a plan that `flattened_reader` depends on, as settings of a stage."""
    flattened = plan.part(FlattenedPlan)
    return () if flattened is None else (flattened, *plan.transfer_functions, *plan.tables)


def flatten(codes: NDArray[Any], runs: Runs, reach: int) -> NDArray[Any]:
    """Return codes [z, y, x], where a code of a run becomes its first code if all codes within `reach` are of the run.

    Outside the array every run matches, because a texture repeats its border there.
    """
    made = codes.copy()
    distance = np.empty(codes.shape, np.uint8)
    for first, last in runs:
        shown = (codes < first) | (codes > last)
        if shown.all():
            continue
        _native.chebyshev_distance(shown.view(np.uint8), distance)
        made[distance > reach] = first
    return made


def hidden_runs(draft: Draft, plan: ChannelPlan, level: int) -> Runs:
    """Return the runs of codes of a level that are hidden: any value between two codes of a run shows nothing.

    A transfer function is hidden where it is zero, and farther than one entry of its table from where it is not. A
    table of the level's own must be zero, too.
    """
    codes = np.linspace(*plan.quantize.window, 2**plan.quantize.bits)
    # The run of each code in each table, 0 if the table shows it.
    runs = [run for name in plan.transfers for run in _of_function(draft, plan, name, level, codes)]
    together = np.stack(runs)
    hidden = (together > 0).all(axis=0)
    begins = hidden & np.concatenate([[True], (together[:, 1:] != together[:, :-1]).any(axis=0)])
    ends = hidden & np.concatenate([(together[:, 1:] != together[:, :-1]).any(axis=0), [True]])
    pairs = zip(np.nonzero(begins)[0].tolist(), np.nonzero(ends)[0].tolist(), strict=True)
    return [(first, last) for first, last in pairs if last > first]


def _of_function(
    draft: Draft, plan: ChannelPlan, transfer: str, level: int, codes: Float64Array
) -> list[NDArray[np.intp]]:
    function = plan.function(transfer)
    visible = COMPOSITINGS[plan.shared.compositing].visible_table
    found = [_numbered(visible(Table.exact(function)), codes, plan.value_slack)]
    own = own_tables(draft, plan, transfer).get(level)
    if own is not None:
        table = Table.exact(function).with_entries(np.linspace(*plan.quantize.window, len(own)), own)
        found.append(_numbered(visible(table), codes, 0.0))
    return found


def _numbered(table: Table, codes: Float64Array, slack: float) -> NDArray[np.intp]:
    """Number the stretches in which a table is zero, from 1; 0 for codes within `slack` of a value that is not."""
    numbers = np.zeros(len(codes), np.intp)
    zero = table.extinction_per_mm == 0.0
    # Beyond its ends a function goes on as at its ends.
    values = np.concatenate([[-np.inf], table.values, [np.inf]])
    zero = np.concatenate([zero[:1], zero, zero[-1:]])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]]).astype(np.int8)))
    for number, (first, after) in enumerate(zip(edges[::2], edges[1::2], strict=True), start=1):
        low, high = values[first], values[after - 1]
        numbers[(codes >= low + slack) & (codes <= high - slack)] = number
    return numbers
