"""Items of the plan about coarser levels, completed with the decisions of the stage that makes them."""

import math
from collections.abc import Iterator
from typing import Literal

import numpy as np

from volprep.parts.level_choices import choices_of, file_of_level
from volprep.parts.levels.preview import preview_levels, preview_reason
from volprep.plan.item_kinds import BEYOND, LEVEL, OWN_TABLE, TABLE_NAMES, TABLES
from volprep.plan.level_choice import WORSE_THAN_MEANS, DroppedTable, LevelChoice, Trial
from volprep.plan.products import EditingPlan, SegmentsPlan
from volprep.plan.records import ChannelPlan, LookupPlan, Plan, PreintegratedPlan
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft


def settle(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Complete the items with the results that depend on the data: filters and tables of the levels."""
    written = {texture.name for texture in draft.manifest.textures}
    common = {
        (channel.channel, TABLES[type(table)], table.transfer): table.name in written
        for channel in plan.channels
        for table in _tables(channel)
    }
    previews = {(channel.channel, level): why for channel in plan.channels for level, why in _previews(draft, channel)}
    settled = [_settled(item, common, previews) for item in items]
    return (*settled, *(item for channel in plan.channels for item in _decided(draft, channel)))


def _settled(
    item: PlanItem, common: dict[tuple[str, str, str], bool], previews: dict[tuple[str, int], str]
) -> PlanItem:
    """Complete one item. `common` says which common tables were written, `previews` why a level is a preview."""
    if item.channel is None:
        return item
    if item.transfer is not None and not common.get((item.channel, item.kind, item.transfer), True):
        # No level needs it, so that it was not written.
        unused = {"kept": False, "reason": "every level has a table of its own", "files": ()}
        return item.model_copy(update=unused)
    if item.kind == LEVEL and item.level is not None and (item.channel, item.level) in previews:
        return item.model_copy(update={"reason": f"{item.reason}; {previews[item.channel, item.level]}"})
    return item


def _tables(plan: ChannelPlan) -> tuple[LookupPlan | PreintegratedPlan, ...]:
    """Return the tables that a level may have of its own."""
    return (*plan.lookups, *plan.preintegrated)


_NEARLY_ALL = 0.05
"""Light that is gained or lost without being told, as a part."""
_BEYOND = """; refining it is beyond the budget of refine = "auto": refine = "thorough" in [pyramid] takes minutes"""


def _decided(draft: Draft, plan: ChannelPlan) -> Iterator[PlanItem]:
    tables = {table.transfer: table for table in _tables(plan)}
    made = "fitted to the level" if plan.part(EditingPlan) is None else "of its joint histogram"
    for choice in choices_of(draft, plan):
        if plan.level(choice.level).filter != "auto":
            yield from _worse_than_means(choice, plan)
        elif choice.trials:
            yield PlanItem(
                name=f"filter of level {choice.level}",
                kind="level-filter",
                level=choice.level,
                channel=plan.channel,
                kept=True,
                reason=f"{choice.filter}: along rays aimed at what is seen its light is nearest to that of level 0; "
                f"errors: {_listed(choice)}{_BEYOND if choice.beyond_budget else ''}{_refused(choice)}"
                f"{_refined_lit(choice)}",
            )
        own = {table.transfer for table in choice.tables}
        lit = {table.transfer: _lit(table) for table in choice.dropped}
        for common, adapted in _pairs(choice):
            table = tables[adapted.transfer]
            file = file_of_level(table.name, choice.level)
            kept = adapted.transfer in own
            yield PlanItem(
                name=f"{TABLE_NAMES[type(table)]} {adapted.transfer} of level {choice.level}",
                kind=OWN_TABLE,
                transfer=adapted.transfer,
                level=choice.level,
                channel=plan.channel,
                kept=kept,
                reason=f"light is {adapted.error:.2g} from that of level 0 with a table {made}, "
                f"{common.error:.2g} with the common one{lit.get(adapted.transfer, '')}",
                files=(file,) if kept else (),
            )


def _worse_than_means(choice: LevelChoice, plan: ChannelPlan) -> Iterator[PlanItem]:
    """Yield a warning for each transfer function that box means draw better than the scene's filter."""
    means = {trial.transfer: trial.error for trial in choice.trials if (trial.filter, trial.table) == ("box", "common")}
    for trial in choice.chosen:
        of_means = means.get(trial.transfer, math.inf)
        if trial.error > WORSE_THAN_MEANS * of_means:
            yield PlanItem(
                name=f"light of level {choice.level} with {trial.transfer}",
                kind=BEYOND,
                transfer=trial.transfer,
                level=choice.level,
                channel=plan.channel,
                kept=True,
                reason=f"level {choice.level} with {trial.transfer} is worse than box means: along rays its light is "
                f"{trial.error:.2g} from that of level 0 with filter {choice.filter}, {of_means:.2g} with box means; "
                'validate may refuse it (VP6070); filter = "auto" in [pyramid] tries several',
            )


def _refused(choice: LevelChoice) -> str:
    """Say why a refined level that seemed better is not taken."""
    if choice.refused is None:
        return ""
    errors = choice.refused
    return f"; refined, it is {errors.refined:.3g} from it in pictures, and {errors.other:.3g} with this filter"


def _refined_lit(choice: LevelChoice) -> str:
    """Say what refining a level through lit rays has brought."""
    if choice.lit is None:
        return "; refining it through lit rays is beyond the budget" if choice.beyond_lit_budget else ""
    errors = choice.lit
    found = "" if errors.refined < errors.other else ", and is not taken"
    lit = f"; refined through lit rays, it is {errors.refined:.3g} from it in lit pixels{found}"
    return f"{lit}; before, {errors.other:.3g}"


def _lit(table: DroppedTable) -> str:
    """Say why a lit level does not take a table."""
    return f"; lit, it is {table.rmse:.3g} from it with this table, {table.common_rmse:.3g} with the common one"


def _previews(draft: Draft, plan: ChannelPlan) -> Iterator[tuple[int, str]]:
    """Return the levels that are for previews only, and why they are."""
    choices, tolerance = choices_of(draft, plan), plan.render.tolerance
    segments = plan.part(SegmentsPlan) is not None
    previews = preview_levels(choices, plan.levels[0].index, tolerance, segments=segments)
    for choice in choices:
        if choice.level in previews:
            yield choice.level, preview_reason(choice, tolerance, segments=segments)


def _pairs(choice: LevelChoice) -> Iterator[tuple[Trial, Trial]]:
    """Common and adapted table of the chosen filter, for each transfer function."""
    whole = [trial for trial in choice.trials if trial.filter == choice.filter and trial.on == "whole"]
    tried = {(trial.transfer, trial.table): trial for trial in whole}
    for (transfer, table), trial in tried.items():
        if table == "adapted":
            yield tried[transfer, "common"], trial


def _listed(choice: LevelChoice) -> str:
    """Write the errors of all filters: for each the better of its tables, the mean over transfer functions."""
    listed = _written(choice, "whole")
    on_blocks = _written(choice, "blocks")
    if not on_blocks:
        return listed
    return f"{listed}; only those that were nearly the best on blocks of the volume made all of it: {on_blocks}"


def _written(choice: LevelChoice, on: Literal["whole", "blocks"]) -> str:
    """Write the error of each filter, and the part of the light that it keeps where that is not nearly all."""
    best: dict[str, dict[str, Trial]] = {}
    for trial in choice.trials:
        if trial.on == on:
            found = best.setdefault(trial.filter, {})
            found[trial.transfer] = min(trial, found.get(trial.transfer, trial), key=lambda tried: tried.error)
    texts = []
    for name, trials in best.items():
        error = float(np.mean([trial.error for trial in trials.values()]))
        kept = min((trial.kept_light for trial in trials.values()), key=lambda part: -abs(part - 1.0))
        texts.append(f"{name} {error:.2g}" + (f" (light kept {kept:.2f})" if abs(kept - 1.0) > _NEARLY_ALL else ""))
    return ", ".join(texts)
