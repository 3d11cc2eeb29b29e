"""Time of a scan with its segments over that of the scan alone, with the same steps through the same extinction.

The segments are the regions of 1000 random points in a cube, of which 36 % of the cells hold several; beside them one
segment that fills the cube. Pictures are drawn in turn, so that what else runs disturbs all alike. Lit pictures, in
which every second region is hidden, are compared with the lit scan alone. On a software driver the time is that of the
processor, on a GPU the time until the driver has finished.

``python -m tests.benchmarks.bench_segments`` measures these alone.
"""

import tempfile
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import nibabel
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import ndimage
from scipy.spatial import KDTree

from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import Scene
from volprep.truth.camera import standard_views
from volprep_formats.package.reader import Package
from volprep_formats.progress import Silent

from .drawing_time import honest_clock
from .waking import is_software, wake

_SIDE = 96
_PICTURE = {True: (192, 192), False: (1536, 1536)}
"""Height and width of a picture, by whether the driver is a software driver: a GPU takes milliseconds for it."""
_REPEATS = {True: 1, False: 9}
"""Pictures of a round; the median counts."""
_ROUNDS = 7
_POINTS = (
    {"value": 0.0, "colour": "#404040", "extinction_per_mm": 0.002},
    {"value": 255.0, "colour": "#ffffff", "extinction_per_mm": 0.02},
)
_CASES = (("gles3", "lookup"), ("gles3", "control-points"), ("gles2-2048", "lookup"))
"""Profile and classification."""
_PICTURES = (("regions", "mixed"), ("regions", "crisp"), ("one", "mixed"))
"""Segments, and how they meet."""
_LIGHTS = ("none", "headlight")


@dataclass(frozen=True)
class SegmentsRow:
    """One way to draw a scan with its segments."""

    profile: str
    """Device."""
    classification: str
    """Classification of both styles."""
    segments: str
    """Regions of random points, or one segment."""
    border: str
    """How labels meet."""
    lighting: str
    """Lighting of both pictures."""
    ratio: float
    """Processor time over that of the scan alone, the median of pictures in turn."""


def measure_segments(console: Console) -> list[SegmentsRow]:
    """Measure all cases."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_scan(folder)
        for (profile, classification), lighting in product(_CASES, _LIGHTS):
            console.print(f"measuring segments with {profile}, {classification} and {lighting}", style="dim")
            pictures = [("", ""), *_PICTURES]
            scenes = [_scene(folder, classification, lighting, *each) for each in pictures]
            ratios = _ratios([_built(scene, profile, folder) for scene in scenes])
            found = zip(_PICTURES, ratios, strict=True)
            rows += [SegmentsRow(profile, classification, *each, lighting, ratio) for each, ratio in found]
    return rows


def segments_table(rows: list[SegmentsRow]) -> Table:
    """Return the rows as a table."""
    table = Table("profile", "classification", "segments", "border", "lighting", "times the scan alone")
    for row in rows:
        table.add_row(row.profile, row.classification, row.segments, row.border, row.lighting, f"{row.ratio:.2f}")
    return table


def _write_scan(folder: Path) -> None:
    rng = np.random.default_rng(1)
    waves = ndimage.gaussian_filter(rng.normal(size=(_SIDE,) * 3), 3)
    points = KDTree(rng.uniform(0, _SIDE, (1000, 3)))
    nearest = points.query(np.indices(waves.shape).reshape(3, -1).T)[1].reshape(waves.shape)
    volumes = {
        "scan": (128 + 100 * waves / np.abs(waves).max()).astype(np.uint8),
        "regions": (nearest % 100).astype(np.int16),
        "one": np.ones(waves.shape, np.int16),
    }
    for name, volume in volumes.items():
        nibabel.save(nibabel.Nifti1Image(volume, np.diag([-1.0, -1.0, 1.0, 1.0])), folder / f"{name}.nii")


def _scene(folder: Path, classification: str, lighting: str, segments: str, border: str) -> Scene:
    table = {
        "name": f"scan-{classification}-{lighting}-{segments}{border}",
        "source": {"path": str(folder / "scan.nii")},
        "transfer": [{"name": name, "points": _POINTS} for name in ("veil", "inside")[: 2 if segments else 1]],
        "pyramid": {"coarsest_longest_axis": _SIDE},
        "render": {"step_voxels": 0.5, "opacity_cutoff": 1.0, "classification": classification, "lighting": lighting},
        "lighting": {"normals": "central"},
        "crop": "none",
        "skip": {"kind": "none"},
    }
    if segments:
        table["segments"] = {"source": str(folder / f"{segments}.nii"), "border": border}
        if lighting != "none" and segments == "regions":
            table["segments"]["style"] = [{"labels": [*range(1, 100, 2)], "visible": False}]
    return Scene.model_validate(table)


def _built(scene: Scene, profile: str, folder: Path) -> Package:
    path = folder / f"{scene.name}-{profile}.volpkg"
    build(Request(scene, load_profile(profile, folder), None), path, Silent())
    return Package.open(path)


def _ratios(packages: list[Package]) -> list[float]:
    """Return the times of all packages but the first, over that of the first."""
    with ExitStack() as stack:
        renderers = [stack.enter_context(Renderer(each, target="rgba8")) for each in packages]
        camera = standard_views(renderers[0].level.grid, "orthographic")["anterior-left"]
        matrix = camera.box_from_clip(renderers[0].level.grid, 1.0)
        wake(renderers[0].driver.renderer, lambda: _milliseconds(renderers[0], matrix))
        rounds = [[_milliseconds(each, matrix) for each in renderers] for _ in range(_ROUNDS + 1)]
    # The driver compiles shaders in the first round.
    times = np.array(rounds[1:])
    return [float(each) for each in np.median(times[:, 1:] / times[:, :1], axis=0)]


def _milliseconds(renderer: Renderer, matrix: np.ndarray) -> float:
    name = renderer.driver.renderer
    software = is_software(name)
    return renderer.time_ms(
        matrix, _PICTURE[software], repeats=_REPEATS[software], clock=honest_clock(name), warm=not software
    )


if __name__ == "__main__":
    shown = Console()
    shown.print(segments_table(measure_segments(shown)))
