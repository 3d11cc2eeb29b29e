"""Build a scene, plan it, draw its package: what most tests of the pipeline begin with."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from volprep.pipeline.build import build, plan_build
from volprep.plan.records import Plan
from volprep.render.renderer import Renderer
from volprep.scene.request import load_request
from volprep.truth.camera import Projection, standard_views
from volprep.validation.timing.full_rays import unskipped
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent


def built(scene: Path, target: Path | None = None, **options: Any) -> Package:
    """Build a scene and open its package, which lies beside the scene if there is no `target`."""
    target = target or scene.with_suffix(".volpkg")
    build(load_request(scene, **options), target, Silent())
    return Package.open(target)


def planned(scene: Path, **options: Any) -> Plan:
    """Plan a scene."""
    return plan_build(load_request(scene, **options), Silent())


def write_raw_scene(
    folder: Path,
    voxels: np.ndarray,
    tables: str,
    *,
    profile: str = "gles3",
    spacing_mm_zyx: Sequence[float] = (1.0, 0.8, 0.8),
    top: str = 'crop = "none"',
) -> Path:
    """Write voxels [z, y, x] and their scene: `top` holds keys without a table, `tables` all but the source."""
    voxels.tofile(folder / "scan.raw")
    scene = folder / "scan.toml"
    scene.write_text(f"""name = "scan"
profile = "{profile}"
{top}
[source]
path = "scan.raw"
raw = {{ shape_zyx = {list(voxels.shape)}, dtype = "{voxels.dtype}", spacing_mm_zyx = {list(spacing_mm_zyx)} }}
{tables}""")
    return scene


def view_of(grid: Grid, view: str, projection: Projection = "orthographic") -> np.ndarray:
    """The matrix of a standard view, for a square picture."""
    return standard_views(grid, projection)[view].box_from_clip(grid, 1.0)


def drawn(
    package: Package,
    view: str = "anterior",
    shape_hw: tuple[int, int] = (64, 64),
    step_mm: float | None = None,
    **choices: Any,
) -> np.ndarray:
    """Draw a standard view; `choices` are of the renderer."""
    with Renderer(package, **choices) as renderer:
        return renderer.render(view_of(package.manifest.levels[0].grid, view), shape_hw, step_mm)


def assert_skipping_changes_no_pixel(package: Package, shape_hw: tuple[int, int] = (64, 64)) -> None:
    """Draw all standard views with the skip table and without it."""
    plain = unskipped(package, package.manifest.level_programs[0])
    assert plain is not package
    for view in standard_views(package.manifest.levels[0].grid):
        picture = drawn(package, view, shape_hw)
        assert picture[..., 3].max() > 0.1
        assert np.array_equal(picture, drawn(plain, view, shape_hw))
