"""Write the levels of channels and of labels as OME-Zarr: OME-NGFF 0.5, Zarr 3, one sharded array per level.

The same levels give the same bytes. A level is read in slabs and written shard by shard, so that memory grows with the
area of a slice and not with the number of slices. Source: OME-NGFF 0.5 (https://ngff.openmicroscopy.org/0.5/) and Zarr
core specification 3.1 with the codec sharding_indexed.
"""

from collections.abc import Iterable, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from volprep_formats.grid import Grid
from volprep_formats.installation import require_extra
from volprep_formats.output import new_folder, taken
from volprep_formats.package.look import VolumeLooks
from volprep_formats.progress import Progress
from volprep_formats.source import VolumeSource
from volprep_formats.untrusted_json import parse_json
from volprep_formats.writers.label_image import LabelImage
from volprep_formats.writers.ngff import ChannelLook, WrittenLevel, image_attributes, is_export, label_attributes
from volprep_formats.writers.values import PhysicalValues, StoredValues

_SLAB_BYTES = 2**26
_CHUNK_ZYX = (32, 64, 64)
"""Largest inner chunk: 131 072 voxels, the unit that a viewer decodes."""
_CHUNKS_OF_SHARD_YX = 8
_ZSTD_LEVEL = 5


Level = tuple[int, Sequence[VolumeSource]]
"""Number of a level, and the volume of each channel, all on one grid."""


def write(
    levels: Iterable[Level],
    looks: Sequence[ChannelLook],
    path: Path,
    progress: Progress,
    *,
    labels: Sequence[LabelImage] = (),
    volume_looks: VolumeLooks | None = None,
    stored: bool = False,
    replaces: bool = False,
) -> list[Grid]:
    """Write `levels`, finest first, into the store `path`, which is created atomically. Returns their grids.

    Array N holds level N: physical values, or the stored ones; several channels are its first axis. Each source is
    closed before the next level is opened if `levels` does so. `replaces`: an older store of this function may be at
    `path`. `volume_looks` are written as they are.

    Raises VolprepError VP1251 or VP1254 (something else is at `path`), VP1081 (cannot be written) and the errors of
    reading.
    """
    check_target(path, replaces=replaces)
    with new_folder(path, "VP1081", replaces=replaces) as folder:
        written = _write_levels(levels, folder, progress, stored=stored)
        _write_group(folder, image_attributes(written, looks, volume_looks))
        for image in labels:
            inside = folder / "labels" / image.name
            each = ((number, [source]) for number, source in image.levels)
            held = _write_levels(each, inside, progress, stored=True)
            _write_group(inside, label_attributes(held, image.name, image.entries))
        if labels:
            _write_group(folder / "labels", {"ome": {"version": "0.5", "labels": [image.name for image in labels]}})
    return [level.grid for level in written]


def _write_levels(levels: Iterable[Level], folder: Path, progress: Progress, *, stored: bool) -> list[WrittenLevel]:
    written: list[WrittenLevel] = []
    for number, sources in levels:
        values = [StoredValues(source) if stored else PhysicalValues(source) for source in sources]
        _write_array(values, folder, number, progress)
        written.append(WrittenLevel(number, tuple(source.info for source in sources), stored))
    return written


def check_target(path: Path, *, replaces: bool) -> None:
    """Raise VP1251 or VP1254 if there is something at `path` that must not be replaced: only stores of `write` may be.

    Raise VP7005 if zarr is not installed.
    """
    require_extra("zarr")
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return
    document = path / "zarr.json"
    is_store = path.is_dir() and not path.is_symlink() and document.is_file() and _is_export(document)
    if not (replaces and is_store and all(_is_own(path.name) for path in path.iterdir())):
        raise taken(path)


def _is_own(name: str) -> bool:
    """Return whether `write` makes such a name: the group, its levels, and the labels."""
    return name in {"zarr.json", "labels"} or name.isdecimal()


def _is_export(document: Path) -> bool:
    try:
        return is_export(parse_json(document.read_bytes()))
    except ValueError:
        return False


def _chunks(shape_zyx: tuple[int, int, int], item_bytes: int) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Shape of an inner chunk and of a shard; a row of shards fits into a slab."""
    _, ny, nx = shape_zyx
    depth = _CHUNK_ZYX[0]
    while depth > 1 and depth * ny * nx * item_bytes > _SLAB_BYTES:
        depth //= 2
    chunk = tuple(min(n, most) for n, most in zip(shape_zyx, (depth, *_CHUNK_ZYX[1:]), strict=True))
    counts = (1, *(min(_CHUNKS_OF_SHARD_YX, -(-n // m)) for n, m in zip(shape_zyx[1:], chunk[1:], strict=True)))
    return chunk, tuple(m * count for m, count in zip(chunk, counts, strict=True))


def _write_array(channels: Sequence[StoredValues], folder: Path, number: int, progress: Progress) -> None:
    import zarr  # noqa: PLC0415 - takes half a second to load, and the other writers do not need it
    from zarr.codecs import ZstdCodec  # noqa: PLC0415 - as above

    shape = channels[0].info.grid.shape_zyx
    dtype = np.result_type(*(channel.info.stored_type for channel in channels))
    chunk, shard = _chunks(shape, dtype.itemsize)
    axis = (len(channels),) if len(channels) > 1 else ()
    ones = (1,) * len(axis)
    progress.start(f"writing level {number}", len(channels) * shape[0])
    # Chunks of zeros are written too: a reader cannot tell a chunk left out from one that was lost.
    with zarr.config.set({"array.write_empty_chunks": True}):
        array: Any = zarr.create_array(
            store=str(folder),
            name=str(number),
            shape=(*axis, *shape),
            chunks=(*ones, *chunk),
            shards=(*ones, *shard),
            dtype=dtype,
            compressors=ZstdCodec(level=_ZSTD_LEVEL, checksum=False),
            fill_value=0,
            dimension_names=(*"c"[: len(axis)], *"zyx"),
            zarr_format=3,
        )
        for (index, values), z in product(enumerate(channels), range(0, shape[0], shard[0])):
            slab = values.read_slab(z, min(z + shard[0], shape[0]))
            for y, x in product(range(0, shape[1], shard[1]), range(0, shape[2], shard[2])):
                part = slab[:, y : y + shard[1], x : x + shard[2]]
                box = (slice(z, z + len(slab)), slice(y, y + part.shape[1]), slice(x, x + part.shape[2]))
                array[(index, *box) if axis else box] = part
            progress.advance(len(slab))


def _write_group(folder: Path, attributes: dict[str, Any]) -> None:
    import zarr  # noqa: PLC0415 - as above

    zarr.open_group(store=str(folder), mode="a", zarr_format=3).attrs.put(attributes)
