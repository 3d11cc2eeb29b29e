"""Numerical stress tests of the whole chain from scan to picture: each case is built, drawn and compared.

Errors are measured in the 8-bit target over seen pixels, at the nominal step in three views, and at other steps in the
oblique one. No step up to the nominal one may exceed the limit, and no step may be worse than a longer one. Laws of
light hold at any step: opacity is a number from 0 to 1, no colour is brighter than its opacity, and more absorption
never lowers opacity. They are checked in a float target if there is one, because 8 bits would hide violations.
"""

import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.cases import CLASSIFICATIONS, COMPOSITING, StressCase
from volprep.lab.stress.drawing import (
    PICTURE_SIZE,
    ROUNDING,
    STEP_RATIOS,
    TRANSFER,
    VIEWS,
    Trials,
    points_of,
    views_of,
    worst,
)
from volprep.lab.stress.records import StressDrawing, StressReport, StressResult
from volprep.lab.stress.variations import varied_drawings
from volprep.pipeline.build import build
from volprep.render.renderer import Renderer
from volprep.scene.profiles import load_profile
from volprep.scene.request import Request
from volprep.scene.scene import PyramidSettings, Scene, SceneRender
from volprep.scene.transfer import SceneTransfer
from volprep.techniques import TECHNIQUES
from volprep.truth.laws import broken_laws
from volprep.truth.oracle import DEFAULT_TOLERANCE
from volprep.truth.picture import encoded
from volprep.validation.comparison.colours import coloured, largest_difference
from volprep.validation.comparison.precise_target import most_precise
from volprep.validation.comparison.views import driver_of
from volprep.validation.folder import PICTURES, ReportFolder
from volprep.validation.results.measurements import Driver, Target
from volprep.validation.subjects.scan import read_scan
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.arrays import FloatArray, UInt8Array
from volprep_formats.diagnostics import ExitStatus, VolprepError
from volprep_formats.installation import generator
from volprep_formats.package.profile import DeviceProfile
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.reader import Package
from volprep_formats.progress import Progress, Silent
from volprep_formats.source import RawLayout, SourceSpec


def unjudged(results: Sequence[StressResult], trials: Trials) -> tuple[str, ...]:
    """Return a sentence for each thing that is drawn without a limit, and for each that is not drawn at all."""
    pairs = [(result.case, drawing) for result in results for drawing in result.drawings]
    return (*_reported(pairs), *_partly(pairs), *_untried(results, trials))


def _reported(pairs: Sequence[tuple[str, StressDrawing]]) -> Iterator[str]:
    """Describe the drawings that have no limit."""
    free = [(case, drawing) for case, drawing in pairs if drawing.limit is None]
    if numbers := _names(drawing.precision for _, drawing in free if drawing.precision != "highp"):
        yield f"Shaders in {numbers}: their errors are reported; shaders ship in highp."
    known = [(case, drawing) for case, drawing in free if drawing.precision == "highp"]
    published = {drawing.technique for _, drawing in known if TECHNIQUES[drawing.technique].order is not None}
    if published:
        yield f"Techniques {_names(published)}: they are published with errors, which are reported."
    thin = [(case, variant) for case, variant in known if variant.technique not in published]
    for name in dict.fromkeys(variant.classification for _, variant in thin):
        cases = _names(case for case, variant in thin if variant.classification == name)
        yield f"Errors of {name} in {cases}: a feature is thinner than the distance of samples, which may miss it."


def _partly(pairs: Sequence[tuple[str, StressDrawing]]) -> Iterator[str]:
    """Describe what a limit of a drawing leaves out."""
    judged = [(case, drawing) for case, drawing in pairs if drawing.limit is not None]
    if blended := _names(drawing.technique for _, drawing in judged if drawing.precise is not None):
        yield f"Pictures of 8 bits of {blended}: 8 bits round each layer, so that these are judged in floats."
    if cases := _names(case for case, drawing in judged if drawing.common_planes):
        yield f"Whether finer steps of layers are worse in {cases}: places of planes decide. Limits fall with the step."
    if any(drawing.level for _, drawing in judged):
        yield "Coarse levels with other steps than their own; their difference from the scan, which validate judges."
    if any(drawing.points for _, drawing in judged):
        yield f"Other steps than the nominal one in other views than {SWEEP_VIEW}, and steps over {STEP_RATIOS[0]:g}×."


def _untried(results: Sequence[StressResult], trials: Trials) -> Iterator[str]:
    """Describe what no case draws."""
    if not trials.levels:
        yield "Coarse levels: they were not asked for."
    if missing := _names(name for name in TECHNIQUES if name not in trials.techniques):
        yield f"Techniques {missing}: they were not asked for."
    drawn = {drawing.technique for result in results for drawing in result.drawings}
    if impossible := _names(name for name in trials.techniques if name not in drawn and results):
        yield f"Techniques {impossible}: no case was drawn with them on this class of devices."
    kinds = _names(kind for kind in get_args(ClassificationName) if kind not in CLASSIFICATIONS)
    yield f"Classifications {kinds}; compositings {_names(name for name in COMPOSITINGS if name != COMPOSITING)}."
    yield "Bricks, sub-volumes, meshes, segments, several channels, light that is computed once, perspective."
    yield "Other drivers than this one."


def _names(found: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(found))


GAIN = 4.0


