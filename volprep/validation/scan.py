"""Opening the scan that a package was made from, and no other."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.pipeline.origin import read_origin
from volprep.scan.repair import open_scan
from volprep.scan.slabs import bytes_of
from volprep.scan.statistics import Gauge, source_slabs
from volprep.scene.channels import SceneChannel, drawn_channels, with_listed_channels
from volprep.scene.request import at_place
from volprep.scene.scene import RenderWishes, load_scene
from volprep.truth.decoded import Volume, holds_labels, kernel_of_light
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec


@dataclass(frozen=True)
class FoundScan:
    """Where the scan is, and what its scene says about validation."""

    channels: tuple[SceneChannel, ...]
    """The channels that are drawn; paths are absolute."""
    picture_size: int
    """Width and height of the pictures, in pixels."""

    def spec_of(self, channel: str) -> SourceSpec:
        """Return the source of a channel of the package; "" is its only one. Raises VP1241 if there is none."""
        if not channel and len(self.channels) == 1:
            return self.channels[0].spec
        names = [each.name for each in self.channels]
        if channel not in names:
            raise VolprepError(
                "VP1241", path="the scene", wanted=channel or "for a package of one", found=", ".join(names)
            )
        return self.channels[names.index(channel)].spec


def find_scan(package: Path, source: Path | None) -> FoundScan:
    """Find the scan of the package at `package`: `source`, a scene or a scan, or else the origin beside the package.

    A scan that is named by its path is read as the origin says, where there is one. Raises VP3001 to VP3003 for a
    scene that cannot be read, VP4043 for an origin that cannot, VP6012 where neither tells, VP1243 for one path in
    place of several.
    """
    if source is not None and source.suffix == ".toml":
        scene = load_scene(source)
        spec = at_place(scene.source, source.resolve().parent, None)
    else:
        origin = read_origin(package.resolve())
        if origin is not None:
            scene = origin.scene
            spec = at_place(scene.source, Path("/"), source)
        elif source is not None:
            spec = SourceSpec(path=path_text(source.absolute()))
            return FoundScan((SceneChannel("", spec, ()),), RenderWishes().picture_size)
        else:
            raise VolprepError("VP6012", path=package)
    scene = with_listed_channels(scene.with_source(spec))
    return FoundScan(drawn_channels(scene), scene.render.picture_size)


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
    labels, kernel = holds_labels(manifest), kernel_of_light(manifest)
    return Volume(stored, manifest.source.info.grid, info.slope, info.intercept, labels, kernel)
