"""Coarser levels: each is made from the codes of level 0 by its filter, and rounded once.

Where the filter is to be chosen, the light along random rays decides (choose_level.py). It also decides whether a level
gets a lookup table of its own. The decision is kept in the draft for later stages. Where voxels are classified, levels
are classified, too (classified.py).
"""

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor

from volprep.compositing import COMPOSITINGS
from volprep.parts.headlight import soft_slope
from volprep.parts.level_choices import choice_name
from volprep.parts.levels.appearance import Look
from volprep.parts.levels.choose_level import Chooser
from volprep.parts.levels.classified import CLASSIFIED_CANDIDATES, ClassifiedChooser
from volprep.parts.levels.level_input import BY_LOOKS, FITTED, Factors, LevelInput, level_slices, look_of, written
from volprep.parts.levels.level_steps import LevelSteps
from volprep.parts.levels.lit_refined import LIT_AUTO, LIT_THOROUGH, LitLevels
from volprep.parts.levels.means import are_kept, keep_means
from volprep.parts.levels.preview import error_along_rays, preview_levels
from volprep.parts.levels.projected import ProjectedChooser
from volprep.parts.levels.refined import AUTO, THOROUGH, RefineBudget
from volprep.parts.levels.rendered_rays import RaySight, SeenLevels
from volprep.parts.programs.step import layers_of
from volprep.parts.stage import Stage, Work, any_channel
from volprep.parts.texels import voxels_of
from volprep.parts.work import classified_name, coarser_levels, codes_name, codes_of_source
from volprep.plan.level_choice import LevelChoice
from volprep.plan.products import EditingPlan, FramesPlan, SegmentsPlan
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep.transfer.lookup import lookup_table
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import ChannelPart, LevelFilter
from volprep_formats.package.manifest import Contribution, Tolerance
from volprep_formats.package.parts.normals.record import SOFT_SLOPE
from volprep_formats.package.program import LAID_OVER, CompositingName, PassTarget
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record, present

CANDIDATES: tuple[LevelFilter, ...] = (
    "box",
    "median",
    "least-squares",
    "appearance",
    "feature-preserving",
    "maximum",
    "raised",
    "refined",
)
"""Candidates of "auto"; the first is the reference of the comparison."""
FREE_CANDIDATES = tuple(name for name in CANDIDATES if name not in BY_LOOKS)
"""Those that depend on no transfer function, for packages whose users edit them."""
_BEFORE_LIT_RAYS: frozenset[LevelFilter] = frozenset({"box", "least-squares", "appearance"})
"""Candidates where lit rays refine the level. Of seven scans the others were never the best, and took half of the time
of the choice."""
Candidates = Mapping[int, tuple[LevelFilter, ...]]
"""Filters that are tried, by the number of the level."""
_NEVER_FAR_DOWN: frozenset[LevelFilter] = frozenset({"median", "feature-preserving"})
"""Not tried where means are kept. On six scans with three choices of functions each, at 16 and 32 voxels along an edge,
the median had 1.02 to 2.2 times box's error in all 36; with tables of histograms it was the best in 3 of 36, by 1.3 %
at most. Both read level 0 again."""


class _Drawing(Record):
    """The fields of a plan that decide how levels are drawn, apart from tables."""

    compositing: CompositingName
    lit: bool
    central: bool
    """Whether every lit program takes central differences of the voxels that it draws."""
    soft_slope: float
    """The least slope of a place that counts half as a surface, of all lit programs."""
    tolerance: Tolerance
    measure_steps: bool
    segments: bool
    labelled: bool
    layers: PassTarget | None


def _drawing(plan: ChannelPlan) -> _Drawing:
    lit = [program for program in plan.programs if program.lighting != "none"]
    return _Drawing(
        compositing=plan.shared.compositing,
        lit=bool(lit),
        central=all(program.normals_from == "central" for program in lit),
        soft_slope=min((soft_slope(program.normals_from) for program in lit), default=SOFT_SLOPE),
        tolerance=plan.render.tolerance,
        measure_steps=plan.shared.measure_steps,
        segments=any(program.classification == "preintegrated" for program in plan.programs),
        labelled=plan.part(SegmentsPlan) is not None,
        layers=layers_of(plan.programs[0].technique, plan.profile) if plan.programs else None,
    )


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    common = (plan.grid, plan.quantize, *plan.levels, *plan.transfer_functions, *plan.lookups, *plan.preintegrated)
    return (
        *common,
        _drawing(plan),
        *present(plan.part(EditingPlan), plan.part(FramesPlan)),
        *(plan.volumes if plan.is_classified else ()),
    )


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    scan = LevelInput(codes_of_source(draft, plan), plan.grid, _tables(plan))
    coarser = [level for level in plan.levels if level.index > 0]
    lit = _lit_levels(scan, plan, coarser)
    candidates = {level.index: _candidates(level, plan, lit) for level in coarser}
    looks = {} if plan.is_classified else _looks_far_down(scan, coarser, candidates)
    passes = sum(map(len, candidates.values())) + bool(looks)
    progress.start("pyramid", passes * plan.grid.shape_zyx[0])
    if looks:
        scan.means.update(keep_means(scan.volume, looks, draft.scratch, progress.advance))
    chooser = _chooser(scan, plan, coarser, candidates) if coarser else None
    seen = _seen(scan, plan) if coarser else None
    steps = _steps(scan, plan) if coarser else None
    is_edited = plan.part(EditingPlan) is not None
    waiting: list[tuple[LevelPlan, Future[LevelChoice], RawVolume]] = []
    # Two levels are measured while the next one is made: all three use few threads.
    with ThreadPoolExecutor(2) as beside:
        for level in coarser:
            names = candidates[level.index]
            if chooser is None:
                choice, codes = _made(scan, level, names[0], draft, progress)
            else:
                choice, codes = chooser.choose(level.index, level.factors_zyx, names, draft.scratch, progress.advance)
            waiting.append((level, beside.submit(_measured, choice, codes, level, seen, lit, steps, is_edited), codes))
        choices = [_written(draft, plan, *value) for value in waiting]
    filters = {choice.level: choice.filter for choice in choices}
    labelled = _drawing(plan).labelled
    previews = preview_levels(choices, plan.levels[0].index, plan.render.tolerance, segments=labelled)
    levels = ChannelPart(name=plan.channel, levels=coarser_levels(plan, filters))
    return Contribution(channel=levels, previews=tuple(sorted(previews)))


