"""Ray casting slab by slab: the same samples in several draws (Díaz-García et al. 2018, section 4)."""

from volprep.techniques.record import Technique

SLABS = Technique(
    name="slabs",
    text="ray casting slab by slab",
    samplings=frozenset(("texture3d", "mosaic", "bricks")),
    compositings=frozenset(("emission-absorption",)),
    classifications=frozenset(("lookup", "preintegrated", "palette", "control-points", "preclassified")),
    loops=True,
    meshes=True,
)
