"""OpenVDB's side of reading: what runs in a worker process, for its trees are parsed by code that no file shall upset.

The tree that was asked for last is kept, so that its slabs follow each other without reading the file again.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

import numpy as np

from volprep_formats.arrays import Float32Array, UInt8Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import unicode_path

if TYPE_CHECKING:
    from volprep_formats._vdb import ScalarGrid

Xyz = Sequence[int]
"""Three indices."""


@dataclass(frozen=True)
class TreeRequest:
    """One grid of a file."""

    path: Path
    index: int
    """Number of the grid, in the order of the file."""
    token: int
    """Never the same for two sources: the file may have changed between them."""


@dataclass(frozen=True)
class SlabRequest:
    """Voxels of one grid."""

    tree: TreeRequest
    first_xyz: Xyz
    shape_zyx: tuple[int, int, int]


@dataclass(frozen=True)
class GridEntry:
    """Description of a grid in a file, before its tree is read."""

    name: str
    value_type: str
    grid_class: str
    saved_as_half: bool
    declared_box_xyz: Sequence[Xyz] | None
    """First and last active voxel, if the file records them; untrusted."""


@dataclass(frozen=True)
class TreeFacts:
    """Facts about a tree that is completely in memory."""

    box_xyz: Sequence[Xyz] | None
    """First and last active voxel; None when no voxel is active."""
    active_voxels: int
    background: float
    inexact_values: int
    """Number of values that 32-bit floating point does not hold."""
    world_from_index: Sequence[Sequence[float]] | None
    """Rows of a 4×4 matrix; None when the transform is not linear."""


def list_grids(path: Path) -> UInt8Array:
    """All grids of a file as JSON: fields of `GridEntry`. Raises VolprepError VP1200 or VP1201."""
    vdb = openvdb(path)
    try:
        grids = vdb.list_grids(unicode_path(path))
        entries = [GridEntry(**{name: getattr(grid, name) for name in GridEntry.__annotations__}) for grid in grids]
    except (RuntimeError, ValueError) as error:  # names that are not UTF-8 are ValueErrors
        raise VolprepError("VP1200", path=path, error=_readable(error)) from error
    return _json([asdict(entry) for entry in entries])


def tree_facts(request: TreeRequest) -> UInt8Array:
    """Read a tree and keep it; return the fields of `TreeFacts` as JSON. Raises VolprepError VP1200 or VP1201."""
    tree = _tree(request)
    return _json(
        asdict(
            TreeFacts(
                box_xyz=tree.active_box_xyz,
                active_voxels=tree.active_voxels,
                background=tree.background,
                inexact_values=tree.inexact_values,
                world_from_index=tree.world_from_index,
            )
        )
    )


def read_slab(request: SlabRequest) -> Float32Array:
    """Values [z, y, x], active or not. Raises VolprepError VP1200 or VP1201."""
    slab = np.empty(request.shape_zyx, dtype=np.float32)
    _tree(request.tree).copy(request.first_xyz, slab)
    return slab


def read_vectors(request: SlabRequest) -> Float32Array:
    """Vectors [z, y, x, 3], active or not. Raises VolprepError VP1200 or VP1201."""
    slab = np.empty((*request.shape_zyx, 3), dtype=np.float32)
    _tree(request.tree).copy_vectors(request.first_xyz, slab)
    return slab


def openvdb(path: Path) -> ModuleType:
    """Return the binding of OpenVDB. Raises VolprepError VP1201 when volprep was built without it."""
    try:
        from volprep_formats import _vdb  # noqa: PLC0415 - may be missing
    except ImportError as error:
        raise VolprepError("VP1201", path=path, error=error) from error
    return _vdb


@lru_cache(maxsize=1)
def _tree(request: TreeRequest) -> "ScalarGrid":
    vdb = openvdb(request.path)
    try:
        tree: ScalarGrid = vdb.ScalarGrid(unicode_path(request.path), request.index)
    except RuntimeError as error:
        raise VolprepError("VP1200", path=request.path, error=_readable(error)) from error
    return tree


def _json(value: object) -> UInt8Array:
    return np.frombuffer(json.dumps(value).encode(), dtype=np.uint8)


def _readable(error: Exception) -> str:
    """Return an OpenVDB error message with unprintable characters replaced, cut to 200 characters."""
    text = "".join(letter if letter.isprintable() else "?" for letter in str(error))
    return text if len(text) <= 200 else f"{text[:200]}..."
