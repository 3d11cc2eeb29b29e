"""Measure every choice: build each variant from the scan, draw and time it, and compare it with the oracle."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from volprep.lab.curves.choices import CHOICES, Choice, Variant
from volprep.lab.curves.front import with_front
from volprep.lab.curves.records import STOPPED, Curve, CurveErrors, CurvePoint, CurvesReport, Refusal
from volprep.lab.small_scan import read_scan, write_scan
from volprep.lab.variants import Workshop, first_channel, merged, with_changes
from volprep.parts.ablation import Changes
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.render.timing import draws_with_processor
from volprep.scene.request import Request
from volprep.truth.decoded import light_of_scan
from volprep.truth.seen import seen_flip
from volprep.validation.comparison.views import driver_of
from volprep.validation.results.measurements import Driver
from volprep.validation.subjects.scan import Judge
from volprep.validation.subjects.subject import Subject, errors
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep.validation.timing.turns import Milliseconds, in_turns
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress

_TURNS = 9
"""In how many turns all variants of a choice are drawn."""


def measure_curves(
    manifest: Manifest, judge: Judge, folder: Path, progress: Progress, picture_size: int | None = None
) -> CurvesReport:
    """Measure the choices of the package that has `manifest`, with the scene of `judge`; `folder` is for files.

    Only the first channel is measured. Raises VP6050 for devices without shaders, VP3046 for one in colour, and the
    errors of building the scene itself; a variant that cannot be built is reported. A run that is stopped returns the
    choices that it has measured, and names the others.
    """
    began = time.perf_counter()
    scene, channel = first_channel(manifest, judge, "VP6050", "curves")
    spec, reduced_by = write_scan(channel.spec, folder / "scan.nrrd", progress)
    longest = max(manifest.source.info.grid.shape_zyx) // reduced_by
    alone: Changes = {"together": None, "pyramid": {"coarsest_longest_axis": max(1, -(-longest // 4))}}
    request = Request(with_changes(scene.with_source(spec), alone), judge.profile, judge.scene_path)
    bench = _Bench(request, folder, picture_size or judge.picture_size)
    progress.start("curves", sum(len(choice.variants(bench.scene)) for choice in CHOICES))
    curves: list[Curve] = []
    try:
        for choice in CHOICES:
            curves.append(_curve(bench, choice, manifest, progress))  # noqa: PERF401 - what a stopped run has counts
    except KeyboardInterrupt:
        if not curves:
            raise
        curves += [_unmeasured(choice) for choice in CHOICES[len(curves) :]]
    return CurvesReport(
        generator=generator(),
        package=manifest.name,
        profile=manifest.profile.name,
        transfer=bench.transfer,
        view=SWEEP_VIEW,
        picture_size=bench.subject.shape_hw[0],
        reduced_by=reduced_by,
        shape_zyx=bench.subject.scan.grid.shape_zyx,
        tolerance=judge.scene.tolerance,
        driver=bench.driver(),
        seconds=time.perf_counter() - began,
        curves=tuple(curves),
    )


def _curve(bench: "_Bench", choice: Choice, manifest: Manifest, progress: Progress) -> Curve:
    variants = choice.variants(bench.scene)
    trials: dict[str, _Trial] = {}
    refused: list[Refusal] = []
    with ExitStack() as stack:
        for variant in variants:
            try:
                drawn = {trial.label: trial for trial in bench.trials(stack, choice, variant, choice.named(manifest))}
                same = next(iter(drawn))
                if drawn.keys() <= trials.keys() and same != variant.wanted:
                    refused.append(Refusal(label=variant.wanted, problem=f"the plan makes the same of it as of {same}"))
                trials |= {label: trial for label, trial in drawn.items() if label not in trials}
            except VolprepError as error:
                refused.append(Refusal(label=variant.wanted, problem=f"{error.code} {error.summary}"))
            progress.advance()
        points = tuple(bench.timed(trials)) if trials else ()
    items = [item for item in manifest.plan if item.kind == choice.item(manifest)]
    said = next((item for item in items if item.kept), items[0] if items else None)
    return Curve(
        name=choice.name,
        question=choice.question,
        cost=choice.cost,
        points=with_front(points, choice.cost),
        refused=tuple(refused),
        reason=None if said is None else said.reason,
        left_out=None if variants else choice.absent,
    )


def _unmeasured(choice: Choice) -> Curve:
    return Curve(name=choice.name, question=choice.question, cost=choice.cost, points=(), reason=None, left_out=STOPPED)


@dataclass(frozen=True)
class _Trial:
    """A variant that is open to be drawn."""

    label: str
    renderer: Renderer
    box_from_clip: Float64Array
    shape_hw: tuple[int, int]
    step_mm: float
    point: Callable[..., CurvePoint]
    """Its point, when its times are known."""

    def draw_ms(self) -> float:
        """Draw once, and return the milliseconds: of the processor if the driver draws with it."""
        clock = time.process_time if draws_with_processor(self.renderer.driver.renderer) else time.perf_counter
        return self.renderer.time_ms(
            self.box_from_clip, self.shape_hw, self.step_mm, repeats=1, clock=clock, warm=False
        )


class _Bench:
    """Builds and draws variants of one scene."""

    def __init__(self, request: Request, folder: Path, picture_size: int) -> None:
        self.scene = request.scene
        self._workshop = Workshop(request, folder)
        package = self._workshop.make({}).package
        self.transfer = package.manifest.transfer_functions[0].name
        scan = read_scan(request.scene.source, light_of_scan(package.manifest))
        self.subject = Subject(package, scan, picture_size)
        voxel_mm = min(package.manifest.levels[0].grid.spacing_mm_zyx)
        self._wide: Changes = {
            "tolerance": {"rmse": 1.0, "maximum": 1.0, "flip": 1.0, "kept_light": 0.0},
            "quantize": {"bits": package.manifest.quantization.bits if package.manifest.quantization else "auto"},
            "render": {"step_voxels": self.subject.step_mm / voxel_mm},
        }
        self._truths: dict[tuple[str, int], FloatArray] = {}
        self.turns = _TURNS

    def driver(self) -> Driver:
        """Return the description of the renderer."""
        package = self._workshop.make({}).package
        with ray_caster_of(package, None, self.transfer)(package, transfer=self.transfer) as renderer:
            return driver_of(renderer)

    def trials(self, stack: ExitStack, choice: Choice, variant: Variant, chosen: str) -> Iterator[_Trial]:
        """Build a variant, open it on `stack`, and compare a picture of each of its steps with the truth."""
        changes = merged(variant.changes, self._wide) if choice.whatever_it_costs else variant.changes
        made = self._workshop.make(changes, variant.profile)
        package = made.package if variant.altered is None else variant.altered(made.package)
        name = variant.named or choice.named(package.manifest)
        level = f"level {variant.level}" if variant.level or not name else ""
        series = ", ".join(filter(None, (name, level)))
        pixels = round(self.subject.shape_hw[0] * variant.size)
        truth = self._truth(package, pixels)
        kind = ray_caster_of(package, variant.level, self.transfer)
        renderer = stack.enter_context(kind(package, level=variant.level, transfer=self.transfer))
        nominal_mm = renderer.nominal_mm
        # A package with its border has a larger box.
        camera = self.subject.cameras[SWEEP_VIEW].box_from_clip(package.manifest.levels[0].grid, aspect=1.0)
        for ratio in variant.steps:
            step_mm = ratio * nominal_mm
            if not renderer.draws_step(step_mm):
                continue
            yield _Trial(
                label=series if len(variant.steps) == 1 else f"{series}, {ratio:g}× step",
                renderer=renderer,
                box_from_clip=camera,
                shape_hw=(pixels, pixels),
                step_mm=step_mm,
                point=partial(
                    CurvePoint,
                    label=series if len(variant.steps) == 1 else f"{series}, {ratio:g}× step",
                    series=series,
                    level=variant.level,
                    step_mm=step_mm,
                    errors=_errors(renderer.render(camera, (pixels, pixels), step_mm), truth),
                    upload_bytes=renderer.uploaded_bytes,
                    package_bytes=sum(record.size_bytes for record in package.manifest.files),
                    build_seconds=made.seconds,
                    chosen=name == chosen and ratio == 1.0 and variant.level == choice.compared_at,
                    on_front=False,
                ),
            )

    def timed(self, trials: Mapping[str, _Trial]) -> Iterator[CurvePoint]:
        """Time all variants of a choice in turns; the picture that each was compared with is not counted."""
        times = in_turns({label: trial.draw_ms for label, trial in trials.items()}, self.turns)
        for label, trial in trials.items():
            # A driver that draws with the processor would draw all again for the same times.
            clock = None if draws_with_processor(trial.renderer.driver.renderer) else trial.renderer.gpu_times
            gpu = None if clock is None else clock(trial.box_from_clip, trial.shape_hw, trial.step_mm, self.turns)
            yield trial.point(wall=times[label], gpu=None if gpu is None else Milliseconds.of(gpu))

    def _truth(self, package: Package, pixels: int) -> FloatArray:
        """Return the true picture of a package; a lit one is lit by its own light."""
        light = light_of_scan(package.manifest)
        key = repr(light), pixels
        if key not in self._truths:
            subject = Subject(package, replace(self.subject.scan, normals=light), pixels)
            self._truths[key] = subject.truth(self.transfer, SWEEP_VIEW).rgba
        return self._truths[key]


def _errors(picture: FloatArray, truth: FloatArray) -> CurveErrors:
    found, seen = errors(picture, truth), seen_flip(picture, truth)
    return CurveErrors(
        rmse=found.seen_rmse,
        maximum=found.maximum,
        ssim_black=found.ssim_black,
        ssim_white=found.ssim_white,
        flip_black=seen.black,
        flip_white=seen.white,
    )