def _measured(  # noqa: PLR0917 - a level, and what measures it
    choice: LevelChoice,
    codes: RawVolume,
    level: LevelPlan,
    seen: SeenLevels | None,
    lit: LitLevels | None,
    steps: LevelSteps | None,
    is_edited: bool,
) -> LevelChoice:
    """Complete the choice of a level that was made with its errors and its step; refine it through lit rays before."""
    if seen is None:
        choice = choice.model_copy(update={"errors": choice.tried})
    elif is_edited:
        # Each level of an editable package has tables of its own.
        errors = seen.errors(codes, level.factors_zyx, choice.tables)
        choice = choice.model_copy(update={"errors": errors})
    else:
        tables, dropped, errors = seen.chosen(codes, level.factors_zyx, choice.tables)
        choice = choice.model_copy(update={"tables": tables, "dropped": dropped, "errors": errors})
        if lit is not None and level.lit:
            choice = _refined_lit(choice, codes, level, seen, lit)
    off = error_along_rays(choice)
    step = None if steps is None else steps.measured(codes, level.factors_zyx, choice.tables, off)
    return choice.model_copy(update={"step": step})


def _refined_lit(
    choice: LevelChoice, codes: RawVolume, level: LevelPlan, seen: SeenLevels, lit: LitLevels
) -> LevelChoice:
    """Refine a level through lit rays, and write it to its file if it is nearer to level 0 in lit pictures."""
    if not lit.refines(level.factors_zyx):
        return choice.model_copy(update={"beyond_lit_budget": True})
    refined, errors = lit.refined(codes, level.factors_zyx, choice.tables)
    if errors.refined >= errors.other:
        return choice.model_copy(update={"lit": errors})
    with codes.writing() as append:
        append(refined)
    measured = seen.errors(codes, level.factors_zyx, choice.tables)
    return choice.model_copy(update={"lit": errors, "errors": measured})


def _written(
    draft: Draft, plan: ChannelPlan, level: LevelPlan, measured: Future[LevelChoice], codes: RawVolume
) -> LevelChoice:
    """Write a level and its choice, once it is measured."""
    choice = measured.result()
    name = classified_name(level.index) if plan.is_classified else codes_name(level.index, plan.channel)
    draft.write(name, "work", _bytes(codes), needed_bytes=codes.size_bytes)
    draft.write(choice_name(level.index, plan.channel), "work", choice.model_dump_json().encode())
    return choice


def _chooser(
    scan: LevelInput, plan: ChannelPlan, coarser: Sequence[LevelPlan], candidates: Candidates
) -> Chooser | ClassifiedChooser | ProjectedChooser | None:
    """Return what chooses filters, and tables where they make light; None where there is one filter for all scans."""
    if plan.is_classified:
        return ClassifiedChooser(scan, voxels_of(plan))
    if _is_projected(plan):
        return ProjectedChooser(scan, _sight(plan), [level.factors_zyx for level in coarser])
    if not _is_chosen(plan):
        return None
    return Chooser(
        scan,
        adapt=bool(plan.lookups or plan.preintegrated) and not _drawing(plan).labelled,
        editable=plan.part(EditingPlan) is not None,
        levels=[level.factors_zyx for level in coarser],
        budget=_budget(coarser, candidates),
    )


def _budget(coarser: Sequence[LevelPlan], candidates: Candidates) -> RefineBudget | None:
    """Return the budget of refinement; None if no level may be refined."""
    if not any("refined" in candidate for candidate in candidates.values()):
        return None
    return THOROUGH if any(level.refine == "thorough" for level in coarser) else AUTO


