"""Every item that keys of a scene add or remove.

Levels, their own tables, and data that no program can draw without are removed from the package itself.
"""

from volprep.parts.ablation import AblationItem
from volprep.parts.registry import PARTS

ITEMS: tuple[AblationItem, ...] = tuple(item for part in PARTS for item in part.ablations)
