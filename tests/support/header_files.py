"""Small volumes in files with text headers, written by hand byte for byte, and how they are read back."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.progress import Silent
from volprep_formats.readers import open_source
from volprep_formats.source import SourceInfo, SourceSpec

SHAPE_ZYX = (3, 1, 4)


def noise(dtype: str = "int16", shape_zyx: tuple[int, ...] = SHAPE_ZYX) -> np.ndarray:
    """Values that fit every type, different on every axis."""
    return np.random.default_rng(4).integers(0, 100, shape_zyx).astype(dtype)


def read(path: Path) -> tuple[np.ndarray, SourceInfo]:
    """The whole volume, read in two slabs."""
    with open_source(SourceSpec(path=str(path)), Path(), Silent()) as source:
        depth = source.info.grid.shape_zyx[0]
        return np.concatenate([source.read_slab(0, depth // 2), source.read_slab(depth // 2, depth)]), source.info


def refusal(path: Path) -> VolprepError:
    """The coded error of a file that is refused."""
    with pytest.raises(VolprepError) as error:
        read(path)
    return error.value


def refusal_at_open(path: Path) -> VolprepError:
    """The coded error of a file that is refused before any voxel is read."""
    with pytest.raises(VolprepError) as error:
        open_source(SourceSpec(path=str(path)), Path(), Silent())
    return error.value


def check_every_cut(path: Path, step: int = 1) -> None:
    """Every beginning of the file is refused with a code or gives the whole, same volume."""
    whole = path.read_bytes()
    expected, _ = read(path)
    for size in range(0, len(whole), step):
        path.write_bytes(whole[:size])
        assert same_or_refused(path, expected), f"cut to {size} of {len(whole)} bytes"


def same_or_refused(path: Path, expected: np.ndarray) -> bool:
    try:
        voxels, _ = read(path)
    except VolprepError:
        return True
    return voxels.dtype == expected.dtype and np.array_equal(voxels, expected)


def mutations(whole: bytes, head_bytes: int, count: int, seed: int) -> Iterator[bytes]:
    """`count` damaged copies: bytes replaced, digits changed, parts removed or doubled, mostly in the header."""
    chance = np.random.default_rng(seed)
    digits = b"0123456789-. "
    for _ in range(count):
        data = bytearray(whole)
        for _ in range(chance.integers(1, 4)):
            end = head_bytes if chance.random() < 0.8 else len(data)
            place = int(chance.integers(0, max(min(end, len(data)), 1)))
            match chance.integers(0, 4):
                case 0:
                    data[place : place + 1] = bytes([chance.integers(0, 256)])
                case 1:
                    data[place : place + 1] = bytes([digits[chance.integers(0, len(digits))]])
                case 2:
                    del data[place : place + int(chance.integers(1, 9))]
                case _:
                    data[place:place] = data[place : place + int(chance.integers(1, 9))]
        yield bytes(data)


def check_mutations(path: Path, head_bytes: int, count: int, seed: int) -> None:
    """Each damaged copy is refused with a code, or is a volume no larger than the file can hold."""
    whole = path.read_bytes()
    refused = 0
    for data in mutations(whole, head_bytes, count, seed):
        path.write_bytes(data)
        try:
            voxels, info = read(path)
        except VolprepError:
            refused += 1
            continue
        assert voxels.shape == info.grid.shape_zyx
        assert voxels.dtype == info.stored_type
    path.write_bytes(whole)
    assert count // 10 < refused < count, "the mutations test nothing"
