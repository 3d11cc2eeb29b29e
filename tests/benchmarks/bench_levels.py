"""Coarse levels: how near their pictures come to those of level 0, on real scans, in the nine standard views.

Truth is the oracle on the scan itself. What is measured is the oracle on the level's codes with the table that
classifies them, so that neither a renderer nor a step length is in the numbers. The filter is chosen and the tables are
fitted as a build does it: along random rays, never in the views that are measured. Beside it stands the level of an
editable package: no transfer function is in its filter and histogram, so that each row is that of an edit.
"""

import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table as Rows

from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.joint_histogram import joint_shares
from volprep.parts.levels.level_input import LevelInput
from volprep.parts.levels.stage import CANDIDATES, FREE_CANDIDATES
from volprep.parts.work import codes_of_source, source_volume
from volprep.pipeline.import_draft import import_draft
from volprep.pipeline.plan_draft import plan_draft
from volprep.pipeline.prepare import prepare
from volprep.pipeline.stage_graph import STAGES
from volprep.pipeline.stages import run_stage
from volprep.plan.level_choice import Trial
from volprep.plan.records import ChannelPlan
from volprep.scan.slabs import RawVolume
from volprep.scene.request import Request, load_request
from volprep.transfer.lookup import lookup_table
from volprep.truth.camera import standard_views
from volprep.truth.oracle import oracle_picture
from volprep.truth.volume import Volume
from volprep_formats.grid import Grid
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.parts.editing.record import encode_histogram
from volprep_formats.package.storage.draft import Draft
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.progress import Silent

from .real_scans import scans_folder

SIZE = 128
_ORACLE_TOLERANCE = 1e-4
_FILTERS: tuple[LevelFilter, ...] = (*CANDIDATES, "maximum", "gaussian", "lanczos3", "feature-preserving")
LEVELS = (1, 2)

_POINT = '{{ value = {}, colour = "{}", extinction_per_mm = {} }}'
_Points = tuple[tuple[float, str, float], ...]
_SKIN = ("#8a5a44", "#e0ac8c", "#f0c8a8", "#ffe8d8")
_HEAD = ("#6b4032", "#c08a6a", "#a85f50", "#c98a78", "#ecd2bc", "#fff6ea", "#ffdcc8", "#c01810")
_BRAIN = ("#3b0f14", "#7a2b26", "#d98f78", "#eac4ab", "#fff4e6", "#ffe0a0")


def _points(colours: tuple[str, ...], values: tuple[float, ...], extinctions: tuple[float, ...]) -> _Points:
    return tuple(zip(values, colours, extinctions, strict=True))


SCENES: dict[str, tuple[str, dict[str, _Points]]] = {
    "head": (
        'path = "{}/mr_t1_studyforrest"',
        {
            "head": _points(_HEAD, (12, 30, 48, 58, 68, 78, 95, 120), (0, 0.012, 0.02, 0.2, 0.5, 0.8, 0.8, 1.5)),
            "skin": _points(_SKIN, (14, 30, 60, 120), (0, 0.6, 1.0, 1.5)),
        },
    ),
    "ch2": (
        'path = "{}/nifti_ch2/ch2.nii.gz"',
        {
            "brain": _points(_BRAIN, (60, 78, 88, 100, 115, 150), (0, 0.04, 0.22, 0.28, 0.45, 0.6)),
            "skin": _points(_SKIN, (30, 55, 100, 180), (0, 0.4, 0.8, 1.2)),
        },
    ),
    "shell": (
        'path = "{}/qim_microct/shell_225x128x128.tif"',
        {
            "glass": ((60, "#203050", 0), (100, "#5a8ac0", 0.03), (150, "#b0c8e0", 0.08), (220, "#ffd080", 0.5)),
            "solid": ((60, "#402818", 0), (120, "#c89868", 0.6), (200, "#fff0d8", 1.5)),
        },
    ),
    "fly": (
        'path = "{}/qim_microct/fly_150x256x256.tif"',
        {
            "veil": ((15, "#203048", 0), (60, "#6890b0", 0.03), (120, "#e0b070", 0.3), (200, "#fff0c0", 0.9)),
            "solid": ((30, "#3a2a20", 0), (60, "#b08050", 0.6), (130, "#f0d8a8", 1.5)),
        },
    ),
    "engine": (
        """path = "{}/engine_pair/data/engine_256x256x128_uint8.raw.gz"
        raw = {{ shape_zyx = [128, 256, 256], dtype = "uint8" }}""",
        {
            "veil": _points(
                ("#3d5a80", "#7fa7c9", "#98c1d9", "#ee6c4d", "#ffd9a0"),
                (45, 90, 140, 170, 230),
                (0, 0.006, 0.012, 0.15, 0.5),
            ),
            "solid": ((60, "#30343a", 0), (110, "#a4adb8", 0.4), (160, "#e8ecf0", 0.8), (200, "#f3c577", 1.5)),
        },
    ),
    "CT phantom": (
        'path = "{}/ct_phantom_tilt-18.5/S2010"\nrepair = ["tilt"]',
        {
            "veil": _points(
                ("#304860", "#6890a8", "#c8a890", "#e8d8b8", "#ffffff"),
                (-800, -300, 100, 500, 760),
                (0, 0.004, 0.012, 0.1, 0.5),
            ),
            "solid": ((-500, "#604838", 0), (-200, "#c89878", 0.3), (300, "#e8d0b0", 0.8), (700, "#ffffff", 2.0)),
        },
    ),
}
"""Scans and transfer functions: those of sample_specs where there is one, for each scan one veil and one surface."""


