"""Layers across the view or an axis, blended (Noguera and Jiménez 2012, section 3.2), and slices as published there."""

from volprep.techniques.record import Technique

VIEW_SLICES = Technique(
    name="view-slices",
    text="slices across the view",
    samplings=frozenset(("texture3d", "mosaic", "bricks")),
    compositings=frozenset(("emission-absorption",)),
    classifications=frozenset(("lookup", "preintegrated", "palette", "control-points", "preclassified")),
    loops=False,
    blends=True,
)
AXIS_SLICES = Technique(
    name="axis-slices",
    text="slices across the axis that faces the viewer",
    samplings=VIEW_SLICES.samplings,
    compositings=VIEW_SLICES.compositings,
    classifications=VIEW_SLICES.classifications,
    loops=False,
    blends=True,
)
PUBLISHED_VIEW_SLICES = Technique(
    name="view-slices-as-published",
    text="slices across the view as Noguera and Jiménez published them",
    samplings=VIEW_SLICES.samplings,
    compositings=VIEW_SLICES.compositings,
    classifications=frozenset(("lookup", "palette", "control-points", "preclassified")),
    loops=False,
    blends=True,
    order=0.0,
    order_limit="As published, opacities are added, and linear in the distance of slices: finer slices converge, but "
    "not to the integral of emission and absorption.",
    step_voxels=1.0,
)