def _lit_levels(scan: LevelInput, plan: ChannelPlan, coarser: Sequence[LevelPlan]) -> LitLevels | None:
    """Return what refines levels through lit rays; None if no level is, or light does not come from its own voxels."""
    drawing = _drawing(plan)
    is_followed = drawing.lit and drawing.central and drawing.compositing in LAID_OVER
    is_fixed = not (drawing.segments or drawing.labelled or plan.part(EditingPlan) is not None)
    # Whatever filters levels have: the budget is then the same when a level is made again.
    levels = [level for level in coarser if level.lit]
    if not (levels and is_followed and is_fixed and _is_chosen(plan) and not plan.is_classified):
        return None
    is_thorough = any(level.refine == "thorough" for level in levels)
    return LitLevels(scan, [level.factors_zyx for level in levels], LIT_THOROUGH if is_thorough else LIT_AUTO)


def _seen(scan: LevelInput, plan: ChannelPlan) -> SeenLevels | None:
    """Return what measures levels as they are drawn; None where their choice measured just that."""
    is_measured = _is_projected(plan) or (_is_chosen(plan) and not _drawing(plan).lit)
    return None if plan.is_classified or is_measured else SeenLevels(scan, _sight(plan))


def _sight(plan: ChannelPlan) -> RaySight:
    drawing, quantize = _drawing(plan), plan.quantize
    compositing = COMPOSITINGS[drawing.compositing]
    return RaySight(plan.transfer_functions, quantize.window, quantize.filter, compositing, drawing.lit)


def _steps(scan: LevelInput, plan: ChannelPlan) -> LevelSteps | None:
    """Return the function that measures steps; None where they are not measured on levels."""
    drawing = _drawing(plan)
    if not drawing.measure_steps:
        return None
    window, compositing = plan.quantize.window, COMPOSITINGS[drawing.compositing]
    return LevelSteps(
        scan,
        window,
        plan.transfer_functions,
        compositing,
        is_segments=drawing.segments,
        tolerance=drawing.tolerance,
        layers=drawing.layers,
        lit=drawing.lit,
        soft_slope=drawing.soft_slope,
        labelled=drawing.labelled,
    )


def _is_chosen(plan: ChannelPlan) -> bool:
    """Return whether rays make light of mixed values by lookup tables: labels are not mixed, projections have none.

    Tables that follow from one frame of a series would flicker.
    """
    of_tables = not COMPOSITINGS[plan.shared.compositing].level_filters and not plan.quantize.labels
    return of_tables and plan.part(FramesPlan) is None


def _is_projected(plan: ChannelPlan) -> bool:
    """Return whether what rays show of levels decides between filters of the compositing."""
    return len(COMPOSITINGS[plan.shared.compositing].level_filters) > 1


def _candidates(level: LevelPlan, plan: ChannelPlan, lit: LitLevels | None) -> tuple[LevelFilter, ...]:
    if level.filter == "none":
        msg = f"level {level.index} has no filter"
        raise ValueError(msg)
    if level.filter != "auto":
        return (level.filter,)
    if plan.is_classified:
        return CLASSIFIED_CANDIDATES
    is_edited = plan.part(EditingPlan) is not None
    if _is_projected(plan):
        filters = COMPOSITINGS[plan.shared.compositing].level_filters
        return tuple(name for name in filters if not (is_edited and name in BY_LOOKS))
    candidates = FREE_CANDIDATES if is_edited else CANDIDATES
    left_out: set[LevelFilter] = {"refined"} if level.refine == "none" else set()
    # What follows unlit light first is hardly nearer in lit pictures, once lit rays were followed.
    if level.refine == "auto" and level.lit and lit is not None and lit.refines(level.factors_zyx):
        left_out = {*candidates} - _BEFORE_LIT_RAYS
    if are_kept(level.factors_zyx):
        left_out |= _NEVER_FAR_DOWN
    return tuple(name for name in candidates if name not in left_out)


def _looks_far_down(scan: LevelInput, coarser: Sequence[LevelPlan], candidates: Candidates) -> dict[Factors, Look]:
    """Return the looks of the levels, by their factors, for whose fits means are kept."""
    looks = {}
    for level in coarser:
        fitted = (FITTED | BY_LOOKS).intersection(candidates[level.index])
        if fitted and are_kept(level.factors_zyx):
            # Means with looks serve all.
            name: LevelFilter = "appearance" if BY_LOOKS & fitted else "least-squares"
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
    scan: LevelInput, level: LevelPlan, name: LevelFilter, draft: Draft, progress: Progress
) -> tuple[LevelChoice, RawVolume]:
    slices = level_slices(scan, name, level.factors_zyx)
    codes = written(slices, draft.scratch(f"{level.index}.raw"), level.shape_zyx, progress.advance)
    return LevelChoice(level=level.index, filter=name), codes


def _bytes(codes: RawVolume) -> Iterator[memoryview]:
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(codes.read_slab(z0, z1))


STAGE = Stage(
    name="pyramid",
    summary="Make the coarser levels that the package holds, each from level 0.",
    options=("pyramid", ("coarsest_longest_axis", "filter")),
    reads=("quantize",),
    channel=Work(_settings, _run),
    is_needed=any_channel(lambda plan: any(level.index for level in plan.levels)),
)
