"""Inputs of the program of sub-volumes: the pieces around one point of the grid, and where they begin.

Nothing outside the block of these pieces is drawn. Its faces lie in the shared layers of voxels; at the border of the
volume, half a voxel further out, at the end of its box.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volprep.render.inputs import Inputs, environment_values, light_values, undrawable
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.subvolumes.places import Side, place_of, sides_of
from volprep_formats.package.parts.subvolumes.record import SubvolumeGrid, constant_texture, decode_grid
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture


def block_inputs(package: Package, point: int, transfer: str | None) -> Inputs:
    """Choose the pieces around the point of this number. Raises VP5018 if the package cannot draw them."""
    manifest = package.manifest
    files, level_grid = manifest.subvolumes, manifest.grid
    drawn = {picture.name: picture for picture in manifest.pictures if picture.pieces is not None}
    if files is None or level_grid is None or not drawn:
        known = "nothing around a point: the package has no sub-volumes as files"
        raise undrawable(package, f"the pieces around point {point}", transfer, known)
    grid = decode_grid(package.read_bytes(files.grid), package.path, files.grid)
    picture = drawn.get(next(iter(drawn)) if transfer is None else transfer)
    if picture is None or picture.pieces is None or not 0 <= point < len(grid.points):
        known = f"points 0 to {len(grid.points) - 1} with {', '.join(drawn)}"
        raise undrawable(package, f"the pieces around point {point}", transfer, known)
    spacing_mm_xyz = np.array(level_grid.spacing_mm_zyx[::-1])
    around, texels = _pieces(grid, place_of(grid, point))
    by_name = {texture.name: texture for texture in manifest.textures} | {texture.name: texture for texture in around}
    program = manifest.picture_program(picture.pieces.program, picture)
    level = Level(index=0, factors_zyx=(1, 1, 1), grid=level_grid, filter="none")
    textures = [by_name[name] for name in picture.pieces.textures]
    values = block_values(sides_of(grid, point), spacing_mm_xyz) | light_values(program, level)
    return Inputs(program, level, textures, values | environment_values(textures), picture.pieces.step_mm, texels)


def block_values(sides_xyz: tuple[Side, Side, Side], spacing_mm_xyz: Float64Array) -> dict[str, ArrayLike]:
    """Return the values of the uniforms of a block, by their source."""
    return {
        "block_low_mm": np.array([side.begins for side in sides_xyz]) * spacing_mm_xyz,
        "block_high_mm": np.array([side.ends for side in sides_xyz]) * spacing_mm_xyz,
        "split_voxel": [side.split for side in sides_xyz],
        "low_start_voxel": [side.low[0] for side in sides_xyz],
        "low_size_voxels": [side.low[1] for side in sides_xyz],
        "high_start_voxel": [side.high[0] for side in sides_xyz],
        "high_size_voxels": [side.high[1] for side in sides_xyz],
    }


def _pieces(grid: SubvolumeGrid, place: tuple[int, int, int]) -> tuple[list[Texture], dict[str, NDArray[np.generic]]]:
    """Eight textures in the order of the samplers; a constant voxel for an empty or missing piece."""
    _, ny, nx = grid.counts_zyx
    textures = []
    texels: dict[str, NDArray[Any]] = {}
    for part, (dz, dy, dx) in enumerate(product((-1, 0), repeat=3)):
        k, j, i = (at + d for at, d in zip(place, (dz, dy, dx), strict=True))
        there = all(0 <= index < count for index, count in zip((k, j, i), grid.counts_zyx, strict=True))
        piece = grid.subvolumes[i + nx * (j + ny * k)] if there else None
        name = f"subvolume-{part}"
        shape = (1, 1, 1)
        if piece is not None and piece.file is not None:
            shape = grid.texture_shape_zyx(i + nx * (j + ny * k))
        else:
            texels[name] = constant_texture(piece, grid.texture_format)
        file = piece.file if piece is not None and piece.file is not None else "subvolumes/empty"
        textures.append(
            Texture(
                name=name,
                role="volume",
                file=file,
                shape_zyx=shape,
                format=grid.texture_format,
                dimension=grid.dimension,
                level=0,
                part=part,
                filter=grid.filter,
            )
        )
    return textures, texels
