"""Ray casting in two passes over the faces of the box, and as Congote et al. (2011) published it."""

from typing import get_args

from volprep.techniques.record import Technique
from volprep_formats.package.program import ClassificationName, CompositingName

TWO_PASS = Technique(
    name="two-pass",
    text="ray casting in two passes",
    samplings=frozenset(("texture3d", "mosaic", "bricks")),
    compositings=frozenset(get_args(CompositingName)),
    classifications=frozenset(get_args(ClassificationName)) - {"colour"},
    loops=True,
    meshes=True,
    passes_before=1,
)
PUBLISHED_TWO_PASS = Technique(
    name="two-pass-as-published",
    text="ray casting in two passes as Congote et al. published it",
    samplings=TWO_PASS.samplings,
    compositings=TWO_PASS.compositings,
    classifications=TWO_PASS.classifications,
    loops=True,
    passes_before=1,
    order=0.0,
    order_limit="As published, rays end at positions of 8 bits, up to 1/510 of the box away from where they should: an "
    "error that no step makes smaller.",
)
