"""The part *fidelity*: a statement of how near pictures of each level are to the scan, if a scene asks for it."""

from volprep.parts.fidelity.stage import STAGE
from volprep.parts.part import Part

PART = Part(name="fidelity", devices="any", stages=(STAGE,))
