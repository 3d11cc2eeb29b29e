"""Every technique that programs may have, by its name."""

from volprep.shading.raycast import published_ray_casting, ray_casting
from volprep.shading.slabs import slabs
from volprep.shading.slices import axis_slices, published_view_slices, view_slices
from volprep.shading.two_pass import published_two_pass, two_pass
from volprep.shading.walk import WalkOf
from volprep_formats.package.program import TechniqueName

WALKS: dict[TechniqueName, WalkOf] = {
    "ray-casting": ray_casting,
    "ray-casting-as-published": published_ray_casting,
    "two-pass": two_pass,
    "two-pass-as-published": published_two_pass,
    "slabs": slabs,
    "tiles": ray_casting,
    "axis-slices": axis_slices,
    "view-slices": view_slices,
    "view-slices-as-published": published_view_slices,
}
