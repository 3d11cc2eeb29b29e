"""Packages against VTK's GPU ray caster: the same driver, scan, transfer function, views, picture size and steps.

VTK draws the scan as it is read, the package its own level 0; the truth of both is the oracle on the scan. Where they
are lit, VTK's truth is its own picture with an eighth of the step: it shades flat places as hard as steep ones, and a
package does not. VTK's error at a step is met by the package with a step of its own, which is where frames per second
are compared; both at the same step stand beside it. So does VTK where somebody has prepared its volume as a package's
is: cropped, in bytes. The limit is a loop that reads the same samples as the package does where it skips nothing and
ends no ray, and adds them.
"""

import math
import os
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scan.channels import opened_channel
from volprep.scene.request import load_request
from volprep.truth.camera import Camera, standard_views
from volprep.truth.decoded import level_volume
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float32Array, FloatArray
from volprep_formats.grid import Grid
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.progress import Silent
from volprep_formats.source import SourceSpec

from .bare_loop import bare, taking_all
from .drawing_time import honest_ms, picture_ms
from .real_scans import SCANS, scans_folder
from .waking import is_software

PRESETS = {"MR head": "mr-head", "ch2 head": "mr-head", "engine": "micro-ct"}
VIEWS = ("anterior", "superior", "anterior-left")
SIZE_HW = (256, 256)
"""Of the pictures whose errors are compared; on a software driver also of those whose times are."""
_GPU_SIZE_HW = (1024, 1024)
"""Of the pictures that a GPU is timed with: smaller ones take it less time than the processor takes to ask for them."""
_FINER = 8
"""Steps of VTK's own truth, and entries of its table, for each of those that are measured."""
STEP_VOXELS = 0.5
"""A third of a millimetre in the MR head."""
_OWN_STEPS = tuple(2.0 ** (eighths / 8) for eighths in range(16, -17, -1))
"""Steps of a package, as multiples of VTK's, the longest first."""
_CLASSIFICATIONS: tuple[ClassificationName, ...] = ("lookup", "control-points")
_ENTRIES = 1024
_ROUNDS = 3
_TURNS = 2
"""How often all are drawn in turn; the best time of each counts, because others may load the machine in between. VTK
takes up to 27 seconds of the processor for a turn."""
_SECONDS = 600.0
_TARGET = {"unlit": 5.0, "lit": 3.0}
LIMIT = 1.6


@dataclass(frozen=True)
class VtkRow:
    """One scan, lit or unlit, means over three views."""

    scan: str
    """Scan."""
    light: str
    """"unlit" or "lit"."""
    step_mm: float
    """Distance of VTK's samples."""
    vtk_ms: float
    """VTK's time of a picture."""
    vtk_rmse: float
    """VTK's error, against the truth of its own light."""
    vtk_bytes_ms: float
    """VTK's time for the package's level 0 in place of the scan."""
    ms: float
    """The package's time with the same step."""
    rmse: float
    """Its error."""
    equal_step_mm: float | None
    """The longest step with which the package is as near to the truth as VTK; None where none of those tried is."""
    equal_ms: float | None
    """Its time."""
    equal_with: str | None
    """The classification that takes least time for that: by a table, or from control points without one."""
    all_ms: float
    """The package's time with the same step where its rays skip nothing and run to their end."""
    bare_ms: float
    """Time of a loop that reads the same samples and adds them."""
    timed_pixels: int
    """Width and height of the pictures that times are of."""
    renderer: str
    """GL_RENDERER of both."""
    vtk: str
    """VTK and pyvista with their versions."""

    @property
    def times_faster(self) -> float:
        """VTK's time over the package's, at equal error, or at the same step where no step is as near."""
        return self.vtk_ms / (self.equal_ms or self.ms)

    @property
    def times_faster_on_bytes(self) -> float:
        """The same where VTK draws the package's level 0."""
        return self.vtk_bytes_ms / (self.equal_ms or self.ms)

    @property
    def over_limit(self) -> float:
        """Time of a package that takes all samples over that of the loop."""
        return self.all_ms / self.bare_ms


def measure_vtk(console: Console) -> Iterator[VtkRow]:
    """Draw three scans with both."""
    for scan, preset in PRESETS.items():
        for light in _TARGET:
            console.print(f"measuring VTK's ray caster on {scan}, {light}", style="dim")
            with tempfile.TemporaryDirectory() as folder:
                packages = {name: _package(scan, preset, light, name, Path(folder)) for name in _CLASSIFICATIONS}
                yield _row(scan, light, packages, Path(folder))


