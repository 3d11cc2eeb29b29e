"""A box of level 0 as the program of sub-volumes draws it: as the only piece of its block, or as up to eight.

The whole box is drawn, to half a voxel outside its outer voxels, as a volume of its own. Where pieces are mosaics their
layout is in the shader, so that a box that is longer than a piece takes two along that axis, with a shared layer.
"""

from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from volprep.parts.subvolumes.piece import tiled
from volprep.render.block_inputs import block_values
from volprep.render.cut import Cut
from volprep.render.inputs import Edit, Inputs
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.parts.subvolumes.places import NOWHERE, Side
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, constant_texture, decode_grid
from volprep_formats.package.reader import Package


def inputs_of_cut(found: Cut) -> Edit:
    """Return what replaces the pieces around a point by a box.

    It raises VP4052 for a box that is more than two pieces along an axis, where pieces are mosaics.
    """

    def edit(package: Package, inputs: Inputs) -> Inputs:
        files, record = package.manifest.subvolumes, found.record
        if files is None:
            raise VolprepError("VP4050", path=package.path)
        grid = decode_grid(package.read_bytes(files.grid), package.path, files.grid)
        x, y, z = sides = _sides(found, grid, package)
        parts = [
            _part(found, grid, (above_z, above_y, above_x), (z, y, x))
            for above_z, above_y, above_x in product((False, True), repeat=3)
        ]
        names = [texture.name for texture in inputs.textures if texture.name.startswith("subvolume-")]
        texels = dict(zip(names, parts, strict=True))
        textures = [
            texture.model_copy(update={"shape_zyx": texels[texture.name].shape[:3]})
            if texture.name in texels
            else texture
            for texture in inputs.textures
        ]
        values = {**inputs.values, **block_values(sides, np.array(record.grid.spacing_mm_zyx[::-1]))}
        return replace(inputs, textures=textures, values=values, texels={**inputs.texels, **texels})

    return edit


def _sides(found: Cut, grid: SubvolumeGrid, package: Package) -> tuple[Side, Side, Side]:
    """Return the pieces of the box along x, y and z."""
    record = found.record
    shape_zyx = record.grid.shape_zyx
    most_zyx = shape_zyx if grid.mosaic is None else grid.largest_piece_zyx
    if any(n > 2 * most - 1 for n, most in zip(shape_zyx, most_zyx, strict=True)):
        size, most = ("×".join(map(str, reversed(shape))) for shape in (shape_zyx, most_zyx))
        raise VolprepError("VP4052", path=package.path, size=size, most=most)
    z, y, x = (_side(start, n, most) for start, n, most in zip(record.start_zyx, shape_zyx, most_zyx, strict=True))
    return x, y, z


def _side(start: int, voxels: int, most: int) -> Side:
    ends = float(start), float(start + voxels)
    if voxels <= most:
        return Side(NOWHERE, (start, voxels), (start, voxels), *ends)
    shared = start + most - 1
    return Side(shared + 0.5, (start, most), (shared, voxels - most + 1), *ends)


def _part(
    found: Cut, grid: SubvolumeGrid, above_zyx: tuple[bool, bool, bool], sides_zyx: tuple[Side, Side, Side]
) -> NDArray[np.generic]:
    """Return the texture of one of the eight pieces of the box; one texel where the box has no such piece."""
    if any(above and side.split == NOWHERE for above, side in zip(above_zyx, sides_zyx, strict=True)):
        return constant_texture(None, grid.texture_format)
    spans = [side.high if above else side.low for above, side in zip(above_zyx, sides_zyx, strict=True)]
    z, y, x = (
        slice(first - start, first - start + n) for (first, n), start in zip(spans, found.record.start_zyx, strict=True)
    )
    texels = found.texels[z, y, x]
    if found.labels is not None:
        texels = np.concatenate([texels[..., None], found.labels[z, y, x]], axis=-1)
    return texels if grid.mosaic is None else tiled(texels, grid.mosaic)
