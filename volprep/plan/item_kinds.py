"""Kinds of plan items that several rooms share. The others stand with the part that they are about."""

from volprep.plan.records import LookupPlan, PreintegratedPlan

LEVEL = "level"
"""A level of the pyramid."""
OWN_TABLE = "level-table"
"""A table that a level has of its own."""
TABLES: dict[type[LookupPlan | PreintegratedPlan], str] = {
    LookupPlan: "lookup-table",
    PreintegratedPlan: "preintegrated-table",
}
"""Kind of item of a table, by the type of its plan."""
TABLE_NAMES: dict[type[LookupPlan | PreintegratedPlan], str] = {
    LookupPlan: "lookup table",
    PreintegratedPlan: "pre-integrated table",
}
"""Name of a table, for people, by the type of its plan."""
PREVIEW = "preview"
"""The picture of the package."""
FIRST_LOOK = "first-look"
"""The kind of scan that was recognised when there is no scene."""
SEGMENT_NAMES = "names-of-segments"
"""Whether all segments have names that a package may hold."""
SEGMENT_REMARK = "source-of-segments"
"""A remark about the segments of a scan: something left out or changed."""
SEGMENT_LIGHT = "light-of-segments"
"""Least light that a segment keeps at a coarse level."""
BAKED_LIGHT = "error-of-baked-light"
"""Baked light that a scene asks for, left out or beyond the tolerance."""
LIT_CODES = "lit-codes"
"""Light that comes from codes too coarse for it."""
BEYOND = "beyond-the-tolerance"
"""A part of a picture's error that the plan has found to be beyond the tolerance."""
