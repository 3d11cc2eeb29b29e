"""Time of a scan with its segments over that of the scan alone, with the same steps through the same extinction.

The segments are the regions of 1000 random points in a cube, of which 36 % of the cells hold several; beside them 18
organs that fill 72 % of it, where 9 % do, and one segment that fills it. Pictures are drawn in turn, so that what
else runs disturbs all alike. Lit pictures, in which every second region is hidden, are compared with the lit scan
alone. On a software driver the time is that of the processor, on a GPU the time until the driver has finished.

Where two thirds of the segments are hidden, and what is outside of them, the picture is also drawn with a skip table
that counts all labels: what it takes if hiding empties no block.

``python -m tests.benchmarks.bench_segments`` measures these alone.
"""

import os
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import nibabel
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy import ndimage
from scipy.spatial import KDTree

from tests.support.looked import skip_texels
from volprep.pipeline.build import build
from volprep.render.inputs import Inputs
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
_PICTURES = (("regions", "mixed"), ("regions", "crisp"), ("organs", "mixed"), ("one", "mixed"))
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
    """Regions of random points, organs, or one segment."""
    border: str
    """How labels meet."""
    lighting: str
    """Lighting of both pictures."""
    ratio: float
    """Processor time over that of the scan alone, the median of pictures in turn."""


@dataclass(frozen=True)
class HidingRow:
    """A picture of a third of the segments."""

    scan: str
    """Synthetic regions, or a head."""
    profile: str
    """Device."""
    empty_share: float
    """Part of the blocks in which nothing is shown."""
    ms: float
    """Milliseconds of a picture."""
    all_labels_ms: float
    """The same with a skip table that counts hidden labels."""


def measure_segments(console: Console) -> Iterator[SegmentsRow]:
    """Measure all cases."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_scan(folder)
        for (profile, classification), lighting in product(_CASES, _LIGHTS):
            console.print(f"measuring segments with {profile}, {classification} and {lighting}", style="dim")
            pictures = [("", ""), *_PICTURES]
            scenes = [_scene(folder, classification, lighting, *each) for each in pictures]
            ratios = _ratios([_built(scene, profile, folder) for scene in scenes])
            found = zip(_PICTURES, ratios, strict=True)
            yield from [SegmentsRow(profile, classification, *each, lighting, ratio) for each, ratio in found]


def measure_hiding(console: Console) -> Iterator[HidingRow]:
    """Measure what skipping hidden segments saves: of synthetic regions, and of a head if the real scans are there."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        _write_scan(folder)
        scans = {"regions": (folder / "scan.nii", folder / "regions.nii")}
        data = os.environ.get("VOLPREP_TEST_DATA")
        if data and (Path(data) / "segments" / "norm.mgz").exists():
            scans["head"] = tuple(Path(data) / "segments" / each for each in ("norm.mgz", "aparc.a2009s+aseg.mgz"))
        for scan, (source, labels) in scans.items():
            for profile in ("gles3", "gles2-4096"):
                console.print(f"measuring hidden segments of {scan} with {profile}", style="dim")
                package = _built(_hiding(source, labels, scan), profile, folder)
                table = next(each for each in package.manifest.skipping.tables if each.level == 0)
                ratio, ms = _with_all_labels(package)
                yield HidingRow(scan, profile, table.empty_share, ms, ms * ratio)


def hiding_table(rows: list[HidingRow]) -> Table:
    """Return the rows as a table."""
    table = Table("scan", "profile", "empty blocks", "ms of all labels", "ms", "times faster")
    for row in rows:
        faster = row.all_labels_ms / row.ms
        numbers = (f"{row.empty_share:.2f}", f"{row.all_labels_ms:.2f}", f"{row.ms:.2f}", f"{faster:.2f}")
        table.add_row(row.scan, row.profile, *numbers)
    return table


def _hiding(source: Path, labels: Path, name: str) -> Scene:
    found = np.unique(np.asarray(nibabel.load(labels).dataobj))
    hidden = [int(each) for place, each in enumerate(found[found > 0]) if place % 3]
    return Scene.model_validate(
        {
            "name": f"hiding-{name}",
            "source": {"path": str(source)},
            "transfer": [{"name": each, "points": _POINTS} for each in ("veil", "inside")],
            "pyramid": {"coarsest_longest_axis": 4096},
            "render": {"step_voxels": 0.5},
            "segments": {
                "source": str(labels),
                "outside_opacity": 0.0,
                "style": [{"labels": hidden, "visible": False}],
            },
        }
    )


def _with_all_labels(package: Package) -> tuple[float, float]:
    """Return how many times the time a picture takes if hidden labels count, and milliseconds of one in which not."""
    with Renderer(package, edit=_counting_all_labels) as before, Renderer(package) as now:
        grid = now.level.grid
        matrix = standard_views(grid, "orthographic")["anterior-left"].box_from_clip(grid, 1.0)
        assert np.array_equal(*(each.render(matrix, (64, 64)) for each in (before, now)))
        wake(now.driver.renderer, lambda: _milliseconds(now, matrix))
        times = np.array([[_milliseconds(each, matrix) for each in (before, now)] for _ in range(_ROUNDS)])
    return float(np.median(times[:, 0] / times[:, 1])), float(np.median(times[:, 1]))


def _counting_all_labels(package: Package, inputs: Inputs) -> Inputs:
    """Return inputs whose skip table holds for any looks."""
    (skip,) = (each for each in inputs.textures if each.role == "skip")
    shown = package.manifest.segments.model_copy(update={"outside": 1.0})
    visible = tuple(each.model_copy(update={"visible": True}) for each in shown.segments)
    return replace(inputs, texels={skip.name: skip_texels(package, shown.model_copy(update={"segments": visible}), 0)})


def segments_table(rows: list[SegmentsRow]) -> Table:
    """Return the rows as a table."""
    table = Table("profile", "classification", "segments", "border", "lighting", "times the scan alone")
    for row in rows:
        table.add_row(row.profile, row.classification, row.segments, row.border, row.lighting, f"{row.ratio:.2f}")
    return table


def _write_scan(folder: Path) -> None:
    rng = np.random.default_rng(1)
    waves = ndimage.gaussian_filter(rng.normal(size=(_SIDE,) * 3), 3)
    places = np.indices(waves.shape).reshape(3, -1).T
    nearest, large = (
        KDTree(rng.uniform(0, _SIDE, (count, 3))).query(places)[1].reshape(waves.shape) for count in (1000, 27)
    )
    volumes = {
        "scan": (128 + 100 * waves / np.abs(waves).max()).astype(np.uint8),
        "regions": (nearest % 100).astype(np.int16),
        "organs": np.where(large % 3, large, 0).astype(np.int16),
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
    shown.print(hiding_table(measure_hiding(shown)))
