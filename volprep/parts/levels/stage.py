"""Coarser levels: each is made from the codes of level 0 by its filter, and rounded once.

Where the filter is to be chosen, the light along random rays decides (choice.py). It also decides whether a level gets
a lookup table of its own. What was decided stands in the draft for later stages. Where voxels are classified, levels
are classified, too (classified.py).
"""

from collections.abc import Iterator, Sequence

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.choice import Chooser
from volprep.parts.levels.classified import CLASSIFIED_CANDIDATES, ClassifiedChooser
from volprep.parts.levels.look import Look
from volprep.parts.levels.made import FITTED, Classified, Factors, level_slices, look_of, written
from volprep.parts.levels.means import are_kept, keep_means
from volprep.parts.levels.preview import preview_levels
from volprep.parts.levels.records import LevelChoice
from volprep.parts.levels.seen import RaySight, SeenLevels
from volprep.parts.stage import Stage, Work, present
from volprep.parts.texels import voxels_of
from volprep.parts.work import choice_name, classified_name, coarser_levels, codes_name, codes_of_source
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep.transfer.lookup import lookup_table
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import ChannelPart, LevelFilter
from volprep_formats.package.manifest import Contribution, Tolerance
from volprep_formats.package.program import CompositingName
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

CANDIDATES: tuple[LevelFilter, ...] = ("box", "median", "least-squares", "appearance")
"""What "auto" chooses from; the first is what the others are compared with."""
FREE_CANDIDATES = tuple(name for name in CANDIDATES if name != "appearance")
"""Those that depend on no transfer function, for packages whose users edit them."""
_NEVER_FAR_DOWN: frozenset[LevelFilter] = frozenset({"median"})
"""Not tried where means are kept. On six scans with three choices of functions each, at 16 and 32 voxels along an edge,
the median had 1.02 to 2.2 times box's error in all 36; with tables of histograms it was the best in 3 of 36, by 1.3 %
at most."""


class _Drawing(Record):
    """What of a plan says how levels are seen, apart from tables."""

    compositing: CompositingName
    lit: bool
    tolerance: Tolerance


def _drawing(plan: ChannelPlan) -> _Drawing:
    lit = any(program.lighting != "none" for program in plan.programs)
    return _Drawing(compositing=plan.shared.compositing, lit=lit, tolerance=plan.render.tolerance)


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    common = (plan.grid, plan.quantize, *plan.levels, *plan.transfer_functions, *plan.lookups, *plan.preintegrated)
    return (*common, _drawing(plan), *present(plan.editing), *(plan.volumes if plan.is_classified else ()))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    scan = Classified(codes_of_source(draft, plan), plan.grid, _tables(plan))
    coarser = [level for level in plan.levels if level.index > 0]
    looks = _looks_far_down(scan, coarser, plan)
    passes = sum(len(_candidates(level, plan)) for level in coarser) + bool(looks)
    progress.start("pyramid", passes * plan.grid.shape_zyx[0])
    if looks:
        scan.means.update(keep_means(scan.volume, looks, draft.scratch, progress.advance))
    chooser = _chooser(scan, plan) if coarser else None
    seen = _seen(scan, plan) if coarser else None
    choices: list[LevelChoice] = []
    for level in coarser:
        candidates = _candidates(level, plan)
        if chooser is None:
            choice, codes = _made(scan, level, candidates[0], draft, progress)
        else:
            choice, codes = chooser.choose(level.index, level.factors_zyx, candidates, draft.scratch, progress.advance)
        errors = choice.tried if seen is None else seen.errors(codes, level.factors_zyx, choice.tables)
        choice = choice.model_copy(update={"errors": errors})
        name = classified_name(level.index) if plan.is_classified else codes_name(level.index, plan.channel)
        draft.write(name, "work", _bytes(codes))
        draft.write(choice_name(level.index, plan.channel), "work", choice.model_dump_json().encode())
        choices.append(choice)
    filters = {choice.level: choice.filter for choice in choices}
    previews = preview_levels(choices, plan.levels[0].index, plan.render.tolerance)
    return Contribution(channel=ChannelPart(name=plan.channel, levels=coarser_levels(plan, filters, previews)))


def _chooser(scan: Classified, plan: ChannelPlan) -> Chooser | ClassifiedChooser | None:
    """Return what chooses a filter and tables by the light of lookup tables; None where these do not make the light."""
    if plan.is_classified:
        return ClassifiedChooser(scan, voxels_of(plan))
    if not _is_light_of_tables(plan):
        return None
    return Chooser(scan, adapt=bool(plan.lookups or plan.preintegrated), editable=plan.editing is not None)


def _seen(scan: Classified, plan: ChannelPlan) -> SeenLevels | None:
    """Return what measures levels as they are drawn; None where their choice measured just that."""
    drawing, quantize = _drawing(plan), plan.quantize
    if plan.is_classified or (_is_light_of_tables(plan) and not drawing.lit):
        return None
    compositing = COMPOSITINGS[drawing.compositing]
    sight = RaySight(plan.transfer_functions, quantize.window, quantize.filter, compositing, drawing.lit)
    return SeenLevels(scan, sight)


def _is_light_of_tables(plan: ChannelPlan) -> bool:
    """Return whether rays make light of mixed values by lookup tables: labels are not mixed, projections have none."""
    return COMPOSITINGS[plan.shared.compositing].level_filter is None and not plan.quantize.labels


def _candidates(level: LevelPlan, plan: ChannelPlan) -> tuple[LevelFilter, ...]:
    if level.filter == "none":
        msg = f"level {level.index} has no filter"
        raise ValueError(msg)
    if level.filter != "auto":
        return (level.filter,)
    if plan.is_classified:
        return CLASSIFIED_CANDIDATES
    candidates = CANDIDATES if plan.editing is None else FREE_CANDIDATES
    return tuple(name for name in candidates if not (name in _NEVER_FAR_DOWN and are_kept(level.factors_zyx)))


def _looks_far_down(scan: Classified, coarser: Sequence[LevelPlan], plan: ChannelPlan) -> dict[Factors, Look]:
    """Return the looks of the levels, by their factors, for whose fits means are kept."""
    looks = {}
    for level in coarser:
        fitted = FITTED.intersection(_candidates(level, plan))
        if fitted and are_kept(level.factors_zyx) and not plan.is_classified:
            # Means with looks serve both.
            name: LevelFilter = "appearance" if "appearance" in fitted else "least-squares"
            looks[level.factors_zyx] = look_of(scan, name, level.factors_zyx)
    return looks


def _tables(plan: ChannelPlan) -> dict[str, Float64Array]:
    """Return the lookup table of each transfer function over all codes."""
    entries = {lookup.transfer: lookup.entries for lookup in plan.lookups}
    return {
        function.name: lookup_table(function, plan.quantize.window, entries.get(function.name, 256))
        for function in plan.transfer_functions
    }


def _made(
    scan: Classified, level: LevelPlan, name: LevelFilter, draft: Draft, progress: Progress
) -> tuple[LevelChoice, RawVolume]:
    slices = level_slices(scan, name, level.factors_zyx)
    codes = written(slices, draft.scratch(f"{level.index}.raw"), level.shape_zyx, progress.advance)
    return LevelChoice(level=level.index, filter=name), codes


def _bytes(codes: RawVolume) -> Iterator[memoryview]:
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(codes.read_slab(z0, z1))


STAGE = Stage(name="pyramid", reads=("quantize",), channel=Work(_settings, _run))
