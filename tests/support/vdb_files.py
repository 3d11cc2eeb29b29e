"""OpenVDB files written by hand, byte for byte: grids whose trees hold nothing but tiles of 128³ voxels."""

import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

TILE = 128
_HEADER = b" BDV\0\0\0\0" + struct.pack("<III", 224, 10, 0) + b"\1" + b"00000000-0000-0000-0000-000000000000"
_EYE = tuple(map(tuple, np.eye(4).tolist()))


@dataclass(frozen=True)
class HandGrid:
    """A grid. The tile (i, j, k) fills the voxels from 128·(i, j, k) on; i, j and k are 0 to 31."""

    tiles: dict[tuple[int, int, int], float | tuple[float, float, float]]
    """Active tiles and their values."""
    name: str = "density"
    kind: str = "float"
    grid_class: str = "fog volume"
    background: float = 0.0
    corner_xyz: tuple[int, int, int] = (0, 0, 0)
    """First voxel of tile (0, 0, 0), a multiple of 4096."""
    world_from_index: tuple[tuple[float, ...], ...] = field(default=_EYE)
    compression: int = 0
    """1 for zip, 4 for Blosc; the blocks of values say that they are not compressed."""
    said_bytes: int | None = None
    """What such a block says of its size; the truth unless given."""


def write_vdb_by_hand(path: Path, *grids: HandGrid) -> Path:
    """A file of these grids."""
    data = _HEADER + struct.pack("<Ii", 0, len(grids))
    for grid in grids:
        head = _text(grid.name) + _text(f"Tree_{grid.kind}_5_4_3") + _text("")
        start = len(data) + len(head) + 24
        body = (
            struct.pack("<I", grid.compression)
            + struct.pack("<I", 1)
            + _text("class")
            + _text("string")
            + _text(grid.grid_class)
        )
        body += _text("AffineMap") + np.array(grid.world_from_index).T.astype("<f8").tobytes() + _tree(grid)
        end = start + len(body)
        data += head + struct.pack("<qqq", start, end, end) + body
    path.write_bytes(data)
    return path


def _text(text: str) -> bytes:
    return struct.pack("<I", len(text)) + text.encode()


def _tree(grid: HandGrid) -> bytes:
    dtype = {"float": np.dtype("<f4"), "double": np.dtype("<f8"), "vec3s": np.dtype(("<f4", 3))}[grid.kind]
    values = np.full((32**3, *dtype.shape), grid.background, dtype.base)
    background = np.full(dtype.shape, grid.background, dtype.base).tobytes()
    active = np.zeros(32**3, bool)
    for (i, j, k), value in grid.tiles.items():
        values[(i * 32 + j) * 32 + k] = value
        active[(i * 32 + j) * 32 + k] = True
    children = 1 if grid.tiles else 0
    root = struct.pack("<i", 1) + background + struct.pack("<II", 0, children)
    said = values.nbytes if grid.said_bytes is None else grid.said_bytes
    size = struct.pack("<q", -said) if grid.compression else b""
    # 6: no mask for the inactive values, all values are there.
    node = bytes(4096) + np.packbits(active, bitorder="little").tobytes() + b"\6" + size + values.tobytes()
    return root + (struct.pack("<iii", *grid.corner_xyz) + node) * children
