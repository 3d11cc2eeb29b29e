"""Every part that a package may have. A new part adds one line here; plan, stages, costs and validation loop over it.

The order is that of decisions: a part sees the plans of those before it.
"""

from volprep.parts.bricks.part import PART as BRICKS
from volprep.parts.classification.part import PART as CLASSIFICATION
from volprep.parts.compression.part import PART as COMPRESSION
from volprep.parts.editing.part import PART as EDITING
from volprep.parts.flattened.part import PART as FLATTENED
from volprep.parts.layout.part import PART as LAYOUT
from volprep.parts.levels.part import PART as LEVELS
from volprep.parts.light.part import PART as LIGHT
from volprep.parts.mosaic.part import PART as MOSAIC
from volprep.parts.normals.part import PART as NORMALS
from volprep.parts.part import Part
from volprep.parts.programs.part import PART as PROGRAMS
from volprep.parts.proxy.part import PART as PROXY
from volprep.parts.segments.part import PART as SEGMENTS
from volprep.parts.skip.part import PART as SKIP
from volprep.parts.slices.part import PART as SLICES
from volprep.parts.subvolumes.part import PART as SUBVOLUMES
from volprep.parts.texture.part import PART as TEXTURE
from volprep.parts.values.part import PART as VALUES

PARTS: tuple[Part, ...] = (
    VALUES,
    LEVELS,
    LAYOUT,
    COMPRESSION,
    FLATTENED,
    CLASSIFICATION,
    NORMALS,
    LIGHT,
    MOSAIC,
    TEXTURE,
    BRICKS,
    SKIP,
    SEGMENTS,
    PROXY,
    SUBVOLUMES,
    EDITING,
    SLICES,
    PROGRAMS,
)
