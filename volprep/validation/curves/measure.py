"""Measure every choice: build each variant from the scan, draw and time it, and compare it with the oracle."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path

from volprep.render.choose import ray_caster_of
from volprep.render.timing import Spread
from volprep.scene.channels import drawn_channels
from volprep.scene.request import Request
from volprep.truth.decoded import light_of_scan
from volprep.truth.metrics import flip_error
from volprep.validation.curves.choices import CHOICES, Choice, Variant
from volprep.validation.curves.records import (
    Cost,
    Curve,
    CurveErrors,
    CurvePoint,
    CurvesReport,
    Milliseconds,
    Refusal,
    plotted_cost,
)
from volprep.validation.curves.scan import read_scan, write_scan
from volprep.validation.records import Driver
from volprep.validation.scan import Judge
from volprep.validation.subject import Subject, errors, render_settings
from volprep.validation.sweep import SWEEP_VIEW
from volprep.validation.variants import Changes, Workshop, merged, with_changes
from volprep.validation.views import driver_of
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress

_LEAST_PICTURES, _SECONDS = 5, 0.6
"""Of each variant so many pictures at least are timed, and until so much time has passed."""


def measure_curves(
    manifest: Manifest, judge: Judge, folder: Path, progress: Progress, picture_size: int | None = None
) -> CurvesReport:
    """Measure the choices of the package that has `manifest`, with the scene of `judge`; `folder` is for files.

    Of several channels the first one counts. Raises VP6050 for devices without shaders, and what a build of the scene
    itself raises; a variant that cannot be is told.
    """
    began = time.perf_counter()
    if not manifest.profile.has_shaders:
        raise VolprepError("VP6050", profile=manifest.profile.name)
    channel = drawn_channels(judge.scene)[0]
    scene = judge.scene.with_source(channel.spec).with_transfer(channel.transfer)
    spec, reduced_by = write_scan(channel.spec, folder / "scan.nrrd", progress)
    longest = max(manifest.source.info.grid.shape_zyx) // reduced_by
    alone: Changes = {"together": None, "pyramid": {"coarsest_longest_axis": max(1, -(-longest // 4))}}
    request = Request(with_changes(scene.with_source(spec), alone), judge.profile, judge.scene_path)
    bench = _Bench(request, folder, picture_size or judge.picture_size)
    progress.start("curves", sum(len(choice.variants(bench.scene)) for choice in CHOICES))
    curves = tuple(_curve(bench, choice, manifest, progress) for choice in CHOICES)
    return CurvesReport(
        generator=f"volprep {version('volprep')}",
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
        curves=curves,
    )


def _curve(bench: "_Bench", choice: Choice, manifest: Manifest, progress: Progress) -> Curve:
    variants = choice.variants(bench.scene)
    points: dict[str, CurvePoint] = {}
    refused: list[Refusal] = []
    for variant in variants:
        try:
            drawn = {point.label: point for point in bench.points(choice, variant, choice.named(manifest))}
            same = next(iter(drawn))
            if drawn.keys() <= points.keys() and same != variant.wanted:
                refused.append(Refusal(label=variant.wanted, problem=f"the plan makes the same of it as of {same}"))
            points |= {label: point for label, point in drawn.items() if label not in points}
        except VolprepError as error:
            refused.append(Refusal(label=variant.wanted, problem=f"{error.code} {error.summary}"))
        progress.advance()
    items = [item for item in manifest.plan if item.name.startswith(choice.item(manifest))]
    said = next((item for item in items if item.kept), items[0] if items else None)
    return Curve(
        name=choice.name,
        question=choice.question,
        cost=choice.cost,
        points=_with_front(tuple(points.values()), choice.cost),
        refused=tuple(refused),
        reason=None if said is None else said.reason,
        left_out=None if variants else choice.absent,
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
        self._box_from_clip: Float64Array = self.subject.views[SWEEP_VIEW]
        voxel_mm = min(package.manifest.levels[0].grid.spacing_mm_zyx)
        self._wide: Changes = {
            "tolerance": {"rmse": 1.0, "maximum": 1.0},
            "quantize": {"bits": package.manifest.quantization.bits if package.manifest.quantization else "auto"},
            "render": {"step_voxels": self.subject.render.step_mm / voxel_mm},
        }
        self._truths: dict[str, FloatArray] = {}

    def driver(self) -> Driver:
        """Return who draws."""
        package = self._workshop.make({}).package
        with ray_caster_of(package, None, self.transfer)(package, transfer=self.transfer) as renderer:
            return driver_of(renderer)

    def points(self, choice: Choice, variant: Variant, chosen: str) -> Iterator[CurvePoint]:
        """Build a variant, and draw it with each of its steps."""
        made = self._workshop.make(merged(variant.changes, self._wide) if choice.whatever_it_costs else variant.changes)
        package = made.package if variant.altered is None else variant.altered(made.package)
        name = choice.named(package.manifest)
        level = f"level {variant.level}" if variant.level or not name else ""
        series = ", ".join(filter(None, (name, level)))
        truth = self._truth(package)
        nominal_mm = render_settings(package).step_of(variant.level)
        kind = ray_caster_of(package, variant.level, self.transfer)
        with kind(package, level=variant.level, transfer=self.transfer) as renderer:
            for ratio in variant.steps:
                step_mm = ratio * nominal_mm
                if not renderer.draws_step(step_mm):
                    continue
                picture = renderer.render(self._box_from_clip, self.subject.shape_hw, step_mm)
                times = renderer.draw_times(
                    self._box_from_clip, self.subject.shape_hw, step_mm, least=_LEAST_PICTURES, seconds=_SECONDS
                )
                yield CurvePoint(
                    label=series if len(variant.steps) == 1 else f"{series}, {ratio:g}× step",
                    series=series,
                    level=variant.level,
                    step_mm=step_mm,
                    errors=_errors(picture, truth),
                    wall=_milliseconds(times.wall),
                    gpu=None if times.gpu is None else _milliseconds(times.gpu),
                    upload_bytes=_upload_bytes(package.manifest, variant.level),
                    package_bytes=sum(record.size_bytes for record in package.manifest.files),
                    build_seconds=made.seconds,
                    chosen=name == chosen and ratio == 1.0 and variant.level == choice.compared_at,
                    on_front=False,
                )

    def _truth(self, package: Package) -> FloatArray:
        """Return the picture that a package should give: of lit ones, lit by its own light."""
        light = light_of_scan(package.manifest)
        if repr(light) not in self._truths:
            subject = Subject(package, replace(self.subject.scan, normals=light), self.subject.shape_hw[0])
            self._truths[repr(light)] = subject.truth(self.transfer, SWEEP_VIEW).rgba
        return self._truths[repr(light)]


def _errors(picture: FloatArray, truth: FloatArray) -> CurveErrors:
    found, seen = errors(picture, truth), flip_error(picture, truth)
    return CurveErrors(
        rmse=found.rmse,
        maximum=found.maximum,
        ssim_black=found.ssim_black,
        ssim_white=found.ssim_white,
        flip_black=seen.black,
        flip_white=seen.white,
    )


def _milliseconds(times: Spread) -> Milliseconds:
    return Milliseconds(median=times.median, low=times.low, high=times.high, pictures=times.count)


def _upload_bytes(manifest: Manifest, level: int) -> int:
    sizes = {record.path: record.size_bytes for record in manifest.files}
    files = {texture.file for texture in manifest.textures if texture.level in {None, level}}
    if manifest.proxy is not None:
        files |= {mesh.file for mesh in manifest.proxy.meshes if mesh.file is not None and mesh.level == level}
    return sum(sizes[path] for path in files)


def _with_front(points: Sequence[CurvePoint], cost: Cost) -> tuple[CurvePoint, ...]:
    """Mark what is on the Pareto front: nothing else costs no more, and is no less near."""

    def is_beaten(point: CurvePoint) -> bool:
        here = (plotted_cost(point, cost), point.errors.rmse)
        others = [(plotted_cost(each, cost), each.errors.rmse) for each in points]
        return any(other[0] <= here[0] and other[1] <= here[1] and other != here for other in others)

    return tuple(point.model_copy(update={"on_front": not is_beaten(point)}) for point in points)
