"""The part *levels*: coarser levels, and the tables that they have of their own."""

from volprep.parts.levels.level_results import settle
from volprep.parts.levels.stage import STAGE
from volprep.parts.part import Part

PART = Part(name="levels", stages=(STAGE,), settle=settle)
