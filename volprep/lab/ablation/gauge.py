"""Measure bytes, time, error and change of variants against the package as planned."""

import time
import zlib
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from statistics import median
from typing import Literal

import numpy as np

from volprep.lab.ablation.records import Measurement, Ratio
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.render.timing import Spread, draws_with_processor, paired_ms
from volprep.truth.averaged import averaged
from volprep.truth.decoded import light_of_scan
from volprep.truth.seen import seen_error
from volprep.truth.volume import Volume
from volprep.validation.comparison.pixels import pixels_of
from volprep.validation.comparison.precise_target import finite, most_precise
from volprep.validation.results.measurements import Target
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.arrays import Float32Array, Float64Array, FloatArray
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package

_SHORT = (0.125, 0.25, 0.5, 1.0)
"""Steps, as parts of the nominal one, of pictures in which the place of samples shall not matter."""

_LEAST_TURNS, _SECONDS = 15, 2.0
"""Minimum number of turns, and minimum time, for which two packages are drawn alternately. For two equally fast
packages, 12 of 15 ratios fall on one side of 1 once in fifty runs."""


@dataclass(frozen=True)
class Timed:
    """Two packages, drawn in turns."""

    planned_ms: float
    """Median time of the planned one."""
    other_ms: float
    """Median time of the other one."""
    ratio: Ratio
    """Time of the other one over that of the planned one, turn by turn."""


