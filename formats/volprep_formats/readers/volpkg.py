"""A level of a package as a volume: decoded from its texture, or the working data of a draft at full precision."""

import os
from collections.abc import Generator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.opened_source import OpenedSource
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.level_texels import StoredTexels, level_texels, stored_texels
from volprep_formats.package.manifest import FileRecord, Manifest
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import open_inside, source_name
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.readers.ome.channels import chosen
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import VoxelSource
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource


class LevelSource(OpenedSource):
    """Stored values of a level. Half floats, which hold code / largest code, come as float32."""

    def __init__(self, info: SourceInfo, slices: NDArray[np.generic] | StoredTexels) -> None:
        super().__init__(info)
        self._slices = slices

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]."""
        return self._slices[z0:z1].astype(self._info.stored_type)

    def __exit__(self, *exception: object) -> None:
        """Let go of the texture."""
        self._slices = np.empty((0, 0, 0))


def open_volume(spec: SourceSpec, path: Path, _progress: Progress) -> VolumeSource:
    """Open the level and the channel that are chosen. Raises what `open_level` raises."""
    return open_level(path, spec.level, spec.channel)


def channel_names(_spec: SourceSpec, path: Path) -> list[str]:
    """Names of the channels of a package. Raises what `Package` raises."""
    return [*channel_packages(Package.open(path, allow_draft=True))]


def open_level(path: Path, level: int | None = None, channel: str | int | None = None, frame: int = 0) -> VolumeSource:
    """Open a level of the package or draft at `path`, the finest if None, of the default channel if None.

    `frame` is that of a time series. Level 0 of a draft is the whole scan as it was imported. Raises VP1221 and VP1222
    (choice of a channel), VP1250 (no such level), VP1253 (colours in place of values), VP4008 (working data of another
    size), VP4054 (no such frame) and what `Package` and the texture reader raise.
    """
    package, work = _channel(path, channel, frame)
    manifest = package.manifest
    if work is not None and level in {None, 0}:
        return _working_volume(package, work)
    held = _held_levels(manifest)
    held_level = min(held, default=0) if level is None else level
    if not held and work is None and any(item.reference_mm is not None for item in manifest.textures):
        raise VolprepError("VP1253", path=path)
    if held_level not in held:
        found = sorted(held | ({0} if work is not None else set()))
        raise VolprepError("VP1250", path=path, level=held_level, found=", ".join(map(str, found)) or "none")
    return _texture_level(package, held_level)


def open_levels(path: Path, level: int | None = None, channel: str | int | None = None, frame: int = 0) -> "OpenLevels":
    """Prepare to open all levels that all channels have, finest first, or only `level`; or all of one channel.

    Raises what `open_level` raises, and VP1248 for several channels on several grids. A draft has level 0 alone, the
    scan as it was imported: its other levels are codes, not values of the same type.
    """
    names = channel_names(SourceSpec(path=path_text(path)), path) if channel is None else [channel]
    channels = [_channel(path, name, frame) for name in names]
    if len({package.manifest.grid for package, _ in channels}) > 1:
        raise VolprepError("VP1248", path=path, names=", ".join(map(str, names)))
    grids = [_level_grids(package, work) for package, work in channels]
    common = sorted(number for number in grids[0] if all(grid.get(number) == grids[0][number] for grid in grids))
    left_out = sorted({number for grid in grids for number in grid} - {*common})
    # Where there is nothing to choose, opening the level says why.
    numbers: list[int | None] = [level] if level is not None or not common else [*common]
    manifests = tuple(package.manifest for package, _ in channels)
    return OpenLevels(manifests, _one_by_one(path, numbers, names, frame), () if level is not None else tuple(left_out))


@dataclass(frozen=True)
class OpenLevels:
    """Levels of one or several channels."""

    manifests: tuple[Manifest, ...]
    """The manifest as it is for each channel."""
    levels: Generator[tuple[int, tuple[VolumeSource, ...]], None, None]
    """Number of each level, and the volume of each channel. One level is open at a time."""
    left_out: tuple[int, ...]
    """Levels that not all channels have."""


def _level_grids(package: Package, work: FileRecord | None) -> dict[int, tuple[int, int, int] | None]:
    """Return the shapes of the levels that hold values, by number; of a draft, level 0 alone, which all share."""
    if work is not None:
        return {0: None}
    held = _held_levels(package.manifest)
    return {level.index: level.grid.shape_zyx for level in package.manifest.levels if level.index in held}


def _one_by_one(
    path: Path, numbers: list[int | None], channels: Sequence[str | int], frame: int
) -> Generator[tuple[int, tuple[VolumeSource, ...]], None, None]:
    for number in numbers:
        with ExitStack() as opened:
            yield number or 0, tuple(opened.enter_context(open_level(path, number, name, frame)) for name in channels)


def _channel(path: Path, channel: str | int | None, frame: int) -> tuple[Package, FileRecord | None]:
    """Return the package as it is for a channel, and the working data of a draft."""
    packages = channel_packages(Package.open(path, allow_draft=True, frame=frame))
    name = [*packages][chosen(path, "channel", "channel", [*packages], channel)]
    working = source_name(name)
    return packages[name], next((file for file in packages[name].manifest.files if file.path == working), None)


def _held_levels(manifest: Manifest) -> set[int]:
    """Levels that have textures of values."""
    return {
        texture.level
        for texture in manifest.textures_of("volume")
        if texture.transfer is None and texture.level is not None
    }


def _working_volume(package: Package, work: FileRecord) -> VolumeSource:
    info = package.manifest.source.info
    # Given a stream, because voxels that happen to begin as gzip does are voxels all the same.
    stream = open_inside(package.path, work.path)
    voxels = VoxelFile(package.path / work.path, np.dtype(info.stored_type), info.grid.shape_zyx, 0, stream)
    actual = os.fstat(stream.fileno()).st_size
    if not actual == work.size_bytes == voxels.end_bytes:
        voxels.close()
        raise VolprepError("VP4008", path=package.path, file=work.path, size=actual, expected=voxels.end_bytes)
    return VoxelSource(info, voxels)


def _texture_level(package: Package, index: int) -> LevelSource:
    manifest = package.manifest
    texels = stored_texels(package, index) or level_texels(package, index)
    quantization = manifest.quantization
    grid = next((item.grid for item in manifest.levels if item.index == index), None)
    if quantization is None or grid is None or texels.shape != grid.shape_zyx:
        problem = f"level {index} does not fit its texture, or there is no quantization"
        raise VolprepError("VP4011", path=package.path, problem=problem)
    floating = texels.dtype.kind == "f"
    frames = len(manifest.frames or ())
    info = SourceInfo(
        remarks=(f"the first of {frames} frames is read",) if frames else (),
        format="volpkg",
        grid=grid,
        stored_type="float32" if floating else "uint16" if texels.dtype.itemsize == 2 else "uint8",
        slope=quantization.slope * (2**quantization.bits - 1 if floating else 1),
        intercept=quantization.intercept,
        unit=manifest.source.info.unit,
        modality=manifest.source.info.modality,
    )
    return LevelSource(info, texels)
