"""OpenVDB files (.vdb): one grid of floats, doubles or colours (vec3s), dense in the bounding box of its active voxels.

Inactive voxels are read with their value, the background's or a tile's. OpenVDB gives its world neither a unit nor a
place in a patient: its units are taken as millimetres and its x, y and z as left, back and up (LPS), and a remark
reports it. Source: "OpenVDB Overview" (https://www.openvdb.org/documentation), and K. Museth, "VDB: High-resolution
sparse volumes with dynamic topology", ACM Transactions on Graphics 32(3), 2013.
"""

import itertools
import json
from contextlib import ExitStack
from dataclasses import dataclass
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import Lines, VolprepError
from volprep_formats.grid import Grid
from volprep_formats.isolation import Function, WorkerRequest, Workers, workers
from volprep_formats.opened_source import OpenedSource
from volprep_formats.progress import Progress
from volprep_formats.readers.affine import grid_from_affine
from volprep_formats.readers.colour import channel_of_colours, colour_remarks, of_colour
from volprep_formats.readers.vdb.tree import (
    GridEntry,
    SlabRequest,
    TreeFacts,
    TreeRequest,
    Xyz,
    list_grids,
    read_slab,
    read_vectors,
    tree_facts,
)
from volprep_formats.source import ColourChannel, SourceInfo, SourceSpec

_SCALARS = frozenset(("float", "double"))
_COLOURS = frozenset(("vec3s",))
# 8 GB as floats. Two active voxels far apart make any box, so the size of the file says nothing about it.
_MOST_VOXELS = 2**31
# The masks of a node are never compressed: the smallest file of a node is 1/34 of its size in memory, at 32³ values of
# 8 bytes beside two masks of 32³ bits.
_MEMORY_PER_BYTE = 64
_BASE_MEMORY_BYTES = 2**28
_LARGEST_LISTING = 2**22
_SLAB_BYTES = 2**26
_SECONDS, _BYTES_PER_SECOND = 30.0, 2**20
_LEVEL_SET = "Level Set"
_WORLD = (
    "OpenVDB files do not say their unit of length or how the volume lies in the patient; millimetres are taken, and "
    "left, back and up"
)
_tokens = itertools.count()


@dataclass(frozen=True)
class _Worker:
    """Worker processes that read one file."""

    pool: Workers
    path: Path
    file_bytes: int

    def run(self, function: Function, argument: object, result_bytes: int) -> NDArray[np.generic]:
        """Call a function of `vdb_tree`; the result is a copy."""
        request = WorkerRequest(
            function=function,
            argument=argument,
            path=self.path,
            result_bytes=result_bytes,
            memory_bytes=_BASE_MEMORY_BYTES + _MEMORY_PER_BYTE * self.file_bytes,
            seconds=_SECONDS + self.file_bytes / _BYTES_PER_SECOND,
        )
        return self.pool.result_of(request)

    def run_json(self, function: Function, argument: object) -> Any:
        """Call a function that gives JSON."""
        return json.loads(self.run(function, argument, _LARGEST_LISTING).tobytes())