class PackageGauge:
    """Measures packages against the one that is as planned."""

    def __init__(self, planned: Package, scan: Volume, picture_size: int) -> None:
        self.planned = planned
        self.subject = Subject(planned, scan, picture_size)
        self._truths: dict[tuple[str, str], Mapping[str, FloatArray]] = {}
        self._short: dict[tuple[str, float, str], Mapping[str, Float32Array]] = {}
        first = self.subject.programs[0].transfer
        with ray_caster_of(planned, None, first)(planned, transfer=first) as renderer:
            self.renderer = renderer.driver.renderer
            """The OpenGL ES that draws."""
        self.clock: Literal["wall", "processor"] = "processor" if draws_with_processor(self.renderer) else "wall"
        """Clock that is used."""
        self.transfers = tuple(program.transfer for program in self.subject.programs)
        """Transfer functions that are drawn."""

    def measured(
        self, package: Package, transfers: Sequence[str], milliseconds: float, ratio: Ratio | None = None
    ) -> Measurement:
        """Return bytes and errors of a package with its time; `ratio` is its time over the planned package's."""
        costs = _costs(package.manifest, transfers)
        found = [self.errors(package, transfer) for transfer in transfers]
        return Measurement(
            package_bytes=sum(record.size_bytes for record in package.manifest.files),
            transport_bytes=_transport_bytes(package),
            upload_bytes=sum(upload for upload, _ in costs),
            gpu_bytes=sum(memory for _, memory in costs),
            milliseconds=milliseconds,
            ratio=ratio,
            rmse=max(rmse for rmse, _ in found),
            maximum=max(maximum for _, maximum in found),
        )

    def timed(
        self,
        other: Package,
        transfers: Sequence[str],
        levels: tuple[int, int] | None = None,
        other_step_mm: float | None = None,
    ) -> Timed:
        """Draw the planned package and another one in turns, each with its nominal step unless the other has its own.

        `levels` are theirs, the finest of each if absent.
        """
        planned_level, other_level = levels or (_finest(self.planned), _finest(other))
        with ExitStack() as stack:
            ones = [self._open(stack, self.planned, transfer, planned_level) for transfer in transfers]
            others = [self._open(stack, other, transfer, other_level) for transfer in transfers]
            one_ms, other_ms = paired_ms(
                lambda: self._time(ones, self.planned),
                lambda: self._time(others, other, other_step_mm),
                least=_LEAST_TURNS,
                seconds=_SECONDS,
            )
        spread = Spread.of([after / max(before, 1e-9) for before, after in zip(one_ms, other_ms, strict=True)])
        ratio = Ratio(median=spread.median, low=spread.low, high=spread.high, turns=spread.count)
        return Timed(median(one_ms), median(other_ms), ratio)

    def errors(self, package: Package, transfer: str, level: int | None = None) -> tuple[float, float]:
        """Return the worst root mean square and the worst largest error over the standard views."""
        drawn, truth = self._drawn(package, transfer, level), self._truth(package, transfer)
        return worst_difference(drawn, truth)

    def level_error(self, package: Package, transfer: str, level: int) -> float:
        """Return the root mean square error of a coarse level over all views, with one pixel for a voxel.

        A table is fitted to light from all directions, so single views may be worse with it.
        """
        found = package.manifest.level(level)
        pixels = pixels_of(self.subject, found)
        drawn, truth = self._drawn(package, transfer, level), self._truth(package, transfer)
        squares = [
            np.square(averaged(drawn[name], pixels) - averaged(truth[name], pixels)).mean(dtype=np.float64)
            for name in truth
        ]
        return float(np.sqrt(np.mean(squares)))

    def change(self, package: Package, transfers: Sequence[str]) -> tuple[float, float]:
        """Return the errors of a package's pictures against the planned package's, as `errors` over the transfers."""
        found = [self._change(package, transfer) for transfer in transfers]
        return max(rmse for rmse, _ in found), max(maximum for _, maximum in found)

    def _change(self, package: Package, transfer: str) -> tuple[float, float]:
        if package.manifest.levels[0].grid != self.planned.manifest.levels[0].grid and not self.subject.is_classified:
            return worst_difference(self._integrals(package, transfer), self._integrals(self.planned, transfer))
        for part in _SHORT:
            pictures = self._with_short_steps(package, transfer, part)
            if pictures is not None:
                planned = self._short_of_planned(transfer, part)
                if planned is not None:
                    return worst_difference(pictures, planned)
        return worst_difference(self._drawn(package, transfer, None), self._drawn(self.planned, transfer, None))

    def _integrals(self, package: Package, transfer: str) -> dict[str, FloatArray]:
        """Integrate a package's data, in all views.

        Rays begin at the faces of the box. In another box all samples lie elsewhere, and for lit scenes, whose light
        jumps from sample to sample, even an eighth of the step left 0.009 of that.
        """
        subject = Subject(package, self.subject.scan, self.subject.shape_hw[0])
        subject.cameras = self.subject.cameras
        return {name: subject.on_data(transfer, name, _finest(package)).rgba for name in subject.cameras}

    def _short_of_planned(self, transfer: str, part: float) -> Mapping[str, Float32Array] | None:
        key = (transfer, part, "")
        if key not in self._short:
            drawn = self._with_short_steps(self.planned, transfer, part)
            if drawn is None:
                return None
            self._short[key] = drawn
        return self._short[key]

    def _with_short_steps(self, package: Package, transfer: str, part: float) -> dict[str, Float32Array] | None:
        """Draw all views into a float target; None if package or driver cannot take so short steps."""
        step_mm = part * self.subject.step_mm

        def draw(target: Target) -> dict[str, Float32Array] | None:
            level = _finest(package)
            kind = ray_caster_of(package, level, transfer)
            with kind(package, level=level, transfer=transfer, target=target) as renderer:
                if not renderer.draws_step(step_mm):
                    return None
                views = self._views(package).items()
                shape_hw, drawn_by = self.subject.shape_hw, renderer.program.name
                return {
                    name: finite(renderer.render(view, shape_hw, step_mm), drawn_by, target) for name, view in views
                }

        return most_precise(draw)

    def _drawn(self, package: Package, transfer: str, level: int | None) -> dict[str, Float32Array]:
        kind = ray_caster_of(package, level, transfer)
        with kind(package, level=level, transfer=transfer) as renderer:
            views = self._views(package).items()
            return {name: renderer.render(view, self.subject.shape_hw) for name, view in views}

    def _truth(self, package: Package, transfer: str) -> Mapping[str, FloatArray]:
        """Return the true pictures of a package; a lit one is lit by its own light."""
        light = light_of_scan(package.manifest)
        key = (transfer, repr(light))
        if key not in self._truths:
            scan = replace(self.subject.scan, normals=light)
            subject = Subject(self.planned, scan, self.subject.shape_hw[0])
            self._truths[key] = {name: subject.truth(transfer, name).rgba for name in subject.views}
        return self._truths[key]

    def _views(self, package: Package) -> dict[str, Float64Array]:
        """Return the same views in the box of any package: one with its border has a larger box."""
        grid = package.manifest.levels[0].grid
        return {name: camera.box_from_clip(grid, aspect=1.0) for name, camera in self.subject.cameras.items()}

    def _open(self, stack: ExitStack, package: Package, transfer: str, level: int) -> Renderer:
        kind = ray_caster_of(package, level, transfer)
        return stack.enter_context(kind(package, level=level, transfer=transfer))

    def _time(self, renderers: Sequence[Renderer], package: Package, step_mm: float | None = None) -> float:
        view = self._views(package)[SWEEP_VIEW]
        clock = time.process_time if self.clock == "processor" else time.perf_counter
        return sum(
            renderer.time_ms(view, self.subject.shape_hw, step_mm, repeats=1, clock=clock) for renderer in renderers
        )


def worst_difference(one: Mapping[str, FloatArray], other: Mapping[str, FloatArray]) -> tuple[float, float]:
    """Return the largest root mean square over seen pixels, and the largest difference, over views."""
    found = [seen_error(one[name], other[name]) for name in one]
    return max(error.rmse for error in found), max(error.maximum for error in found)


def _finest(package: Package) -> int:
    return min(drawing.level for _, drawing in package.manifest.drawings)


def _costs(manifest: Manifest, transfers: Sequence[str]) -> list[tuple[int, int]]:
    """Return upload and memory of each transfer function at its finest level."""
    finest = {picture.name: picture.drawings[0].cost for picture in manifest.pictures}
    return [(finest[name].upload_bytes, finest[name].gpu_bytes) for name in transfers if name in finest]


def _transport_bytes(package: Package) -> int:
    """Return the size of the textures as a server sends them, deflated."""
    files = (record.path for record in package.manifest.files_of("texture"))
    return sum(len(zlib.compress(package.read_bytes(file), 1)) for file in files)