def vtk_table(rows: list[VtkRow]) -> Table:
    """Give the table of what `measure_vtk` found: "bytes" is VTK on level 0, "all" a package that skips nothing."""
    vtk, ours = ("step mm", "VTK ms", "RMSE", "bytes ms"), ("ours ms", "RMSE", "equal at", "with", "ms")
    table = Table("scan", *vtk, *ours, "faster", "bytes", "asked", "all ms", "loop ms", "ratio")
    for column in table.columns[1:]:
        column.justify = "right"
    for row in rows:
        equal = ("", "", "")
        if row.equal_ms is not None:
            equal = (f"{row.equal_step_mm:.2f}", row.equal_with or "", f"{row.equal_ms:.1f}")
        table.add_row(
            f"{row.scan}, {row.light}",
            f"{row.step_mm:.2f}",
            f"{row.vtk_ms:.1f}",
            f"{row.vtk_rmse:.5f}",
            f"{row.vtk_bytes_ms:.1f}",
            f"{row.ms:.1f}",
            f"{row.rmse:.5f}",
            *equal,
            f"{row.times_faster:.1f} ×",
            f"{row.times_faster_on_bytes:.1f} ×",
            f"{_TARGET[row.light]:g} ×",
            f"{row.all_ms:.1f}",
            f"{row.bare_ms:.1f}",
            f"{row.over_limit:.2f}",
        )
    return table


def _package(scan: str, preset: str, light: str, classification: ClassificationName, folder: Path) -> Package:
    source = SCANS[scan].format(scans_folder())
    lit = 'lighting = "headlight"\n[normals]\nkernel = "central"\n' if light == "lit" else 'lighting = "none"\n'
    scene = folder / "scene.toml"
    scene.write_text(
        f'name = "s"\n[source]\n{source}\n[pyramid]\ncoarsest_longest_axis = 100000\n'
        f'[[transfer]]\nname = "t"\npreset = "{preset}"\n[render]\n'
        f'classification = "{classification}"\n{lit}',
        encoding="utf-8",
    )
    target = folder / f"{classification}.volpkg"
    build(load_request(scene), target, Silent())
    return Package.open(target)


def _row(scan: str, light: str, packages: Mapping[ClassificationName, Package], scratch: Path) -> VtkRow:
    package = packages["lookup"]
    level, whole = level_volume(package, 0), _scan(scan)
    step_mm = STEP_VOXELS * min(level.grid.spacing_mm_zyx)
    function = package.manifest.transfer_functions[0]
    cameras = [standard_views(level.grid)[view] for view in VIEWS]
    views = _Views(level.grid, replace(whole, normals="central" if light == "lit" else None), function, cameras)
    lit = light == "lit"
    ask = partial(_vtk, function=function, cameras=cameras, step_mm=step_mm, lit=lit, scratch=scratch)
    vtk_rmse = _own_error(views, ask, whole, lit=lit)
    with ExitStack() as stack:
        own = stack.enter_context(Renderer(package))
        timed_hw = SIZE_HW if is_software(own.driver.renderer) else _GPU_SIZE_HW
        own_rmse = views.error(own, step_mm)
        all_of = stack.enter_context(Renderer(taking_all(package, own.program)))
        bare_of = stack.enter_context(Renderer(bare(package, own.program)))
        equal = {name: stack.enter_context(Renderer(each)) for name, each in packages.items()}
        steps = {name: _equal_step(each, views, step_mm, vtk_rmse) for name, each in equal.items()}
        timed: dict[str, Callable[[], float]] = {
            "own": lambda: views.time_ms(own, timed_hw, step_mm),
            "all": lambda: views.time_ms(all_of, timed_hw, step_mm),
            "bare": lambda: views.time_ms(bare_of, timed_hw, step_mm),
        }
        for name, step in steps.items():
            if step is not None:
                timed[name] = partial(views.time_ms, equal[name], timed_hw, step)
        best = dict.fromkeys(timed, math.inf)
        vtk = []
        for _ in range(_TURNS):
            vtk.append([ask(each, size_hw=timed_hw, rounds=_ROUNDS) for each in (whole, level)])
            best = {name: min(best[name], run()) for name, run in timed.items()}
    on_scan, on_bytes = (min(each, key=lambda drawn: drawn.ms) for each in zip(*vtk, strict=True))
    fastest = min((name for name in packages if name in best), key=best.__getitem__, default=None)
    return VtkRow(
        scan=scan,
        light=light,
        step_mm=step_mm,
        vtk_ms=on_scan.ms,
        vtk_rmse=vtk_rmse,
        vtk_bytes_ms=on_bytes.ms,
        ms=best["own"],
        rmse=own_rmse,
        equal_ms=None if fastest is None else best[fastest],
        equal_step_mm=None if fastest is None else steps[fastest],
        equal_with=fastest,
        all_ms=best["all"],
        bare_ms=best["bare"],
        timed_pixels=timed_hw[0],
        renderer=on_scan.driver,
        vtk=on_scan.version,
    )


