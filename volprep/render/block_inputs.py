"""What the program of sub-volumes is given: the pieces around one point of the grid, and where they begin.

Nothing outside the block of these pieces is drawn. Its faces lie in the shared layers of voxels; where the volume ends,
half a voxel further out, at the end of its box.
"""

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from volprep.render.inputs import Inputs, find_textures
from volprep_formats.arrays import Float64Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import Level
from volprep_formats.package.parts.subvolumes.record import (
    Cuts,
    SubvolumeGrid,
    constant_piece,
    decode_grid,
)
from volprep_formats.package.reader import Package
from volprep_formats.package.texture import Texture

_NOWHERE = 1e9
"""A voxel beyond every volume: what lies on a side without pieces is never reached."""


def block_inputs(package: Package, point: int, transfer: str | None) -> Inputs:
    """Choose the pieces around the point of this number. Raises VP5018 where the package cannot draw them."""
    files, level_grid = package.manifest.subvolumes, package.manifest.grid
    if files is None or level_grid is None or not files.programs:
        known = "nothing around a point: the package has no sub-volumes as files"
        raise VolprepError("VP5018", package=package.path, level=0, transfer=transfer or "any", known=known)
    program = next((each for each in files.programs if transfer in (None, each.transfer)), None)
    grid = decode_grid(package.read_bytes(files.grid), package.path, files.grid)
    if program is None or not 0 <= point < len(grid.points):
        known = f"points 0 to {len(grid.points) - 1} with {', '.join(each.transfer for each in files.programs)}"
        raise VolprepError("VP5018", package=package.path, level=0, transfer=transfer or "any", known=known)
    place = [int(at) for at in np.unravel_index(point, [count + 1 for count in grid.counts_zyx])]
    sides = [_sides(at, cuts) for at, cuts in zip(place, grid.cuts_zyx, strict=True)]
    spacing_mm_xyz = np.array(level_grid.spacing_mm_zyx[::-1])
    ends = [_ends(at, cuts) for at, cuts in zip(place, grid.cuts_zyx, strict=True)][::-1]
    values: dict[str, ArrayLike] = {
        "block_low_mm": np.array([low for low, _ in ends]) * spacing_mm_xyz,
        "block_high_mm": np.array([high for _, high in ends]) * spacing_mm_xyz,
        "split_voxel": [side["split"] for side in sides[::-1]],
        "low_start_voxel": [side["low_start"] for side in sides[::-1]],
        "low_size_voxels": [side["low_size"] for side in sides[::-1]],
        "high_start_voxel": [side["high_start"] for side in sides[::-1]],
        "high_size_voxels": [side["high_size"] for side in sides[::-1]],
    }
    pieces, texels = _pieces(grid, place)
    tables = program.model_copy(update={"samplers": [s for s in program.samplers if s.role != "subvolume"]})
    level = Level(
        index=0,
        factors_zyx=(1, 1, 1),
        grid=level_grid,
        texture_from_box_per_mm_xyz=_per_mm_xyz(spacing_mm_xyz, grid.shape_zyx),
        filter="none",
    )
    return Inputs(program, level, [*pieces, *find_textures(package, tables, 0)], values, texels)


def _sides(at: int, cuts: Cuts) -> dict[str, float]:
    """Where the pieces below and above point `at` begin, how large they are, and the voxel position between them."""
    below, above = at > 0, at < len(cuts) - 1
    low, high = at - 1 if below else at, at if above else at - 1
    split = cuts[at] + 0.5 if below and above else (_NOWHERE if below else -_NOWHERE)
    return {
        "split": split,
        "low_start": cuts[low],
        "low_size": cuts[low + 1] - cuts[low] + 1,
        "high_start": cuts[high],
        "high_size": cuts[high + 1] - cuts[high] + 1,
    }


def _ends(at: int, cuts: Cuts) -> tuple[float, float]:
    """Where the block around point `at` begins and ends along an axis, in voxels from the volume's corner."""
    first, last = max(at - 1, 0), min(at + 1, len(cuts) - 1)
    low = 0.0 if first == 0 else cuts[first] + 0.5
    high = cuts[-1] + 1.0 if last == len(cuts) - 1 else cuts[last] + 0.5
    return low, high


def _pieces(grid: SubvolumeGrid, place: list[int]) -> tuple[list[Texture], dict[str, NDArray[np.generic]]]:
    """Eight textures in the order of the samplers; a constant voxel for one that is empty or not there."""
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
            sizes = [cuts[at + 1] - cuts[at] + 1 for at, cuts in zip((k, j, i), grid.cuts_zyx, strict=True)]
            shape = (sizes[0], sizes[1], sizes[2])
        else:
            code = piece.minimum if piece is not None else 0
            texels[name] = constant_piece(code, grid.gl, shape)
        file = piece.file if piece is not None and piece.file is not None else "subvolumes/empty"
        textures.append(
            Texture(
                name=name,
                role="volume",
                file=file,
                shape_zyx=shape,
                gl=grid.gl,
                level=0,
                part=part,
                filter=grid.filter,
            )
        )
    return textures, texels


def _per_mm_xyz(spacing_mm_xyz: Float64Array, shape_zyx: tuple[int, int, int]) -> tuple[float, float, float]:
    x, y, z = (1 / (n * h) for n, h in zip(shape_zyx[::-1], spacing_mm_xyz.tolist(), strict=True))
    return x, y, z
