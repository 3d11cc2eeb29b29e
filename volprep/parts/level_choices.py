"""Decisions about coarser levels, as the stage that makes levels stores them in the draft for later stages.

The names of a level's own tables follow from the names of the common ones.
"""

from functools import lru_cache
from typing import TypeVar

import numpy as np

from volprep.plan.level_choice import LevelChoice
from volprep.plan.records import ChannelPlan, LookupPlan, PreintegratedPlan
from volprep_formats.arrays import Float64Array
from volprep_formats.package.storage.draft import Draft


def choice_name(level: int, channel: str) -> str:
    """Return the name of the decision about a level of a channel, made with the level."""
    return f"work/choice{level}-{channel}.json"


def choices_of(draft: Draft, plan: ChannelPlan) -> tuple[LevelChoice, ...]:
    """Return the decisions about the levels that are coarser than level 0."""
    named = {record.path for record in draft.manifest.files}
    names = [choice_name(level.index, plan.channel) for level in plan.levels]
    return tuple(_parsed(draft.read_bytes(name)) for name in names if name in named)


# A build asks a dozen times for the same few files, and parsing their tables took a tenth of a small build.
@lru_cache(maxsize=16)
def _parsed(text: bytes) -> LevelChoice:
    return LevelChoice.model_validate_json(text)


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


def table_of_level(table: LevelTable, level: int) -> LevelTable:
    """Return the names of the table that a level has of its own."""
    return table.model_copy(update={"name": f"{table.name}-level{level}", "file": file_of_level(table.name, level)})


def file_of_level(name: str, level: int) -> str:
    """Return the file of the table that a level has instead of the one of this name."""
    return f"textures/{name}-level{level}.ktx2"
