"""What a shader may show of each entry of a transfer function's table, decoded from its file."""

import numpy as np
from numpy.typing import NDArray

from volprep.compositing import COMPOSITINGS
from volprep.plan.records import ChannelPlan
from volprep_formats.arrays import Float64Array
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.tables import table_for
from volprep_formats.package.texture import Texture
from volprep_formats.textures import ktx2

Extinctions = Float64Array


def visible_extinction(draft: Draft, plan: ChannelPlan, transfer: str, level: int) -> Extinctions:
    """Return what can be seen at each entry of a table, 0 for nothing: entry j of N is at the stored value j / (N - 1).

    Of a pre-integrated table an entry is the greatest of the segments between it and its neighbours: a segment shows
    something only if one between two entries inside it does.
    """
    manifest, visible = draft.manifest, COMPOSITINGS[plan.shared.compositing].visible
    for palette in manifest.palettes:
        if palette.transfer == transfer:
            return visible(np.array([entry.extinction_per_mm for entry in palette.entries]))
    tables = (table_for(manifest.textures, role, transfer, level) for role in ("transfer", "preintegrated"))
    texture = next(table for table in tables if table is not None)
    return visible(entry_extinctions(texture, ktx2.decode(draft.read_bytes(texture.file), texture.file).data[0]))


def entry_extinctions(texture: Texture, texels: NDArray[np.generic]) -> Extinctions:
    """Decode the texels [row, column, RGBA] of a table."""
    alpha = texels[..., 3].astype(np.float64)
    found = alpha if texture.max_extinction_per_mm is None else texture.max_extinction_per_mm * (alpha / 255) ** 2
    if texture.role == "transfer":
        row: Extinctions = found[0]
        return row
    result: Extinctions = np.diagonal(found).copy()
    for beside in (np.diagonal(found, 1), np.diagonal(found, -1)):
        result[:-1] = np.maximum(result[:-1], beside)
        result[1:] = np.maximum(result[1:], beside)
    return result
