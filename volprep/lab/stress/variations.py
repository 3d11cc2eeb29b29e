"""Hard cases drawn in less common ways: every registered technique, coarse levels, number precisions of phones.

A technique is judged as ray casting is, at every step. One that blends layers is judged in a float target, because 8
bits round each layer; that cost, with few and with many layers, is reported. A technique that is published with an
error is only reported, and so are shaders drawn in 16-bit floats: shipped shaders are highp.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from volprep.lab.stress.cases import StressCase
from volprep.lab.stress.combinations import Way, in_way
from volprep.lab.stress.drawing import ROUNDING, TRANSFER, VIEWS, Trials, points_of, views_of, worst
from volprep.lab.stress.records import Precision, StressDrawing, StressPoint
from volprep.render.renderer import Renderer
from volprep.shading.half_floats import in_half_floats, with_half_coordinates
from volprep.techniques import TECHNIQUES
from volprep.truth.laws import broken_laws
from volprep.validation.comparison.altered import Altered
from volprep.validation.comparison.precise_target import most_precise
from volprep.validation.results.measurements import Target
from volprep.validation.subjects.subject import Subject
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.arrays import FloatArray
from volprep_formats.package.program import ClassificationName
from volprep_formats.package.reader import Package

_HALF_FLOATS = {"mediump": in_half_floats, "mediump-coordinates": with_half_coordinates}


def varied_drawings(  # noqa: PLR0917 - the case, its truth, and its variations
    case: StressCase,
    classification: ClassificationName,
    subject: Subject,
    truths: Mapping[str, FloatArray],
    trials: Trials,
    first: StressDrawing,
) -> Iterator[StressDrawing]:
    """Draw the case of `subject` with all techniques, levels and precisions that are asked for, each varied alone.

    `first` is the drawing without variations.
    """
    (program,) = (program for program in subject.programs if program.transfer == TRANSFER)
    for technique in trials.techniques if case.techniques else ():
        way = Way(technique=technique, classification=classification, sampling=program.sampling)
        if technique != program.technique and way.is_possible:
            package = in_way(subject.package, program, way)
            drawing = _technique(case, way, subject, truths, package)
            yield drawing.model_copy(update={"of_rays": first.points if drawing.common_planes else ()})
    for level in subject.levels(program)[1:]:
        yield _level(case, classification, subject, level)
    for precision in trials.precisions:
        if precision != "highp":
            text = _HALF_FLOATS[precision](subject.package.read_text(program.fragment))
            package = Altered(subject.package, {program.fragment: text})
            yield _rounded(classification, subject, truths, package, precision)


def _technique(
    case: StressCase, way: Way, subject: Subject, truths: Mapping[str, FloatArray], package: Package
) -> StressDrawing:
    record = TECHNIQUES[way.technique]
    step_mm = (record.step_voxels or 0.0) * min(subject.grid.spacing_mm_zyx) or subject.step_mm
    limit = case.limits[way.classification] if record.order is None else None
    precise_points: tuple[StressPoint, ...] = ()
    with _renderer(package, subject, 0, "rgba8") as renderer:
        total = worst(views_of(renderer, subject, step_mm), truths, limit)
        blends = renderer.program.blend is not None
        points = points_of(renderer, subject, truths[SWEEP_VIEW], step_mm)
    laws: tuple[str, ...] = ()
    precise = None
    floats = most_precise(lambda target: (target, _drawn(package, subject, target, step_mm)))
    if floats is not None and limit is not None:
        target, pictures = floats
        # Rounding may leave a colour a little above 1, which no target of bytes shows.
        precise = worst(np.clip(pictures, 0.0, 1.0), truths, limit) if blends else None
        laws = tuple(broken_laws(pictures, ROUNDING[target]))
        if blends:
            with _renderer(package, subject, 0, target) as renderer:
                precise_points = points_of(renderer, subject, truths[SWEEP_VIEW], step_mm)
    return StressDrawing(
        classification=way.classification,
        technique=way.technique,
        total=total,
        precise=precise,
        limit=limit,
        common_planes=case.silhouettes and blends,
        laws=laws,
        points=points,
        precise_points=precise_points,
        picture=None,
    )


def _level(case: StressCase, classification: ClassificationName, subject: Subject, level: int) -> StressDrawing:
    truths = {view: subject.on_data(TRANSFER, view, level).rgba for view in VIEWS}
    limit = case.limits[classification]
    with _renderer(subject.package, subject, level, "rgba8") as renderer:
        pictures = views_of(renderer, subject)
    return StressDrawing(
        classification=classification,
        level=level,
        total=worst(pictures, truths, limit),
        limit=limit,
        laws=tuple(broken_laws(pictures, ROUNDING["rgba8"])),
        points=(),
        picture=None,
    )


def _rounded(
    classification: ClassificationName,
    subject: Subject,
    truths: Mapping[str, FloatArray],
    package: Package,
    precision: Precision,
) -> StressDrawing:
    with _renderer(package, subject, 0, "rgba8") as renderer:
        total = worst(views_of(renderer, subject), truths, None)
        points = points_of(renderer, subject, truths[SWEEP_VIEW], subject.step_mm)
    return StressDrawing(
        classification=classification,
        precision=precision,
        total=total,
        limit=None,
        laws=(),
        points=points,
        picture=None,
    )


def _drawn(package: Package, subject: Subject, target: Target, step_mm: float) -> FloatArray:
    with _renderer(package, subject, 0, target) as renderer:
        return views_of(renderer, subject, step_mm)


def _renderer(package: Package, subject: Subject, level: int, target: Target) -> Renderer:
    finest = min(subject.programs[0].levels)
    return Renderer(package, level=level or finest, transfer=TRANSFER, target=target)
