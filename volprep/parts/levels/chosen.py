"""What was decided about levels when they were made, for the stages after that: filters, tables, and the reasons."""

from collections.abc import Iterator
from typing import Literal, TypeVar

import numpy as np

from volprep.parts.levels.preview import preview_levels, preview_reason
from volprep.parts.levels.records import LevelChoice, Trial
from volprep.parts.work import choice_name
from volprep.plan.records import ChannelPlan, LookupPlan, Plan, PreintegratedPlan
from volprep_formats.arrays import Float64Array
from volprep_formats.package.manifest import PlanItem
from volprep_formats.package.storage.draft import Draft


def choices_of(draft: Draft, plan: ChannelPlan) -> tuple[LevelChoice, ...]:
    """Return the decisions about the levels that are coarser than level 0."""
    named = {record.path for record in draft.manifest.files}
    names = [choice_name(level.index, plan.channel) for level in plan.levels]
    return tuple(LevelChoice.model_validate_json(draft.read_bytes(name)) for name in names if name in named)


def own_tables(draft: Draft, plan: ChannelPlan, transfer: str) -> dict[int, Float64Array]:
    """Return the tables of levels that have one of their own for a transfer function, by level."""
    return {
        choice.level: np.array(table.entries)
        for choice in choices_of(draft, plan)
        for table in choice.tables
        if table.transfer == transfer
    }


LevelTable = TypeVar("LevelTable", LookupPlan, PreintegratedPlan)
"""A table that a level may have of its own."""

_KINDS: dict[type[LookupPlan | PreintegratedPlan], str] = {
    LookupPlan: "lookup table",
    PreintegratedPlan: "pre-integrated table",
}


def table_of_level(table: LevelTable, level: int) -> LevelTable:
    """Return the names of the table that a level has of its own."""
    return table.model_copy(update={"name": f"{table.name}-level{level}", "file": file_of_level(table.name, level)})


def file_of_level(name: str, level: int) -> str:
    """Return the file of the table that a level has instead of the one of this name."""
    return f"textures/{name}-level{level}.ktx2"


def settled_items(items: tuple[PlanItem, ...], draft: Draft, plan: Plan) -> tuple[PlanItem, ...]:
    """Complete the plan's items by what only the data could decide: how levels are made, and with which tables."""
    textures = {texture.name for texture in draft.manifest.textures}
    settled = {(item.channel, item.name): item for each in plan.channels for item in _decided(draft, each)}
    # A common table that no level needs was not written.
    common = {
        (each.channel, f"{_KINDS[type(table)]} {table.transfer}"): table
        for each in plan.channels
        for table in _tables(each)
    }
    unused = {key for key, table in common.items() if table.name not in textures}
    previews: dict[tuple[str | None, str], str] = {
        (each.channel, name): why for each in plan.channels for name, why in _previews(draft, each)
    }
    keys = [(item.channel, item.name) for item in items]
    planned = [_also(settled.pop(key, item), previews.get(key)) for key, item in zip(keys, items, strict=True)]
    reason = "every level has a table of its own"
    return tuple(
        PlanItem(name=item.name, channel=item.channel, kept=False, reason=reason, size_bytes=item.size_bytes)
        if (item.channel, item.name) in unused
        else item
        for item in (*planned, *settled.values())
    )


def _tables(plan: ChannelPlan) -> tuple[LookupPlan | PreintegratedPlan, ...]:
    """Return the tables that a level may have of its own."""
    return (*plan.lookups, *plan.preintegrated)


def _decided(draft: Draft, plan: ChannelPlan) -> Iterator[PlanItem]:
    tables = {table.transfer: table for table in _tables(plan)}
    made = "fitted to the level" if plan.editing is None else "of its joint histogram"
    for choice in choices_of(draft, plan):
        if len({trial.filter for trial in choice.trials}) > 1:
            yield PlanItem(
                name=f"filter of level {choice.level}",
                channel=plan.channel,
                kept=True,
                reason=f"{choice.filter}: its light along random rays is nearest to that of level 0; {_listed(choice)}",
            )
        own = {table.transfer for table in choice.tables}
        for common, adapted in _pairs(choice):
            table = tables[adapted.transfer]
            file = file_of_level(table.name, choice.level)
            kept = adapted.transfer in own
            yield PlanItem(
                name=f"{_KINDS[type(table)]} {adapted.transfer} of level {choice.level}",
                channel=plan.channel,
                kept=kept,
                reason=f"along random rays light is {adapted.rmse:.2g} from that of level 0 with a table {made}, "
                f"{common.rmse:.2g} with the common one",
                files=(file,) if kept else (),
            )


def _previews(draft: Draft, plan: ChannelPlan) -> Iterator[tuple[str, str]]:
    """Return the items of levels that are for previews only, and why they are."""
    choices, tolerance = choices_of(draft, plan), plan.render.tolerance
    previews = preview_levels(choices, plan.levels[0].index, tolerance)
    for choice in choices:
        if choice.level in previews:
            yield f"level {choice.level}", preview_reason(choice, tolerance)


def _also(item: PlanItem, reason: str | None) -> PlanItem:
    return item if reason is None else item.model_copy(update={"reason": f"{item.reason}; {reason}"})


def _pairs(choice: LevelChoice) -> Iterator[tuple[Trial, Trial]]:
    """Common and adapted table of the chosen filter, for each transfer function."""
    whole = [trial for trial in choice.trials if trial.filter == choice.filter and trial.on == "whole"]
    tried = {(trial.transfer, trial.table): trial for trial in whole}
    for (transfer, table), trial in tried.items():
        if table == "adapted":
            yield tried[transfer, "common"], trial


def _listed(choice: LevelChoice) -> str:
    """Write the errors of all filters: for each the better of its tables, the mean over transfer functions."""
    listed = ", ".join(f"{name} {error:.2g}" for name, error in _errors(choice, "whole").items())
    on_blocks = _errors(choice, "blocks")
    if not on_blocks:
        return listed
    of_blocks = ", ".join(f"{name} {error:.2g}" for name, error in on_blocks.items())
    return f"{listed}; only those that were nearly the best on blocks of the volume made all of it: {of_blocks}"


def _errors(choice: LevelChoice, on: Literal["whole", "blocks"]) -> dict[str, float]:
    errors: dict[str, dict[str, float]] = {}
    for trial in choice.trials:
        if trial.on == on:
            found = errors.setdefault(trial.filter, {})
            found[trial.transfer] = min(trial.rmse, found.get(trial.transfer, trial.rmse))
    return {name: float(np.mean(list(each.values()))) for name, each in errors.items()}
