"""Whether steps keep their promise: each level of default builds, drawn with its step, against the level itself.

The truth is the oracle on what the package holds of the level, with the table that classifies it: what is left is the
error of the step, and of the renderer's arithmetic. It counts over seen pixels, and the worst view counts.
"""

import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.levels_study.subjects import Subject
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import Camera, standard_views
from volprep.truth.decoded import level_volume, table_function
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import seen_pixels
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

_TOLERANCE = 1e-6
_RANDOM_VIEWS = 8


@dataclass(frozen=True)
class PromiseRow:
    """One level of a default build."""

    subject: str
    """Phantom, or scan and transfer function."""
    level: int
    """Number of the level."""
    step_voxels: float
    """Its step, in voxels of the level."""
    rmse: float
    """Root mean square over seen pixels and channels of the worst view."""
    limit: float
    """What the plan has promised: a quarter of the tolerance, or of the error of a coarser level that is beyond it."""
    reason: str
    """What the plan says."""


def promises(subject: Subject, pixels: int) -> Iterator[PromiseRow]:
    """Build the package of a subject, and draw its levels in nine standard and eight random views."""
    with tempfile.TemporaryDirectory() as folder:
        package = _built(subject, Path(folder))
        manifest = package.manifest
        if manifest.render is None or manifest.grid is None:
            msg = "a sealed package without settings"
            raise ValueError(msg)
        views = [camera.box_from_clip(manifest.grid, 1.0) for camera in _views(manifest.grid)]
        reasons = {item.level: item.reason for item in manifest.plan if item.kind == "step"}
        for level in manifest.levels:
            volume = level_volume(package, level.index)
            function = table_function(package, subject.function.name, level.index)
            worst = 0.0
            with Renderer(package, level=level.index, target="rgba32f") as renderer:
                step_voxels = renderer.nominal_mm / min(level.grid.spacing_mm_zyx)
                for view in views:
                    truth = oracle_picture(volume, function, view, (pixels, pixels), _TOLERANCE).rgba
                    drawn = renderer.render(view, (pixels, pixels))
                    seen = seen_pixels(drawn, truth)
                    if seen.any():
                        worst = max(worst, float(np.sqrt(np.mean((drawn - truth)[seen] ** 2))))
            reason = reasons[level.index]
            yield PromiseRow(subject.name, level.index, step_voxels, worst, _promised(reason), reason)


def _promised(reason: str) -> float:
    """Return the error that the plan allows a step; infinity if it says that no step keeps it."""
    found = re.search(r"within [^(]*\(RMSE ([0-9.e-]+),", reason)
    return math.inf if found is None else float(found[1])


def _built(subject: Subject, folder: Path) -> Package:
    """Build the package of codes as a raw scan, so that physical values are codes."""
    subject.codes.tofile(folder / "scan.raw")
    low, high = subject.window
    slope = (high - low) / (256**subject.codes.dtype.itemsize - 1)
    points = ", ".join(
        f"{{ value = {(point.value - low) / slope!r}, colour = {list(point.colour)}, "
        f"extinction_per_mm = {point.extinction_per_mm!r} }}"
        for point in subject.function.points
    )
    (folder / "scene.toml").write_text(
        f'name = "promise"\nprofile = "gles3"\ncrop = "none"\n[source]\npath = "scan.raw"\n[source.raw]\n'
        f'shape_zyx = {list(subject.codes.shape)}\ndtype = "{subject.codes.dtype.name}"\n'
        f"spacing_mm_zyx = {list(subject.grid.spacing_mm_zyx)}\n[pyramid]\ncoarsest_longest_axis = 16\n"
        f'[[transfer]]\nname = "{subject.function.name}"\npoints = [{points}]\n'
    )
    build(load_request(folder / "scene.toml"), folder / "p.volpkg", Silent())
    return Package.open(folder / "p.volpkg")


def _views(grid: Grid) -> list[Camera]:
    views = list(standard_views(grid).values())
    extent_mm_xyz = np.array(grid.extent_mm_zyx[::-1])
    centre = grid.corner_mm_xyz + np.array(grid.direction) @ (extent_mm_xyz / 2)
    generator = np.random.default_rng(29)
    for _ in range(_RANDOM_VIEWS):
        forward, up = generator.normal(size=(2, 3))
        x, y, z = (centre - forward / np.linalg.norm(forward) * views[0].focus_mm).tolist()
        views.append(replace(views[0], eye_mm_xyz=(x, y, z), forward=tuple(forward), up=tuple(up)))
    return views
