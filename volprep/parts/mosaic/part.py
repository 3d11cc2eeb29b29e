"""The part *mosaic*: levels as 2D textures, for devices without 3D textures."""

from volprep.parts.mosaic.stage import STAGE
from volprep.parts.part import Part

PART = Part(name="mosaic", stages=(STAGE,))