@dataclass(frozen=True)
class _Drawn:
    """One case, drawn in one way."""

    drawing: StressDrawing
    precise: FloatArray
    """All views in the target of the laws, [view, H, W, 4]."""
    target: Target
    """That target."""
    driver: Driver
    """Description of the renderer."""


def measure_stress(
    cases: Sequence[StressCase], profile: DeviceProfile, folder: ReportFolder, progress: Progress, trials: Trials
) -> StressReport:
    """Build, draw and judge `cases` for a class of devices; pictures go to `folder`.

    Raises the errors of the renderer.
    """
    results: list[StressResult] = []
    drawn: dict[tuple[str | None, ClassificationName], _Drawn] = {}
    progress.start("stress", len(cases))
    started = time.monotonic()
    for case in cases:
        if trials.seconds is not None and time.monotonic() - started > trials.seconds:
            break
        refused = None
        others: list[StressDrawing] = []
        try:
            for classification in CLASSIFICATIONS:
                fainter = drawn.get((case.fainter, classification))
                with _built(case, classification, profile, trials) as subject:
                    truths = {view: subject.truth(TRANSFER, view).rgba for view in VIEWS}
                    found = _draw(case, classification, subject, truths, folder, fainter)
                    others += varied_drawings(case, classification, subject, truths, trials, found.drawing)
                drawn[case.name, classification] = found
        except VolprepError as error:
            if error.status not in {ExitStatus.SOURCE, ExitStatus.SCENE}:
                raise
            refused = error.code
        first = tuple(drawn.drawing for (name, _), drawn in drawn.items() if name == case.name)
        results.append(
            StressResult(
                case=case.name, hard=case.hard, refused=refused, must_refuse=case.refused, drawings=(*first, *others)
            )
        )
        progress.advance()
    anyone = next(iter(drawn.values()), None)
    return StressReport(
        generator=generator(),
        profile=profile.name,
        picture_size=PICTURE_SIZE,
        oracle_tolerance=DEFAULT_TOLERANCE,
        laws_target="rgba8" if anyone is None else anyone.target,
        difference_gain=GAIN,
        passed=len(results) == len(cases) and all(result.passed for result in results),
        results=tuple(results),
        not_judged=unjudged(results, trials),
        left_out=tuple(case.name for case in cases[len(results) :]),
        driver=None if anyone is None else anyone.driver,
    )


@contextmanager
def _built(
    case: StressCase, classification: ClassificationName, profile: DeviceProfile, trials: Trials
) -> Iterator[Subject]:
    """Build the package of a case, as a user would from a file; it is removed when the block ends."""
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
            transfer=(SceneTransfer(name=TRANSFER, points=case.points),),
            pyramid=_levels(max(shape_zyx), wanted=trials.levels and case.techniques),
            render=SceneRender(
                compositing=COMPOSITING, classification=classification, lighting="headlight" if case.lit else "none"
            ),
        )
        devices = profile if case.profile is None else load_profile(case.profile, folder)
        build(Request(scene, devices, folder / "scene.toml"), folder / "case.volpkg", Silent())
        package = Package.open(folder / "case.volpkg")
        yield Subject(package, read_scan(package.manifest, spec, Silent()), PICTURE_SIZE)


def _levels(longest_axis: int, *, wanted: bool) -> PyramidSettings:
    """Ask for two coarser levels of means, which need no trials of their own, or for none."""
    coarsest = max(longest_axis // 4, 1) if wanted else longest_axis
    return PyramidSettings(coarsest_longest_axis=coarsest, filter="box")


def _draw(  # noqa: PLR0917 - the case, its truth, and where pictures go
    case: StressCase,
    classification: ClassificationName,
    subject: Subject,
    truths: Mapping[str, FloatArray],
    folder: ReportFolder,
    fainter: _Drawn | None,
) -> _Drawn:
    name = f"{PICTURES}/{case.name}-{classification}.png"
    limit = case.limits[classification]
    with _renderer(subject, "rgba8") as renderer:
        pictures = {view: renderer.render(subject.views[view], subject.shape_hw) for view in VIEWS}
        points = points_of(renderer, subject, truths[SWEEP_VIEW], subject.step_mm)
        driver = driver_of(renderer)
    found = most_precise(lambda target: (target, _views(subject, target)))
    target, precise = found or ("rgba8", np.stack(list(pictures.values())))
    less = None if fainter is None else fainter.precise
    drawing = StressDrawing(
        classification=classification,
        total=worst(np.stack(list(pictures.values())), truths, limit),
        limit=limit,
        laws=tuple(broken_laws(precise, ROUNDING[target], less, 1 - (subject.package.manifest.opacity_cutoff or 1.0))),
        points=points,
        picture=name,
    )
    folder.picture(name, _strip(truths[SWEEP_VIEW], pictures[SWEEP_VIEW]))
    return _Drawn(drawing, precise, target, driver)


def _renderer(subject: Subject, target: Target) -> Renderer:
    level = min(subject.programs[0].levels)
    return Renderer(subject.package, level=level, transfer=TRANSFER, target=target)


def _views(subject: Subject, target: Target) -> FloatArray:
    with _renderer(subject, target) as renderer:
        return views_of(renderer, subject)


def _strip(truth: FloatArray, picture: FloatArray) -> UInt8Array:
    difference = coloured(largest_difference(picture, truth), GAIN)
    return np.concatenate([encoded(truth, "black"), encoded(picture, "black"), difference], axis=1)