@dataclass(frozen=True)
class LevelRow:
    """One level, through one transfer function."""

    scan: str
    """Name of the scan."""
    level: int
    """Level."""
    transfer: str
    """Transfer function."""
    chosen: str
    """Filter that "auto" took, and whether with a table of its own."""
    box_rmse: float
    """Error of the pictures of the box filter with the common table: root mean square, premultiplied linear."""
    rmse: float
    """Error of what was chosen."""
    gain: float
    """By what part it is lower."""
    editable: str
    """Filter of a package whose transfer functions users may edit."""
    editable_gain: float
    """By what part its error is lower, with the table of its joint histogram."""
    histogram_bytes: int
    """Size of that."""
    editable_seconds: float
    """What it took to try the filters that depend on no transfer function, with histograms."""
    tried: dict[str, tuple[float, float, float]]
    """For each filter: gain with the common table, with one of its own, and the seconds that both took."""


def measure_levels(console: Console) -> Iterator[LevelRow]:
    """Measure all scans."""
    data = scans_folder()
    for scan in SCENES:
        with tempfile.TemporaryDirectory() as folder:
            bench = _Bench(scan, request_of(scan, data, Path(folder)), Path(folder))
            for level in LEVELS:
                console.print(f"measuring level {level} of {scan}", style="dim")
                yield from bench.rows(level)


def levels_table(rows: list[LevelRow]) -> Rows:
    """Draw the rows for people, with the means and whatever is worse than box."""
    table = Rows(title="Error of coarse levels in the nine standard views, against box with the common table")
    for name in ("scan", "level", "transfer", "box", "chosen", "error", "lower by", "editable", "lower by", *_FILTERS):
        table.add_column(name, justify="left" if name in {"scan", "transfer", "chosen", "editable"} else "right")
    for row in rows:
        tried = [f"{common:+.0%} {own:+.0%}" for common, own, _ in (row.tried[name] for name in _FILTERS)]
        numbers = (f"{row.box_rmse:.4f}", row.chosen, f"{row.rmse:.4f}", f"{row.gain:.1%}")
        editable = (f"{row.editable} {row.histogram_bytes / 1e3:.0f} kB", f"{row.editable_gain:.1%}")
        table.add_row(row.scan, str(row.level), row.transfer, *numbers, *editable, *tried)
    means = [
        f"level {level} lower by {np.mean([row.gain for row in rows if row.level == level]):.1%}, editable by "
        f"{np.mean([row.editable_gain for row in rows if row.level == level]):.1%}"
        for level in LEVELS
        if rows
    ]
    worse = [f"{row.scan} {row.transfer} level {row.level}" for row in rows if min(row.gain, row.editable_gain) < 0]
    table.caption = (
        "; ".join(means)
        + f"; worse than box: {', '.join(worse) or 'none'}. Of each filter: lower with the common table, with its own."
    )
    return table


@dataclass(frozen=True)
class _Editable:
    """A level that depends on no transfer function."""

    filter: str
    errors: dict[str, float]
    histogram_bytes: int
    seconds: float


