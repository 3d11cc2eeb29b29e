"""Coarser levels: each is made from the codes of level 0 by its filter, and rounded once.

Where the filter is to be chosen, the light along random rays decides (choice.py). It also decides whether a level gets
a lookup table of its own. What was decided stands in the draft for later stages. Where voxels are classified, levels
are classified, too (classified.py).
"""

from collections.abc import Iterator

from volprep.compositing import COMPOSITINGS
from volprep.parts.levels.choice import Chooser
from volprep.parts.levels.classified import CLASSIFIED_CANDIDATES, ClassifiedChooser
from volprep.parts.levels.made import Classified, level_slices
from volprep.parts.levels.records import LevelChoice
from volprep.parts.stage import Stage, Work, present
from volprep.parts.texels import voxels_of
from volprep.parts.work import choice_name, classified_name, coarser_levels, codes_name, codes_of_source
from volprep.plan.records import ChannelPlan, LevelPlan
from volprep.scan.slabs import RawVolume, bytes_of, slab_ranges
from volprep.transfer.lookup import lookup_table
from volprep_formats.arrays import Float64Array
from volprep_formats.package.channel import ChannelPart, LevelFilter
from volprep_formats.package.manifest import Contribution
from volprep_formats.package.storage.draft import Draft
from volprep_formats.progress import Progress
from volprep_formats.record import Record

CANDIDATES: tuple[LevelFilter, ...] = ("box", "median", "least-squares", "appearance")
"""What "auto" chooses from; the first is what the others are compared with."""
FREE_CANDIDATES = tuple(name for name in CANDIDATES if name != "appearance")
"""Those that depend on no transfer function, for packages whose users edit them."""


def _settings(plan: ChannelPlan) -> tuple[Record, ...]:
    common = (plan.grid, plan.quantize, *plan.levels, *plan.transfer_functions, *plan.lookups, *plan.preintegrated)
    return (*common, *present(plan.editing), *(plan.volumes if plan.is_classified else ()))


def _run(draft: Draft, plan: ChannelPlan, progress: Progress) -> Contribution:
    scan = Classified(codes_of_source(draft, plan), plan.grid, _tables(plan))
    coarser = [level for level in plan.levels if level.index > 0]
    # Labels are not mixed, so that their tables fit every level; other ways to classify have no table of a level.
    adapts = COMPOSITINGS[plan.shared.compositing].level_filter is None
    adapt = adapts and bool(plan.lookups or plan.preintegrated) and not plan.quantize.labels
    measured = adapt or any(level.filter == "auto" for level in coarser)
    progress.start("pyramid", sum(len(_candidates(level, plan)) for level in coarser) * plan.grid.shape_zyx[0])
    chooser: Chooser | ClassifiedChooser | None = None
    if plan.is_classified:
        chooser = ClassifiedChooser(scan, voxels_of(plan))
    elif measured:
        chooser = Chooser(scan, adapt=adapt, editable=plan.editing is not None)
    filters: dict[int, LevelFilter] = {}
    for level in coarser:
        if chooser is None:
            (made_by,) = _candidates(level, plan)
            choice = LevelChoice(level=level.index, filter=made_by)
            draft.write(codes_name(level.index, plan.channel), "work", _made(scan, made_by, level, progress))
        else:
            choice, codes = chooser.choose(
                level.index, level.factors_zyx, _candidates(level, plan), draft.scratch, progress.advance
            )
            name = classified_name(level.index) if plan.is_classified else codes_name(level.index, plan.channel)
            draft.write(name, "work", _bytes(codes))
        filters[level.index] = choice.filter
        draft.write(choice_name(level.index, plan.channel), "work", choice.model_dump_json().encode())
    return Contribution(channel=ChannelPart(name=plan.channel, levels=coarser_levels(plan, filters)))


def _candidates(level: LevelPlan, plan: ChannelPlan) -> tuple[LevelFilter, ...]:
    if level.filter == "none":
        msg = f"level {level.index} has no filter"
        raise ValueError(msg)
    if level.filter != "auto":
        return (level.filter,)
    if plan.is_classified:
        return CLASSIFIED_CANDIDATES
    return CANDIDATES if plan.editing is None else FREE_CANDIDATES


def _tables(plan: ChannelPlan) -> dict[str, Float64Array]:
    """Return the lookup table of each transfer function over all codes."""
    entries = {lookup.transfer: lookup.entries for lookup in plan.lookups}
    return {
        function.name: lookup_table(function, plan.quantize.window, entries.get(function.name, 256))
        for function in plan.transfer_functions
    }


def _made(scan: Classified, name: LevelFilter, level: LevelPlan, progress: Progress) -> Iterator[memoryview]:
    for slices, read in level_slices(scan, name, level.factors_zyx):
        yield bytes_of(slices)
        progress.advance(read)


def _bytes(codes: RawVolume) -> Iterator[memoryview]:
    for z0, z1 in slab_ranges(codes.shape_zyx[0], codes.slice_bytes):
        yield bytes_of(codes.read_slab(z0, z1))


STAGE = Stage(name="pyramid", reads=("quantize",), channel=Work(_settings, _run))
