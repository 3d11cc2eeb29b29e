"""Small smooth scans, built as a user builds them, one for each classification and each way to read a volume."""

from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np
from scene_builds import view_of

from volprep.lab.stress.combinations import Way
from volprep.pipeline.build import build
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import (
    BrickSettings,
    GridSettings,
    LightingSettings,
    PyramidSettings,
    QuantizeSettings,
    Scene,
    SceneRender,
    SkipSettings,
)
from volprep.scene.transfer import SceneTransfer
from volprep.truth.phantoms import Field, sampled
from volprep_formats.grid import Grid
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent
from volprep_formats.source import RawLayout, SourceSpec

EXTENT_MM_ZYX = (12.6, 8.8, 11.0)
SHAPE_ZYX = (9, 11, 10)
TRANSFER = "smooth"
# The window of the codes is where the values are, so that all 256 tell something.
VALUES = (0.0, 255.0)
PROFILES = {"texture3d": "gles3", "mosaic": "gles2-2048", "bricks": "gles3", "subvolumes": "gles3"}


def field(box_mm: np.ndarray) -> np.ndarray:
    """A ball with waves, without any symmetry: its surface at 150 has an outline from everywhere."""
    x, y, z = np.moveaxis(box_mm, -1, 0)
    away = np.sqrt((x - 5.2) ** 2 + (y - 4.1) ** 2 + (z - 6.6) ** 2 + 1.0)
    return 240.0 - 21.0 * away + 18.0 * np.sin(0.9 * x + 0.4 * y) * np.cos(0.7 * z - 0.5 * y + 0.5)


def grid_of(shape_zyx: tuple[int, int, int]) -> Grid:
    """Grid of the same box, whatever the number of voxels."""
    spacing = [extent / n for extent, n in zip(EXTENT_MM_ZYX, shape_zyx, strict=True)]
    return Grid.of(shape_zyx, (spacing[0], spacing[1], spacing[2]), (3.0, -20.0, 7.0))


def transfer() -> SceneTransfer:
    """Extinction and colour that change with the value, without a kink inside the values."""
    return SceneTransfer.model_validate(
        {
            "name": TRANSFER,
            "colour_space": "linear",
            "reference_mm": 9.0,
            "isovalue": 150.0,
            "intensities": VALUES,
            "points": [
                {"value": VALUES[0], "colour": [0.0, 0.25, 1.0], "extinction_per_mm": 0.02},
                {"value": VALUES[1], "colour": [1.0, 0.5, 0.0], "extinction_per_mm": 0.4},
            ],
        }
    )


def built(
    folder: Path,
    way: Way,
    step_voxels: float,
    *,
    shape_zyx: tuple[int, int, int] = SHAPE_ZYX,
    values: Field = field,
    opacity_cutoff: float = 1.0,
    lighting: str = "none",
    palette_entries: int = 16,
    change: Callable[[Scene], Scene] = lambda scene: scene,
) -> Package:
    """Build the package of a way; steps are in units of the smallest spacing."""
    folder.mkdir(parents=True, exist_ok=True)
    grid = grid_of(shape_zyx)
    codes = np.rint(sampled(values, grid)).astype(np.uint8)
    (folder / "scan.raw").write_bytes(codes.tobytes())
    layout = RawLayout.model_validate({"shape_zyx": shape_zyx, "dtype": "uint8", "spacing_mm_zyx": grid.spacing_mm_zyx})
    # Eight pieces around one point are the whole volume.
    half = max(-(-(n - 1) // 2) + 1 for n in shape_zyx)
    scene = Scene(
        name="smooth",
        source=SourceSpec(path=str(folder / "scan.raw"), format="raw", raw=layout),
        transfer=(transfer(),),
        crop="none",
        quantize=QuantizeSettings(bits=8, window=VALUES),
        pyramid=PyramidSettings(coarsest_longest_axis=max(shape_zyx)),
        skip=SkipSettings(kind="none"),
        bricks=BrickSettings(size=4) if way.sampling == "bricks" else None,
        grid=GridSettings(size=half) if way.sampling == "subvolumes" else None,
        lighting=LightingSettings(light_mm=(40.0, -60.0, 50.0)),
        render=SceneRender.model_validate(
            {
                "classification": way.classification,
                "step_voxels": step_voxels,
                "opacity_cutoff": opacity_cutoff,
                "lighting": lighting,
                "palette_entries": palette_entries,
            }
        ),
    )
    target = folder / "smooth.volpkg"
    # Nine tenths of the time of so small a build are its calls of fsync; other tests kill and look.
    with patch("os.fsync"):
        build(Request(change(scene), load_profile(PROFILES[way.sampling], folder), folder / "x.toml"), target, Silent())
    return Package.open(target)


def camera(package: Package, view: str = "anterior-left", zoom: float = 1.0) -> np.ndarray:
    """From clip coordinates to box millimetres; `zoom` shows the middle of the view only.

    In perspective: where all rays are parallel, all of them meet the kinks of the field alike.
    """
    grid = package.manifest.levels[0].grid
    return view_of(grid, view, "perspective") @ np.diag([1 / zoom, 1 / zoom, 1.0, 1.0])