class _Bench:
    """One scan, its true pictures, and its levels."""

    def __init__(self, name: str, request: Request, folder: Path) -> None:
        self._name = name
        self._draft = import_draft(prepare(request), folder / "draft", Silent()).draft
        of_package = plan_draft(self._draft, request.scene, request.profile, Silent())
        quantize = next(stage for stage in STAGES if stage.name == "quantize")
        run_stage(self._draft, quantize, of_package, request.scene, Silent())
        self._folder = folder
        (plan,) = of_package.channels
        self._plan = plan
        window, entries = plan.quantize.window, plan.lookups[0].entries
        self._tables = {each.name: lookup_table(each, window, entries) for each in plan.transfer_functions}
        codes = codes_of_source(self._draft, plan)
        self._scan = LevelInput(codes, plan.grid, self._tables)
        self._chooser = Chooser(self._scan, adapt=True)
        self._editable = Chooser(self._scan, adapt=True, editable=True)
        self._truth = {each.name: list(_true_pictures(self._draft, plan, each)) for each in plan.transfer_functions}

    def rows(self, level: int) -> list[LevelRow]:
        factors = self._plan.level(level).factors_zyx
        measured: dict[str, dict[str, tuple[float, float, float]]] = {}
        chosen = ""
        best = np.inf
        units: dict[str, float] = {}
        for name in _FILTERS:
            began = time.perf_counter()
            choice, codes = self._chooser.choose(level, factors, (name,), self._scratch, lambda _: None)
            seconds = time.perf_counter() - began
            own = {table.transfer: np.array(table.entries) for table in choice.tables}
            tried: dict[str, tuple[float, float, float]] = {}
            for transfer, common in self._tables.items():
                plain = self._error(codes, factors, transfer, common)
                adapted = self._error(codes, factors, transfer, own[transfer]) if transfer in own else plain
                tried[transfer] = plain, adapted, seconds
            measured[name] = tried
            # The first is the box filter, in whose errors the others are counted.
            units = units or {trial.transfer: trial.rmse for trial in choice.trials if trial.table == "common"}
            score = _score(choice.trials, units)
            if name in CANDIDATES and score < best:
                best, chosen = score, name
            codes.path.unlink()
        editable = self._edited(level, factors)
        return [self._row(level, transfer, chosen, measured, editable) for transfer in self._tables]

    def _edited(self, level: int, factors: tuple[int, int, int]) -> "_Editable":
        """Measure the level of a package whose transfer functions users may edit."""
        began = time.perf_counter()
        choice, codes = self._editable.choose(level, factors, FREE_CANDIDATES, self._scratch, lambda _: None)
        size = len(encode_histogram(joint_shares(self._scan.volume, codes, factors)))
        seconds = time.perf_counter() - began
        errors = {
            table.transfer: self._error(codes, factors, table.transfer, np.array(table.entries))
            for table in choice.tables
        }
        codes.path.unlink()
        return _Editable(choice.filter, errors, size, seconds)

    def _row(
        self,
        level: int,
        transfer: str,
        chosen: str,
        measured: dict[str, dict[str, tuple[float, float, float]]],
        editable: "_Editable",
    ) -> LevelRow:
        box = measured["box"][transfer][0]
        common, own, _ = measured[chosen][transfer]
        return LevelRow(
            scan=self._name,
            level=level,
            transfer=transfer,
            chosen=chosen + (" + table" if own != common else ""),
            box_rmse=box,
            rmse=own,
            gain=1 - own / box,
            editable=editable.filter,
            editable_gain=1 - editable.errors[transfer] / box,
            histogram_bytes=editable.histogram_bytes,
            editable_seconds=editable.seconds,
            tried={
                name: (1 - each[transfer][0] / box, 1 - each[transfer][1] / box, each[transfer][2])
                for name, each in measured.items()
            },
        )

    def _scratch(self, name: str) -> Path:
        return self._folder / name

    def _error(
        self, codes: RawVolume, factors: tuple[int, int, int], transfer: str, table: NDArray[np.float64]
    ) -> float:
        low, high = self._plan.quantize.window
        grid = self._plan.grid if factors == (1, 1, 1) else self._plan.grid.coarser(factors)
        slope = (high - low) / (2**self._plan.quantize.bits - 1)
        voxels = codes.read_slab(0, codes.shape_zyx[0])
        function = _function(table, low, high)
        pictures = _pictures(voxels, grid, slope, low, function)
        squares = [np.mean((one - true) ** 2) for one, true in zip(pictures, self._truth[transfer], strict=True)]
        return float(np.sqrt(np.mean(squares)))


def _score(trials: tuple[Trial, ...], units: dict[str, float]) -> float:
    best = {name: min(trial.rmse for trial in trials if trial.transfer == name) for name in units}
    return float(np.mean([best[name] / unit for name, unit in units.items()]))


def request_of(scan: str, data: Path, folder: Path) -> Request:
    """Give the scene of a scan below `data`; its file is written to `folder`."""
    source, functions = SCENES[scan]
    text = f'name = "levels"\nprofile = "gles3"\n[source]\n{source.format(data)}\n'
    for name, points in functions.items():
        listed = ", ".join(_POINT.format(*point) for point in points)
        text += f'[[transfer]]\nname = "{name}"\npoints = [{listed}]\n'
    path = folder / "scene.toml"
    path.write_text(text)
    return load_request(path)


def _true_pictures(draft: Draft, plan: ChannelPlan, function: TransferFunction) -> Iterator[NDArray[np.float64]]:
    source = source_volume(draft, plan.channel)
    info = draft.manifest.source.info
    crop = tuple(slice(a, b) for a, b in zip(plan.crop.start_zyx, plan.crop.stop_zyx, strict=True))
    voxels = np.ascontiguousarray(source.read_slab(0, source.shape_zyx[0])[crop])
    yield from _pictures(voxels, plan.grid, info.slope, info.intercept, function)


def _pictures(
    voxels: NDArray[np.generic], grid: Grid, slope: float, intercept: float, function: TransferFunction
) -> Iterator[NDArray[np.float64]]:
    for camera in standard_views(grid).values():
        box_from_clip = camera.box_from_clip(grid, aspect=1.0)
        yield oracle_picture(
            Volume(voxels, grid, slope, intercept), function, box_from_clip, (SIZE, SIZE), _ORACLE_TOLERANCE
        ).rgba


def _function(table: NDArray[np.float64], low: float, high: float) -> TransferFunction:
    values = np.linspace(low, high, len(table)).tolist()
    points = tuple(
        TransferPoint(value=value, colour=(red, green, blue), extinction_per_mm=extinction)
        for value, (red, green, blue, extinction) in zip(values, table.tolist(), strict=True)
    )
    return TransferFunction(name="table", points=points)
