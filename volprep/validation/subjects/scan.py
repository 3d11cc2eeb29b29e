"""Find the scene and scan to validate against; never trust the package."""

import hashlib
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.pipeline.origin import Origin, origin_path, read_origin
from volprep.plan.form_trial import FormTrial
from volprep.scan.repair import open_scan
from volprep.scan.slabs import bytes_of
from volprep.scan.statistics import SlabMeasurer, source_slabs
from volprep.scene.channels import drawn_channels, with_listed_channels
from volprep.scene.profiles import load_profile
from volprep.scene.request import at_place, load_request
from volprep.scene.scene import Scene, SceneRender
from volprep.truth.decoded import light_of_scan
from volprep.truth.volume import Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec

_LEAST_PIXELS = 64
_VOXEL_PIXELS = 8


@dataclass(frozen=True)
class Judge:
    """The scene and the scan that a package is validated against. Nothing of it comes from the package."""

    scene: Scene
    """The scene; paths are absolute, and channels are listed."""
    scene_path: Path
    """File of the scene."""
    profile: DeviceProfile
    """Class of devices that the package was built for."""
    levels: tuple[LevelFilter, ...] = ()
    """Filter of each coarser level, channel by channel, if the origin notes the choice."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were tried, where the origin notes them."""

    @property
    def picture_size(self) -> int:
        """Width and height of the pictures, in pixels."""
        return self.scene.render.picture_size

    def picture_size_of(self, grids: Iterable[Grid]) -> int:
        """Return the width and height of the pictures of scans: the usual size is smaller for tiny ones.

        Voxels then have eight pixels across: with 18, RMSE and FLIP of 8³ voxels differed by 7 % at most.
        """
        if self.picture_size != SceneRender.model_fields["picture_size"].default:
            return self.picture_size
        voxels = max(math.hypot(*grid.extent_mm_zyx) / min(grid.spacing_mm_zyx) for grid in grids)
        return min(self.picture_size, max(_LEAST_PIXELS, math.ceil(_VOXEL_PIXELS * voxels)))

    def spec_of(self, channel: str) -> SourceSpec:
        """Return the source of a channel; "" is the only one. Raises VP1241 for an unknown channel."""
        channels = drawn_channels(self.scene)
        if not channel and len(channels) == 1:
            return channels[0].spec
        names = [channel.name for channel in channels]
        if channel not in names:
            raise VolprepError(
                "VP1241", path="the scene", wanted=channel or "for a package of one", found=", ".join(names)
            )
        return channels[names.index(channel)].spec


def find_scan(package: Path, source: Path | None) -> Judge:
    """Find the scene and scan that judge the package at `package`: `source`, or else the origin beside the package.

    `source` is a scene or a scan. The profile is the one of the origin, or else of the scene; never the one that the
    package names.

    A scan that is named by its path is read as the origin says. Raises VP3001 to VP3003 and VP3042 for a scene that
    cannot be read, VP4043 for an origin that cannot be read, VP6012 if neither names a scan, VP1243 for one path in
    place of several, VP4001 to VP4004 if `package` is not a package.
    """
    origin = read_origin(package.resolve())
    if source is not None and source.suffix == ".toml":
        request = load_request(source)
        scene, path = with_listed_channels(request.scene), source
        return Judge(scene, path, _profile_of(origin) or request.profile)
    if origin is None:
        raise VolprepError("VP6012", path=package)
    spec = at_place(origin.scene.source, Path("/"), source)
    return Judge(
        with_listed_channels(origin.scene.with_source(spec)),
        origin_path(package.resolve()),
        _profile_of(origin) or origin.scene.on_device(load_profile(origin.scene.profile, _folder_of(origin))),
        tuple(choice.filter for choice in origin.levels),
        origin.forms,
    )


def _profile_of(origin: Origin | None) -> DeviceProfile | None:
    """Return the profile that the build used, which the command line may have chosen; None if no origin says it."""
    return None if origin is None else origin.profile


def _folder_of(origin: Origin) -> Path:
    """Return the folder that paths of the scene are relative to."""
    return Path.cwd() if origin.scene_path is None else Path(origin.scene_path).parent


def read_scan(manifest: Manifest, spec: SourceSpec, progress: Progress) -> Volume:
    """Read the whole scan at full precision.

    Raises the errors of the reader, and VP6013 if it is not the scan that `manifest` names by its digest.
    """
    with open_scan(spec, Path(), progress) as source:
        info = source.info
        gauge = SlabMeasurer(info)
        stored = np.empty(info.grid.shape_zyx, dtype=info.stored_type)
        progress.start("read the scan", info.grid.shape_zyx[0])
        digest = hashlib.sha256()
        z0 = 0
        for slab in source_slabs(source, gauge, progress):
            stored[z0 : z0 + len(slab)] = slab
            digest.update(bytes_of(slab))
            z0 += len(slab)
    found = gauge.result(digest.hexdigest()).sha256
    if found != manifest.source.sha256:
        expected = manifest.source.sha256
        raise VolprepError("VP6013", path=spec.path, package=manifest.name, found=found[:12], expected=expected[:12])
    labels, kernel = manifest.holds_labels, light_of_scan(manifest)
    return Volume(stored, manifest.source.info.grid, info.slope, info.intercept, labels, kernel)
