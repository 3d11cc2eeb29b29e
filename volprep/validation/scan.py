"""Opening the scan that a package was made from, and no other."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from volprep.origin import read_origin
from volprep.repair import open_scan
from volprep.scene import RenderWishes, load_scene
from volprep.slabs import bytes_of
from volprep.statistics import Gauge, source_slabs
from volprep.validation.decoded import Volume
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec


@dataclass(frozen=True)
class FoundScan:
    """Where the scan is, and what its scene says about validation."""

    spec: SourceSpec
    """The source; its path is absolute."""
    picture_size: int
    """Width and height of the pictures, in pixels."""


def find_scan(package: Path, source: Path | None) -> FoundScan:
    """Find the scan of the package at `package`: `source`, a scene or a scan, or else the origin beside the package.

    A scan that is named by its path is read as the origin says, where there is one. Raises VP3001 to VP3003 for a
    scene that cannot be read, VP4043 for an origin that cannot, VP6012 where neither tells.
    """
    if source is not None and source.suffix == ".toml":
        scene = load_scene(source)
        path = source.resolve().parent / scene.source.path
    else:
        origin = read_origin(package.resolve())
        if origin is not None:
            scene = origin.scene
            path = Path(scene.source.path) if source is None else source.absolute()
        elif source is not None:
            return FoundScan(SourceSpec(path=str(source.absolute())), RenderWishes().picture_size)
        else:
            raise VolprepError("VP6012", path=package)
    return FoundScan(scene.source.model_copy(update={"path": str(path)}), scene.render.picture_size)


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
    return Volume(stored, info.grid, info.slope, info.intercept)
