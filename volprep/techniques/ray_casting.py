"""Ray casting in a single pass: the box is cut in the fragment shader (Mobeen and Feng 2012)."""

from typing import get_args

from volprep.techniques.record import Technique
from volprep_formats.package.program import ClassificationName, CompositingName, Sampling

RAY_CASTING = Technique(
    name="ray-casting",
    text="ray casting",
    samplings=frozenset(get_args(Sampling)),
    compositings=frozenset(get_args(CompositingName)),
    classifications=frozenset(get_args(ClassificationName)),
    loops=True,
    meshes=True,
)
