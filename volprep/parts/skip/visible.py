"""Visible extinction of each entry of a transfer function's table, decoded from its file."""

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.plan.records import ChannelPlan
from volprep_formats.arrays import Float64Array
from volprep_formats.package.function_table import Table
from volprep_formats.package.integral_table import IntegralTable
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.tables import table_for
from volprep_formats.package.texture import Texture
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.textures import ktx2

Extinctions = Float64Array
_ENTRIES = 4096
"""Number of entries used for a function that has no table."""


def visible_extinction(draft: Draft, plan: ChannelPlan, transfer: str, level: int) -> Extinctions:
    """Return the visible extinction at each entry of a table; entry j of N is at the stored value j / (N - 1).

    Of a pre-integrated table an entry is the greatest mean between any two columns that are nearest to it: a segment
    shows something only if one between two columns inside it does.
    """
    function = plan.function(transfer)
    visible = COMPOSITINGS[plan.shared.compositing].visible
    return visible(entry_table(_extinctions(draft, plan, transfer, level), plan.quantize.window, function))


def entry_table(extinctions: Extinctions, window: tuple[float, float], function: TransferFunction) -> Table:
    """Return the table of `function` that has these entries over the window of the stored values, without colours."""
    values = np.linspace(*window, len(extinctions))
    return Table(values, np.zeros((len(values), 3)), extinctions, function.reference_mm, function.isovalue)


def _extinctions(draft: Draft, plan: ChannelPlan, transfer: str, level: int) -> Extinctions:
    manifest = draft.manifest
    palette = manifest.palette_of.get(transfer)
    if palette is not None:
        return np.array([entry.extinction_per_mm for entry in palette.entries])
    if not plan.tables:
        return _between_points(plan, transfer)
    tables = (table_for(manifest.textures, role, transfer, level) for role in ("transfer", "preintegrated"))
    texture = next(table for table in tables if table is not None)
    return entry_extinctions(texture, ktx2.decode(draft.read_bytes(texture.file), texture.file).data[0])


def _between_points(plan: ChannelPlan, transfer: str) -> Extinctions:
    """Return the largest extinction at each entry and beside it, for a function that is evaluated exactly."""
    table = Table.exact(plan.function(transfer))
    low, high = plan.quantize.window
    entries: Extinctions = np.interp(np.linspace(low, high, _ENTRIES), table.values, table.extinction_per_mm)
    # Between two entries it is greater than at both only at a control point.
    place = np.clip((table.values - low) / (high - low) * (_ENTRIES - 1), 0, _ENTRIES - 1)
    for beside in (np.floor(place), np.ceil(place)):
        np.maximum.at(entries, beside.astype(np.intp), table.extinction_per_mm)
    return entries


def entry_extinctions(texture: Texture, texels: NDArray[np.generic]) -> Extinctions:
    """Decode the texels [row, column, RGBA] of a table."""
    if texture.role == "transfer":
        alpha = texels[0, :, 3].astype(np.float64)
        return alpha if texture.max_extinction_per_mm is None else texture.max_extinction_per_mm * (alpha / 255) ** 2
    ends = texture.stored_range or (0.0, 1.0)
    _, between = IntegralTable.of_texels(texels[None], ends, texture.max_extinction_per_mm or 0.0).between
    values = np.linspace(0.0, 1.0, _ENTRIES)
    places = (values - ends[0]) / (ends[1] - ends[0]) * len(between)
    result: Extinctions = between[np.clip(places.astype(np.intp), 0, len(between) - 1)]
    # Intervals narrower than an entry, or with an end within one, count for the entries on both sides.
    edges = np.linspace(*ends, len(between) + 1) * (_ENTRIES - 1)
    for beside in (np.floor(edges[:-1]), np.ceil(edges[1:])):
        np.maximum.at(result, np.clip(beside, 0, _ENTRIES - 1).astype(np.intp), between)
    return result
