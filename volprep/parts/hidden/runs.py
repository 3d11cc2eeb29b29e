"""Runs of codes between which no transfer function shows anything."""

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.parts.level_choices import own_tables
from volprep.plan.records import ChannelPlan
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.storage.draft import Draft

Runs = list[tuple[int, int]]
"""First and last code of each run, both included."""


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
