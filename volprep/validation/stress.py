"""How the chain from scan to picture bears cases in which arithmetic is hard: each is built, drawn and compared.

Errors are those of the 8-bit target, at the nominal step in three views, and at other steps in the oblique one. Laws of
light hold whatever the step: opacity is a number from 0 to 1, no colour is brighter than its opacity, and what absorbs
more is no less opaque. They are checked in a float target where there is one, because 8 bits would hide what breaks
them.
"""

import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.request import Request
from volprep.scene.scene import PyramidSettings, RenderWishes, Scene
from volprep.scene.transfer import SceneTransfer
from volprep.truth.laws import broken_laws
from volprep.truth.oracle import DEFAULT_TOLERANCE
from volprep.truth.picture import encoded
from volprep.validation.folder import PICTURES, ReportFolder
from volprep.validation.pictures import coloured, largest_difference
from volprep.validation.precise import most_precise
from volprep.validation.records import Driver, Target
from volprep.validation.scan import read_scan
from volprep.validation.stress_cases import CLASSIFICATIONS, StressCase
from volprep.validation.stress_records import StressDrawing, StressPoint, StressReport, StressResult
from volprep.validation.subject import Subject, errors
from volprep.validation.sweep import SWEEP_VIEW
from volprep.validation.verdict import share_of
from volprep.validation.views import driver_of
from volprep_formats.arrays import FloatArray, UInt8Array
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent
from volprep_formats.source import RawLayout, SourceSpec

_VIEWS = ("anterior", "superior", SWEEP_VIEW)
_RATIOS = (2.0, 1.0, 0.5, 0.25)
_DRAWS = 3
_SIZE = 96
_GAIN = 4.0
_TRANSFER = "hard"
_ROUNDING: dict[Target, float] = {"rgba8": 1 / 255, "rgba16f": 2.0**-9, "rgba32f": 2.0**-12}
"""How far the laws may be off: a step of the target, or what a thousand additions may round away."""


@dataclass(frozen=True)
class _Drawn:
    """One case, drawn in one way."""

    drawing: StressDrawing
    precise: FloatArray
    """All views in the target of the laws, [view, H, W, 4]."""
    target: Target
    """That target."""
    driver: Driver
    """Who drew."""


def measure_stress(
    cases: Sequence[StressCase], profile: DeviceProfile, folder: ReportFolder, progress: Progress
) -> StressReport:
    """Build, draw and judge `cases` for a class of devices; pictures go to `folder`.

    Raises what the renderer raises.
    """
    results: list[StressResult] = []
    drawn: dict[tuple[str | None, ClassificationName], _Drawn] = {}
    progress.start("stress", len(cases))
    for case in cases:
        refused = None
        try:
            for classification in CLASSIFICATIONS:
                fainter = drawn.get((case.fainter, classification))
                with _built(case, classification, profile) as subject:
                    found = _draw(case, classification, subject, folder, fainter)
                drawn[case.name, classification] = found
        except VolprepError as error:
            if error.status not in {ExitStatus.SOURCE, ExitStatus.SCENE}:
                raise
            refused = error.code
        results.append(
            StressResult(
                case=case.name,
                hard=case.hard,
                refused=refused,
                must_refuse=case.refused,
                drawings=tuple(each.drawing for (name, _), each in drawn.items() if name == case.name),
            )
        )
        progress.advance()
    anyone = next(iter(drawn.values()), None)
    return StressReport(
        generator=f"volprep {version('volprep')}",
        profile=profile.name,
        picture_size=_SIZE,
        oracle_tolerance=DEFAULT_TOLERANCE,
        laws_target="rgba8" if anyone is None else anyone.target,
        difference_gain=_GAIN,
        passed=all(result.passed for result in results),
        results=tuple(results),
        driver=None if anyone is None else anyone.driver,
    )


@contextmanager
def _built(case: StressCase, classification: ClassificationName, profile: DeviceProfile) -> Iterator[Subject]:
    """Build the package of a case, as a user would from a file; it goes when the block ends."""
    voxels = case.voxels()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        raw = folder / "scan.raw"
        raw.write_bytes(voxels.astype(voxels.dtype.newbyteorder("<")).tobytes())
        shape_zyx = (voxels.shape[0], voxels.shape[1], voxels.shape[2])
        layout = RawLayout.model_validate(
            {"shape_zyx": shape_zyx, "dtype": voxels.dtype.name, "spacing_mm_zyx": case.spacing_mm_zyx}
        )
        spec = SourceSpec(path=str(raw), format="raw", raw=layout)
        scene = Scene(
            name=case.name,
            source=spec,
            transfer=(SceneTransfer(name=_TRANSFER, points=case.points),),
            pyramid=PyramidSettings(coarsest_longest_axis=max(shape_zyx)),
            render=RenderWishes(classification=classification, lighting="headlight" if case.lit else "none"),
        )
        build(Request(scene, profile, folder / "scene.toml"), folder / "case.volpkg", Silent())
        package = Package.open(folder / "case.volpkg")
        yield Subject(package, read_scan(package.manifest, spec, Silent()), _SIZE)


def _draw(
    case: StressCase,
    classification: ClassificationName,
    subject: Subject,
    folder: ReportFolder,
    fainter: _Drawn | None,
) -> _Drawn:
    truths = {view: subject.truth(_TRANSFER, view).rgba for view in _VIEWS}
    limit = case.limits[classification]
    with _renderer(subject, "rgba8") as renderer:
        pictures = {view: renderer.render(subject.views[view], subject.shape_hw) for view in _VIEWS}
        points = tuple(_point(renderer, subject, truths[SWEEP_VIEW], ratio) for ratio in _RATIOS)
        driver = driver_of(renderer)
    found = most_precise(lambda target: (target, _views(subject, target)))
    target, precise = found or ("rgba8", np.stack(list(pictures.values())))
    less = None if fainter is None else fainter.precise
    drawing = StressDrawing(
        classification=classification,
        total=max(
            (errors(pictures[view], truths[view]) for view in _VIEWS),
            key=lambda total: share_of(total, limit or Tolerance()),
        ),
        limit=limit,
        laws=tuple(broken_laws(precise, _ROUNDING[target], less, 1 - (subject.render.opacity_cutoff or 1.0))),
        points=points,
        picture=f"{PICTURES}/{case.name}-{classification}.png",
    )
    folder.picture(drawing.picture, _strip(truths[SWEEP_VIEW], pictures[SWEEP_VIEW]))
    return _Drawn(drawing, precise, target, driver)


def _renderer(subject: Subject, target: Target) -> Renderer:
    level = min(subject.programs[0].levels)
    return Renderer(subject.package, level=level, transfer=_TRANSFER, target=target)


def _views(subject: Subject, target: Target) -> FloatArray:
    with _renderer(subject, target) as renderer:
        return np.stack([renderer.render(subject.views[view], subject.shape_hw) for view in _VIEWS])


def _point(renderer: Renderer, subject: Subject, truth: FloatArray, ratio: float) -> StressPoint:
    camera, step_mm = subject.views[SWEEP_VIEW], ratio * subject.render.step_mm
    picture = renderer.render(camera, subject.shape_hw, step_mm)
    draw_ms = renderer.time_ms(camera, subject.shape_hw, step_mm, repeats=_DRAWS)
    return StressPoint(step_ratio=ratio, rmse=errors(picture, truth).rmse, draw_ms=draw_ms)


def _strip(truth: FloatArray, picture: FloatArray) -> UInt8Array:
    difference = coloured(largest_difference(picture, truth), _GAIN)
    return np.concatenate([encoded(truth, "black"), encoded(picture, "black"), difference], axis=1)
