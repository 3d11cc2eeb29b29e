"""Coarser levels: each is made from the codes of level 0 by its filter, and rounded once."""

from collections.abc import Iterator

from volprep.plan import LevelPlan, Plan
from volprep.pyramid.noise import noise_of
from volprep.pyramid.reduce import reduced_slabs
from volprep.slabs import RawVolume, bytes_of
from volprep.stages import Changes, Stage
from volprep.work import codes_name, codes_of_source, levels_of
from volprep_formats.package.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record


def _settings(plan: Plan) -> tuple[Record, ...]:
    return plan.levels


def _run(draft: Draft, plan: Plan, progress: Progress) -> Changes:
    source = codes_of_source(draft, plan)
    coarser = [level for level in plan.levels if level.index > 0]
    progress.start("pyramid", len(coarser) * source.shape_zyx[0])
    # The noise of level 0 is the same for all levels.
    noise = noise_of(source) if any(level.filter == "feature-preserving" for level in coarser) else 0.0
    for level in coarser:
        draft.write(codes_name(level.index, plan.channel), "work", _slices(source, level, noise, progress))
    return {"levels": levels_of(plan)}


def _slices(source: RawVolume, level: LevelPlan, noise: float, progress: Progress) -> Iterator[memoryview]:
    if level.filter == "none":
        msg = f"level {level.index} has no filter"
        raise ValueError(msg)
    for slices, read in reduced_slabs(source, level.factors_zyx, level.filter, noise):
        yield bytes_of(slices)
        progress.advance(read)


STAGE = Stage(name="pyramid", reads=("quantize",), settings=_settings, run=_run)
