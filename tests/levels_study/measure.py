"""Rows of the study: how far a level's pictures are from the truth over seen pixels, and the light of thin things."""

import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tests.levels_study.optimum import optimum
from tests.levels_study.subjects import Subject
from volprep.parts.levels.appearance import largest_code
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.level_input import Factors, LevelInput, level_slices
from volprep.parts.levels.refined import AUTO, THOROUGH, RefineBudget
from volprep.parts.levels.stage import CANDIDATES
from volprep.scan.in_memory import InMemory
from volprep.transfer.lookup import lookup_table
from volprep.truth.camera import Camera, standard_views
from volprep.truth.kept_light import SmallThing, small_things
from volprep.truth.oracle import oracle_picture
from volprep.truth.seen import seen_pixels
from volprep.truth.volume import Volume
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import LevelFilter
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint

_FILTERS: tuple[LevelFilter, ...] = ("box", "appearance", "feature-preserving", "maximum", "raised")
_WITHOUT = tuple(name for name in CANDIDATES if name != "refined")
_RANDOM_VIEWS = 3
_TOLERANCE = 1e-3
SHOWN = ("box", "auto, not refined", "auto", "optimum")
"""Ways whose pictures are written: the second is "auto" as it was before levels were refined."""


@dataclass(frozen=True)
class StudyRow:
    """One way to make one level."""

    subject: str
    """Phantom, or scan and transfer function."""
    held_out: bool
    """Whether nothing was tuned on it."""
    level: int
    """Number of the level; its factor is 2 to this power."""
    way: str
    """A filter with the common table, "auto" with what the plan may choose, or the optimum."""
    chosen: str
    """Filter that "auto" took."""
    seen_rmse: float
    """Root mean square over the seen pixels of all views and four channels, premultiplied linear."""
    kept_light: float
    """Part of the light that thin things of all views keep together; 1 without thin things."""
    least_kept: float
    """The same of the thing that keeps the least."""
    size_bytes: int
    """Of the level and its table."""
    seconds: float
    """What making it took."""


@dataclass(frozen=True)
class StudyPicture:
    """A picture of a level, in the last view."""

    subject: str
    level: int
    way: str
    rgba: Float64Array


@dataclass(frozen=True)
class _Made:
    """A level, and the table that classifies it."""

    way: str
    chosen: str
    voxels: NDArray[np.generic]
    table: Float64Array
    seconds: float


@dataclass(frozen=True)
class _Way:
    """A way to choose levels, prepared for all of them."""

    name: str
    chooser: Chooser
    candidates: tuple[LevelFilter, ...]
    seconds: float
    """What preparing it took, for each level."""


def measure(
    subject: Subject, levels: Sequence[int], pixels: int, *, thorough: bool = False
) -> Iterator[tuple[StudyRow, StudyPicture]]:
    """Make and measure all ways to make some levels of a subject; the truth comes first, as level 0."""
    bench = _Bench(subject, pixels)
    yield bench.row(0, _Made("truth", "none", subject.codes, bench.table, 0.0))
    factors = [bench.factors(level) for level in levels]
    with tempfile.TemporaryDirectory() as folder:
        budgets = {"auto, not refined": None, "auto": AUTO, **({"auto, thorough": THOROUGH} if thorough else {})}
        ways = [bench.way(name, factors, budget) for name, budget in budgets.items()]
        for level, each in zip(levels, factors, strict=True):
            for name in _FILTERS:
                yield bench.row(level, bench.filtered(name, each))
            for way in ways:
                made = bench.chosen(way, each, Path(folder))
                yield bench.row(level, made)
                if way.name == "auto":
                    auto = made
            began = time.perf_counter()
            best = optimum(bench.scan, each, auto.voxels, auto.table)
            if best is not None:
                seconds = time.perf_counter() - began
                yield bench.row(level, _Made("optimum", "none", best.voxels, best.table, seconds))


