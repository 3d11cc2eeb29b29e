"""Small volumes in files with text headers, written by hand byte for byte, and how they are read back."""

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


def read(path: Path, **told: object) -> tuple[np.ndarray, SourceInfo]:
    """The whole volume, read in two slabs; `told` are further fields of the source."""
    with open_source(SourceSpec(path=str(path), **told), Path(), Silent()) as source:
        depth = source.info.grid.shape_zyx[0]
        return np.concatenate([source.read_slab(0, depth // 2), source.read_slab(depth // 2, depth)]), source.info


def refusal(path: Path) -> VolprepError:
    """The coded error of a file that is refused."""
    with pytest.raises(VolprepError) as error:
        read(path)
    return error.value


def refusal_at_open(path: Path, **told: object) -> VolprepError:
    """The coded error of a file that is refused before any voxel is read; `told` are further fields of the source."""
    with pytest.raises(VolprepError) as error:
        open_source(SourceSpec(path=str(path), **told), Path(), Silent())
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
