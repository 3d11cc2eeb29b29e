"""Ray casting in a single pass: the box is cut in the fragment shader (Mobeen and Feng 2012).

As published: with an opacity for each step (mobile volume rendering thesis; Schultz and Bailey).
"""

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
PUBLISHED_RAY_CASTING = Technique(
    name="ray-casting-as-published",
    text="ray casting with an opacity for each step, as the mobile volume rendering thesis published it",
    samplings=frozenset(("texture3d", "mosaic", "bricks")),
    compositings=frozenset(("emission-absorption",)),
    classifications=frozenset(("lookup", "palette", "control-points", "preclassified")),
    loops=True,
    order=0.0,
    order_limit="As published, each sample has the same opacity, whatever its distance from the next one: finer steps "
    "make all of the picture opaque.",
    step_voxels=1.0,
)
