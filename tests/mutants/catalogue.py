"""All planted bugs."""

from .mutant import Mutant
from .of_parts import OF_PARTS
from .of_readers import OF_READERS
from .of_segments import OF_SEGMENTS
from .of_shaders import OF_SHADERS
from .of_stages import OF_STAGES
from .of_truth import OF_TRUTH

MUTANTS: tuple[Mutant, ...] = (*OF_READERS, *OF_STAGES, *OF_SEGMENTS, *OF_SHADERS, *OF_PARTS, *OF_TRUTH)