class VdbSource(OpenedSource):
    """One grid of an OpenVDB file, whose tree a worker process holds."""

    def __init__(self, info: SourceInfo, worker: _Worker, tree: TreeRequest, first_xyz: Xyz) -> None:
        super().__init__(info)
        self._worker = worker
        self._tree = tree
        self._first_xyz = first_xyz

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices z0 to z1 - 1 as [z, y, x], inactive voxels included.

        Raises VolprepError VP1200 or VP1270 to VP1273.
        """
        return self._voxels(read_slab, (), z0, z1)

    def read_vectors(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices of a grid of vectors as [z, y, x, 3]. Raises what `read_slab` raises."""
        return self._voxels(read_vectors, (3,), z0, z1)

    def _voxels(self, read: Function, value: tuple[int, ...], z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices of values of the shape `value`."""
        _, ny, nx = self._info.grid.shape_zyx
        slab = np.empty((z1 - z0, ny, nx, *value), dtype=np.float32)
        slice_bytes = 4 * ny * nx * prod(value)
        step = max(1, _SLAB_BYTES // slice_bytes)
        x, y, z = self._first_xyz
        for start in range(z0, z1, step):
            stop = min(start + step, z1)
            request = SlabRequest(self._tree, (x, y, z + start), (stop - start, ny, nx))
            slab[start - z0 : stop - z0] = self._worker.run(read, request, (stop - start) * slice_bytes)
        return slab

    def keep(self, opened: ExitStack) -> None:
        """Take resources that are closed with the source."""
        self._opened.push(opened)


class VdbColours(OpenedSource):
    """One channel of a grid of colours, which are linear light."""

    def __init__(self, source: VdbSource, path: Path, wanted: ColourChannel) -> None:
        """Read the first slice. Raises what `read_slab` raises."""
        remarks = (*source.info.remarks, *colour_remarks(wanted, has_alpha=False, is_linear=True))
        super().__init__(of_colour(source.info.model_copy(update={"remarks": remarks})), source)
        self._source = source
        self._path = path
        self._wanted = wanted
        self.read_slab(0, 1)

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Return slices z0 to z1 - 1 as [z, y, x]. Raises VP1200, VP1270 to VP1273 and VP1290."""
        return channel_of_colours(self._path, self._wanted, self._source.read_vectors(z0, z1), None)


def open_volume(spec: SourceSpec, path: Path, _progress: Progress) -> VdbSource | VdbColours:
    """Open the grid that `spec.grid` names, or the only one of floats or doubles; or the one of colours.

    Raises VolprepError VP1200 to VP1205, VP1270 to VP1273, VP1290, VP2020 (sheared) or VP2021 (unusable transform).
    """
    with ExitStack() as opened:
        worker = _Worker(opened.enter_context(workers()), path, path.stat().st_size)
        entries = [GridEntry(**fields) for fields in worker.run_json(list_grids, path)]
        kinds = _SCALARS if spec.colour is None else _COLOURS
        index = _chosen(path, spec.grid, entries, kinds)
        tree = TreeRequest(path, index, next(_tokens))
        facts = TreeFacts(**worker.run_json(tree_facts, tree))
        name = entries[index].name
        if facts.box_xyz is None:
            raise VolprepError("VP1204", path=path, grid=name[:60])
        first_xyz, last_xyz = facts.box_xyz
        grid = _grid(path, name, facts, _shape_zyx(path, name, first_xyz, last_xyz), first_xyz)
        info = SourceInfo(
            format="vdb",
            grid=grid,
            stored_type="float32",
            level_set=entries[index].grid_class == _LEVEL_SET,
            remarks=_remarks(entries[index], facts, len(entries)),
        )
        source = VdbSource(info, worker, tree, first_xyz)
        found = source if spec.colour is None else VdbColours(source, path, spec.colour)
        source.keep(opened.pop_all())
        return found


def _chosen(path: Path, wanted: str | None, entries: list[GridEntry], kinds: frozenset[str]) -> int:
    """Index of the grid that is meant, of values of these kinds."""
    fits = [
        index
        for index, entry in enumerate(entries)
        if (entry.name == wanted if wanted is not None else entry.value_type in kinds)
    ]
    if len(fits) != 1:
        found = Lines(_described(entry) for entry in entries[:20])
        raise VolprepError("VP1202", path=path, count=len(entries), found=found or " none")
    entry = entries[fits[0]]
    if entry.value_type not in kinds and kinds == _COLOURS:
        problem = f"the voxels of the grid {entry.name[:60]!r} are of type {entry.value_type[:60]}, not vec3s"
        raise VolprepError("VP1290", path=path, problem=problem)
    if entry.value_type not in kinds:
        raise VolprepError("VP1203", path=path, grid=entry.name[:60], kind=entry.value_type[:60])
    return fits[0]


def _described(entry: GridEntry) -> str:
    """One line about a grid."""
    kind = "half" if entry.saved_as_half else entry.value_type
    text = f"{entry.name[:60]!r}: {kind}, {entry.grid_class}"
    if entry.declared_box_xyz is None:
        return text
    sizes = (str(last - first + 1) for first, last in zip(*entry.declared_box_xyz, strict=True))
    return f"{text}, {'×'.join(sizes)} voxels"


def _shape_zyx(path: Path, name: str, first_xyz: Xyz, last_xyz: Xyz) -> tuple[int, int, int]:
    nx, ny, nz = (last - first + 1 for first, last in zip(first_xyz, last_xyz, strict=True))
    if prod((nx, ny, nz)) > _MOST_VOXELS:
        raise VolprepError("VP1205", path=path, grid=name[:60], size=f"{nx}×{ny}×{nz}", limit=_MOST_VOXELS)
    return nz, ny, nx


def _grid(path: Path, name: str, facts: TreeFacts, shape_zyx: tuple[int, int, int], first_xyz: Xyz) -> Grid:
    which = f"transform of the grid {name[:60]!r}"
    if facts.world_from_index is None:
        raise VolprepError("VP2021", path=path, which=which)
    matrix = np.array(facts.world_from_index)
    with np.errstate(over="ignore", invalid="ignore"):
        origin = (matrix @ [*first_xyz, 1.0])[:3]
    return grid_from_affine(path, which, shape_zyx, matrix[:3, :3], origin)


def _remarks(entry: GridEntry, facts: TreeFacts, grids: int) -> tuple[str, ...]:
    remarks = [_WORLD]
    if grids > 1:
        remarks.append(f"{grids - 1} more grids in the file are left out")
    if entry.grid_class == _LEVEL_SET:
        remarks.append(
            f"a level set: values are distances to a surface, cut off at {facts.background:g}, negative inside"
        )
    if facts.inexact_values:
        remarks.append(f"{facts.inexact_values} 64-bit values of the tree are rounded to 32-bit floating point")
    return tuple(remarks)
