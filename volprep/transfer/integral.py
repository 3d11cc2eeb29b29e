"""Make integral tables: the transfer function integrated from the lowest value on, in one dimension.

No feature between the ends of a ray segment is missed, however narrow it is, and the table does not depend on the
length of segments (summed tables: Crow 1984; for ray segments: Engel, Kraus, Ertl 2001, section 4). Entries cover the
values that the function tells apart: a window of 100 CT numbers gets all of them, also if the stored values go over all
16 bits.

The light of a segment is its mean colour, weighted by extinction, times its opacity. Attenuation within the segment
does not change the colour: for a segment of optical depth τ over which the colour changes by c that is off by less than
c τ² / 12 at first order, which keeps the order of convergence 2, at jumps of the function too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.integral_table import LARGEST_SUM, IntegralTable

_DENSER = 16.0
"""Extinction that still counts, over that which makes a quarter of a step opaque. A wall thinner than a hundredth of a
step stays opaque; with 64 the colour of a haze of 0.02/mm beside a wall is off by a tenth."""


def integrate(table: Table, ends: tuple[float, float], entries: int, opaque_per_mm: float) -> IntegralTable:
    """Integrate a function over `entries` values; `ends` come from `ends_of_entries`.

    `opaque_per_mm` is the extinction that makes a quarter of a step opaque (`texel_forms.opaque_per_mm`).
    """
    values = np.linspace(*ends, entries)
    sums = _running_sums(_clamped(table, _DENSER * opaque_per_mm), values)
    # A function that is empty there has some scale all the same.
    whole = sums[-1, 3] or 1.0
    exact = sums * (LARGEST_SUM / whole)
    return IntegralTable(ends, _darker_than_white(np.diff(np.rint(exact), axis=0)), whole / (ends[1] - ends[0]))


def in_unit(table: IntegralTable, mean_per_mm: float) -> IntegralTable:
    """Return a table in the unit of another one, whose mean extinction is no less."""
    grown = np.diff(np.rint(table.sums * (table.mean_per_mm / mean_per_mm)), axis=0)
    return replace(table, sums=_darker_than_white(grown), mean_per_mm=mean_per_mm)


def varied_range(tables: Sequence[Table]) -> tuple[float, float] | None:
    """Return the range of the values that at least one function tells apart; None if none tells any."""
    ends: list[float] = []
    for table in tables:
        invisible = np.maximum(table.extinction_per_mm[1:], table.extinction_per_mm[:-1]) == 0.0
        medium = np.column_stack([table.colour, table.extinction_per_mm])
        varies = ~(invisible | (medium[1:] == medium[:-1]).all(axis=1))
        ends += [*table.values[:-1][varies], *table.values[1:][varies]]
    return (min(ends), max(ends)) if ends else None


def ends_of_entries(tables: Sequence[Table], window: tuple[float, float], entries: int) -> tuple[float, float]:
    """Return the values of the first and the last entry for tables that one shader reads.

    Between the two first entries, and the two last ones, all functions are constant, or the window ends.
    """
    low, high = window
    varied = varied_range(tables)
    if varied is None or not low < varied[1] or not varied[0] < high:
        return window
    inside = max(low, varied[0]), min(high, varied[1])
    # A step of the function at one value has no width: a thousandth of the window shows it.
    beside = max((inside[1] - inside[0]) / max(entries - 3, 1), (high - low) / 1000 / entries)
    return max(low, inside[0] - beside), min(high, inside[1] + beside)


def _clamped(table: Table, largest_per_mm: float) -> Table:
    """Return the function with extinctions of at most `largest_per_mm`, and a control point where it reaches that."""
    above = table.extinction_per_mm > largest_per_mm
    if not above.any():
        return table
    (crossed,) = np.nonzero((above[1:] != above[:-1]) & (np.diff(table.values) > 0.0))
    low, high = table.extinction_per_mm[crossed], table.extinction_per_mm[crossed + 1]
    share = (largest_per_mm - low) / (high - low)

    def with_crossings(channel: Float64Array) -> Float64Array:
        between = channel[crossed].T + share * (channel[crossed + 1] - channel[crossed]).T
        return np.insert(channel, crossed + 1, between.T, axis=0)

    extinction = with_crossings(table.extinction_per_mm)
    return Table(with_crossings(table.values), with_crossings(table.colour), np.minimum(extinction, largest_per_mm))


def _darker_than_white(grown: Float64Array) -> Float64Array:
    """Return the sums [entry, 4] that grow like this between entries; rounding makes no colour brighter than white."""
    capped = np.column_stack([np.minimum(grown[:, :3], grown[:, 3:]), grown[:, 3]])
    return np.vstack([np.zeros(4), np.cumsum(capped, axis=0)])


def _running_sums(table: Table, values: Float64Array) -> Float64Array:
    """Return the integrals of colour times extinction and of extinction, from the first value to each, [value, 4]."""
    inside = table.values[(table.values > values[0]) & (table.values < values[-1])]
    ends = np.union1d(values, inside)
    middle, half = (ends[1:] + ends[:-1]) / 2, np.diff(ends) / 2
    pieces = np.zeros((len(middle), 4))
    # Between two ends it is a cubic at most, for which Gauss' rule with two points is exact, and meets no jump.
    for side in (-1.0, 1.0):
        colour, extinction = table.at(middle + side * half / np.sqrt(3.0))
        pieces += half[:, None] * np.column_stack([colour * extinction[:, None], extinction])
    sums = np.vstack([np.zeros(4), np.cumsum(pieces, axis=0)])
    return sums[np.searchsorted(ends, values)]