def _own_error(views: "_Views", ask: Callable[..., "_Vtk"], scan: Volume, *, lit: bool) -> float:
    """Return VTK's error against the truth of its own light."""
    drawn = ask(scan, size_hw=SIZE_HW, rounds=0)
    if not lit:
        return views.rmse(drawn.pictures)
    finest = ask(scan, size_hw=SIZE_HW, rounds=0, finer=_FINER)
    return float(np.sqrt(np.mean((drawn.pictures - finest.pictures) ** 2)))


def _equal_step(renderer: Renderer, views: "_Views", step_mm: float, rmse: float) -> float | None:
    """Return the longest step with which a package's error is no larger than that; None if none of those tried is."""
    steps = (ratio * step_mm for ratio in _OWN_STEPS)
    return next((step for step in steps if views.error(renderer, step) <= rmse), None)


def _scan(scan: str) -> Volume:
    table = tomllib.loads(SCANS[scan].format(scans_folder()))
    with opened_channel("scan", SourceSpec.model_validate(table), None, Silent()) as source:
        info = source.info
        stored = source.read_slab(0, info.grid.shape_zyx[0])
    return Volume(np.ascontiguousarray(stored), info.grid, info.slope, info.intercept)


class _Views:
    """What is drawn, and what it should look like."""

    def __init__(self, grid: Grid, scan: Volume, function: TransferFunction, cameras: Sequence[Camera]) -> None:
        self.cameras = [camera.box_from_clip(grid, 1.0) for camera in cameras]
        self.truths = [
            oracle_picture(
                Volume(scan.stored, scan.grid, scan.slope, scan.intercept, normals=scan.normals),
                function,
                camera.box_from_clip(scan.grid, 1.0),
                SIZE_HW,
            ).rgba
            for camera in cameras
        ]

    def time_ms(self, renderer: Renderer, size_hw: tuple[int, int], step_mm: float) -> float:
        """Mean of the times of all views."""
        return float(np.mean([picture_ms(renderer, camera, size_hw, step_mm, _ROUNDS) for camera in self.cameras]))

    def error(self, renderer: Renderer, step_mm: float) -> float:
        """Error over all views."""
        return self.rmse([renderer.render(camera, SIZE_HW, step_mm) for camera in self.cameras])

    def rmse(self, pictures: Iterable[FloatArray]) -> float:
        """Root mean square over all views."""
        squares = [np.mean((picture - truth) ** 2) for picture, truth in zip(pictures, self.truths, strict=True)]
        return float(np.sqrt(np.mean(squares)))


@dataclass(frozen=True)
class _Vtk:
    """What VTK drew."""

    pictures: Float32Array
    wall_ms: float
    cpu_ms: float
    driver: str
    version: str

    @property
    def ms(self) -> float:
        """Time of a picture."""
        return honest_ms(self.driver, self.wall_ms, self.cpu_ms)


def _vtk(
    volume: Volume,
    *,
    function: TransferFunction,
    cameras: Sequence[Camera],
    step_mm: float,
    lit: bool,
    size_hw: tuple[int, int],
    rounds: int,
    scratch: Path,
    finer: int = 1,
) -> _Vtk:
    scan, task, result = (scratch / name for name in ("scan.npy", "task.npz", "result.npz"))
    np.save(scan, volume.stored)
    np.savez(
        task,
        scan=str(scan),
        spacing_mm_zyx=volume.grid.spacing_mm_zyx,
        corner_mm_xyz=volume.grid.corner_mm_xyz,
        direction=np.array(volume.grid.direction),
        values=[(point.value - volume.intercept) / volume.slope for point in function.points],
        colours=np.array([point.colour for point in function.points]),
        extinctions_per_mm=[point.extinction_per_mm for point in function.points],
        blend="composite",
        reference_mm=1.0,
        steps_mm=[step_mm / finer],
        entries=[_ENTRIES * finer],
        eye_mm_xyz=[camera.eye_mm_xyz for camera in cameras],
        forward=[camera.forward for camera in cameras],
        up=[camera.up for camera in cameras],
        height_mm=[camera.height_mm for camera in cameras],
        focus_mm=[camera.focus_mm for camera in cameras],
        perspective=0,
        picture_size=size_hw[0],
        lit=int(lit),
        rounds=rounds,
    )
    # VTK finds EGL by itself, but first warns that there is no X server.
    environment = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow", **os.environ}
    command = [sys.executable, "-m", f"{__package__}.vtk_times", str(task), str(result)]
    subprocess.run(command, env=environment, check=True, timeout=_SECONDS)
    with np.load(result) as drawn:
        pictures: NDArray[np.uint8] = drawn["pictures"][0]
        walls, cpus, driver = drawn["wall_ms"], drawn["cpu_ms"], drawn["driver"].tolist()
        version = str(drawn["version"])
    return _Vtk(pictures.astype(np.float32) / np.float32(255), walls.mean(), cpus.mean(), driver[1], version)
