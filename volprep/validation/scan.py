"""Who judges a package: its scene and its scan, found without asking the package."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.pipeline.origin import Origin, origin_path, read_origin
from volprep.plan.form_trial import FormTrial
from volprep.scan.repair import open_scan
from volprep.scan.slabs import bytes_of
from volprep.scan.statistics import Gauge, source_slabs
from volprep.scene.channels import drawn_channels, with_listed_channels
from volprep.scene.profiles import load_profile, profile_names
from volprep.scene.request import at_place, load_request
from volprep.scene.scene import Scene
from volprep.truth.decoded import Volume, holds_labels, light_of_scan
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.manifest_json import read_manifest
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec


@dataclass(frozen=True)
class Judge:
    """Who judges a package: the scene, and the scan that it names. Nothing of it comes from the package."""

    scene: Scene
    """The scene; paths are absolute, and channels are listed."""
    scene_path: Path
    """The file that says so."""
    profile: DeviceProfile
    """Class of devices that the package was built for."""
    levels: tuple[LevelFilter, ...] = ()
    """Filter of each coarser level, channel by channel, where the origin notes what was chosen."""
    forms: tuple[FormTrial, ...] = ()
    """Compressed forms that were tried, where the origin notes them."""

    @property
    def picture_size(self) -> int:
        """Width and height of the pictures, in pixels."""
        return self.scene.render.picture_size

    def spec_of(self, channel: str) -> SourceSpec:
        """Return the source of a channel; "" is the only one. Raises VP1241 if there is none."""
        channels = drawn_channels(self.scene)
        if not channel and len(channels) == 1:
            return channels[0].spec
        names = [each.name for each in channels]
        if channel not in names:
            raise VolprepError(
                "VP1241", path="the scene", wanted=channel or "for a package of one", found=", ".join(names)
            )
        return channels[names.index(channel)].spec


def find_scan(package: Path, source: Path | None) -> Judge:
    """Find what judges the package at `package`: `source`, a scene or a scan, or else the origin beside the package.

    A scan that is named by its path is read as the origin says. Raises VP3001 to VP3003 and VP3042 for a scene that
    cannot be read, VP4043 for an origin that cannot, VP6012 where neither tells, VP1243 for one path in place of
    several, VP4001 to VP4004 for what is no package.
    """
    origin = read_origin(package.resolve())
    if source is not None and source.suffix == ".toml":
        request = load_request(source)
        scene, path = with_listed_channels(request.scene), source
        return Judge(scene, path, _profile(origin, request.profile, read_manifest(package).profile))
    if origin is None:
        raise VolprepError("VP6012", path=package)
    spec = at_place(origin.scene.source, Path("/"), source)
    return Judge(
        with_listed_channels(origin.scene.with_source(spec)),
        origin_path(package.resolve()),
        _profile(origin, None, read_manifest(package).profile),
        tuple(choice.filter for choice in origin.levels),
        origin.forms,
    )


def _profile(origin: Origin | None, wanted: DeviceProfile | None, named: DeviceProfile) -> DeviceProfile:
    """Return the profile that a package was built for: the command line may have replaced that of the scene."""
    if origin is not None and origin.profile is not None:
        return origin.profile
    if wanted is not None and wanted.name == named.name:
        return wanted
    return load_profile(named.name, Path.cwd()) if named.name in profile_names() else named


def read_scan(manifest: Manifest, spec: SourceSpec, progress: Progress) -> Volume:
    """Read the whole scan at full precision.

    Raises what the reader raises, and VP6013 if it is not the scan that `manifest` names by its digest.
    """
    with open_scan(spec, Path(), progress) as source:
        info = source.info
        gauge = Gauge(info)
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
    # Of several channels the first says where the voxels are, as in the package; all are registered with it.
    labels, kernel = holds_labels(manifest), light_of_scan(manifest)
    return Volume(stored, manifest.source.info.grid, info.slope, info.intercept, labels, kernel)
