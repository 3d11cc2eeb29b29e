"""List what a stress report does not judge: drawings that are only reported, and things that no case tries."""

from collections.abc import Iterable, Iterator, Sequence
from typing import get_args

from volprep.compositing import COMPOSITINGS
from volprep.lab.stress.cases import CLASSIFICATIONS, COMPOSITING
from volprep.lab.stress.drawing import STEP_RATIOS, Trials
from volprep.lab.stress.records import StressDrawing, StressResult
from volprep.techniques import TECHNIQUES
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep_formats.package.program import ClassificationName


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
    thin = [(case, each) for case, each in known if each.technique not in published]
    for name in dict.fromkeys(each.classification for _, each in thin):
        cases = _names(case for case, each in thin if each.classification == name)
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
