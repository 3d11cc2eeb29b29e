"""A box of level 0 as the program of sub-volumes draws it: as the only piece of its block.

The whole box is drawn, to half a voxel outside its outer voxels, as a volume of its own.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from volprep.parts.subvolumes.cut import Cut
from volprep.render.block_inputs import block_values
from volprep.render.inputs import Edit, Inputs
from volprep_formats.package.parts.subvolumes.places import NOWHERE, Side
from volprep_formats.package.reader import Package


def inputs_of_cut(found: Cut) -> Edit:
    """Return what replaces the pieces around a point by a box."""

    def edit(_package: Package, inputs: Inputs) -> Inputs:
        record = found.record
        spans = list(zip(record.start_zyx, record.stop_zyx, strict=True))[::-1]
        x, y, z = (
            Side(NOWHERE, (start, stop - start), (start, stop - start), float(start), float(stop))
            for start, stop in spans
        )
        spacing_mm_xyz = np.array(record.grid.spacing_mm_zyx[::-1])
        pieces = {texture.name: texture for texture in inputs.textures if texture.name.startswith("subvolume-")}
        first, *others = pieces
        nothing: NDArray[np.generic] = np.zeros((1, 1, 1), found.texels.dtype)
        texels = {first: found.texels, **dict.fromkeys(others, nothing)}
        textures = [
            texture.model_copy(update={"shape_zyx": texels[texture.name].shape}) if texture.name in pieces else texture
            for texture in inputs.textures
        ]
        values = {**inputs.values, **block_values((x, y, z), spacing_mm_xyz)}
        return replace(inputs, textures=textures, values=values, texels={**inputs.texels, **texels})

    return edit