class _Bench:
    """One subject and its true pictures."""

    def __init__(self, subject: Subject, pixels: int) -> None:
        self._subject = subject
        self._pixels = pixels
        self.table = lookup_table(subject.function, subject.window, 256)
        self.scan = LevelInput(InMemory.of(subject.codes), subject.grid, {subject.function.name: self.table})
        self._views = _views(subject)
        whole = _Made("truth", "none", subject.codes, self.table, 0.0)
        self._truth = self._pictures(whole, 0, subject.function)

    def factors(self, level: int) -> Factors:
        """Halve those axes that are nearly the finest, as plans do; phantoms and most scans have cubes."""
        z, y, x = (2**level for _ in range(3))
        return z, y, x

    def filtered(self, name: LevelFilter, factors: Factors) -> _Made:
        """Make a level by a filter, with the common table."""
        began = time.perf_counter()
        voxels = np.concatenate([slices for slices, _ in level_slices(self.scan, name, factors)])
        return _Made(name, name, voxels, self.table, time.perf_counter() - began)

    def way(self, name: str, levels: Sequence[Factors], budget: RefineBudget | None) -> _Way:
        """Prepare making all levels as a build does."""
        began = time.perf_counter()
        chooser = Chooser(self.scan, adapt=True, levels=levels, budget=budget)
        candidates = _WITHOUT if budget is None else CANDIDATES
        return _Way(name, chooser, candidates, (time.perf_counter() - began) / len(levels))

    def chosen(self, way: _Way, factors: Factors, folder: Path) -> _Made:
        """Make a level as a build does."""
        began = time.perf_counter()
        choice, codes = way.chooser.choose(1, factors, way.candidates, folder.joinpath, lambda _: None)
        seconds = way.seconds + time.perf_counter() - began
        voxels = codes.read_slab(0, codes.shape_zyx[0]).copy()
        table = np.array(choice.tables[0].entries) if choice.tables else self.table
        return _Made(way.name, choice.filter, voxels, table, seconds)

    def row(self, level: int, made: _Made) -> tuple[StudyRow, StudyPicture]:
        """Measure a level."""
        subject = self._subject
        function = subject.function if made.table is self.table else _function(made.table, subject.window)
        pictures = self._pictures(made, level, function)
        squares, seen = 0.0, 0
        things: list[SmallThing] = []
        for picture, truth in zip(pictures, self._truth, strict=True):
            mask = seen_pixels(picture, truth)
            squares += float(((picture - truth)[mask] ** 2).sum())
            seen += 4 * int(mask.sum())
            things += small_things(picture, truth, 2 * 2**level * self._pixels_per_voxel, spreads=True)
        light = sum(thing.light for thing in things)
        row = StudyRow(
            subject=subject.name,
            held_out=subject.held_out,
            level=level,
            way=made.way,
            chosen=made.chosen,
            seen_rmse=float(np.sqrt(squares / max(seen, 1))),
            kept_light=sum(thing.light * thing.kept for thing in things) / light if light else 1.0,
            least_kept=min((thing.kept for thing in things), default=1.0),
            size_bytes=made.voxels.size * subject.codes.dtype.itemsize + (made.table is not self.table) * 8 * 256,
            seconds=made.seconds,
        )
        return row, StudyPicture(subject.name, level, made.way, pictures[-1])

    @property
    def _pixels_per_voxel(self) -> float:
        return min(self._subject.grid.spacing_mm_zyx) * self._pixels / self._views[0].height_mm

    def _pictures(self, made: _Made, level: int, function: TransferFunction) -> list[Float64Array]:
        grid = self._subject.grid.coarser(self.factors(level)) if level else self._subject.grid
        low, high = self._subject.window
        largest = 1.0 if made.voxels.dtype == np.float32 else float(largest_code(made.voxels.dtype))
        return [
            oracle_picture(
                Volume(made.voxels, grid, (high - low) / largest, low),
                function,
                camera.box_from_clip(self._subject.grid, 1.0),
                (self._pixels, self._pixels),
                _TOLERANCE,
            ).rgba
            for camera in self._views
        ]


def _views(subject: Subject) -> list[Camera]:
    """Return the nine standard views and some random ones; random directions are the last."""
    views = list(standard_views(subject.grid).values())
    extent_mm_xyz = np.array(subject.grid.extent_mm_zyx[::-1])
    centre = subject.grid.corner_mm_xyz + np.array(subject.grid.direction) @ (extent_mm_xyz / 2)
    generator = np.random.default_rng(23)
    for _ in range(_RANDOM_VIEWS):
        forward, up = generator.normal(size=(2, 3))
        x, y, z = (centre - forward / np.linalg.norm(forward) * views[0].focus_mm).tolist()
        views.append(replace(views[0], eye_mm_xyz=(x, y, z), forward=tuple(forward), up=tuple(up)))
    return views


def _function(table: Float64Array, window: tuple[float, float]) -> TransferFunction:
    values = np.linspace(*window, len(table))
    points = (
        TransferPoint(value=float(value), colour=(float(r), float(g), float(b)), extinction_per_mm=float(extinction))
        for value, (r, g, b, extinction) in zip(values, table, strict=True)
    )
    return TransferFunction(name="table", points=tuple(points))
