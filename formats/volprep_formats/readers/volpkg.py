"""A level of a package as a volume: decoded from its texture, or the working data of a draft at full precision."""

import os
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel_packages import channel_packages
from volprep_formats.package.level_texels import StoredTexels, level_texels, stored_texels
from volprep_formats.package.manifest import FileRecord
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import open_inside, source_name
from volprep_formats.progress import Progress
from volprep_formats.readers.ome.channels import chosen
from volprep_formats.readers.voxel_file import VoxelFile
from volprep_formats.readers.voxel_source import VoxelSource
from volprep_formats.source import SourceInfo, SourceSpec, VolumeSource


class LevelSource:
    """Stored values of a level. Half floats, which hold code / largest code, come as float32."""

    def __init__(self, info: SourceInfo, slices: NDArray[np.generic] | StoredTexels) -> None:
        self._info = info
        self._slices = slices

    @property
    def info(self) -> SourceInfo:
        """Geometry of the level, and what maps its stored values to physical ones."""
        return self._info

    def read_slab(self, z0: int, z1: int) -> NDArray[np.generic]:
        """Stored values of slices z0 to z1 - 1 as [z, y, x]."""
        return self._slices[z0:z1].astype(self._info.stored_type)

    def __enter__(self) -> Self:
        """Return the source itself."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Let go of the texture."""
        self._slices = np.empty((0, 0, 0))


def open_volume(spec: SourceSpec, path: Path, _progress: Progress) -> VolumeSource:
    """Open the level and the channel that are chosen. Raises what `open_level` raises."""
    return open_level(path, spec.level, spec.channel)


def channel_names(_spec: SourceSpec, path: Path) -> list[str]:
    """Names of the channels of a package. Raises what `Package` raises."""
    return [*channel_packages(Package.open(path, allow_draft=True))]


def open_level(path: Path, level: int | None = None, channel: str | int | None = None) -> VolumeSource:
    """Open a level of the package or draft at `path`, the finest if None, of the default channel if None.

    Level 0 of a draft is the whole scan as it was imported. Raises VP1221 and VP1222 (choice of a channel), VP1250 (no
    such level), VP1253 (colours in place of values), VP4008 (working data of another size) and what `Package` and the
    texture reader raise.
    """
    whole = Package.open(path, allow_draft=True)
    packages = channel_packages(whole)
    name = [*packages][chosen(path, "channel", "channel", [*packages], channel)]
    package = packages[name]
    manifest = package.manifest
    working = source_name(name)
    work = next((record for record in manifest.files if record.path == working), None)
    if work is not None and level in {None, 0}:
        return _working_volume(package, work)
    held = {
        item.level
        for item in manifest.textures
        if (item.role, item.transfer) == ("volume", None) and item.level is not None
    }
    held_level = min(held, default=0) if level is None else level
    if not held and work is None and any(item.reference_mm is not None for item in manifest.textures):
        raise VolprepError("VP1253", path=path)
    if held_level not in held:
        found = sorted(held | ({0} if work is not None else set()))
        raise VolprepError("VP1250", path=path, level=held_level, found=", ".join(map(str, found)) or "none")
    return _texture_level(package, held_level)


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
    info = SourceInfo(
        format="volpkg",
        grid=grid,
        stored_type="float32" if floating else "uint16" if texels.dtype.itemsize == 2 else "uint8",
        slope=quantization.slope * (2**quantization.bits - 1 if floating else 1),
        intercept=quantization.intercept,
        unit=manifest.source.info.unit,
        modality=manifest.source.info.modality,
    )
    return LevelSource(info, texels)
