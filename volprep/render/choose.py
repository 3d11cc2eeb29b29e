"""Choose the renderer of a package: with shaders, with shaders and proxy geometry, or slices without shaders."""

from volprep.render.inputs import undrawable
from volprep.render.proxy_renderer import ProxyRenderer, has_mesh
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep_formats.package.reader import Package


def renderer_of(
    package: Package,
    *,
    level: int | None = None,
    transfer: str | None = None,
    point: int | None = None,
) -> Renderer | SliceRenderer:
    """Return the renderer of a package, into 8 bits. Errors as `Renderer` and `SliceRenderer`."""
    if package.manifest.profile.has_shaders:
        if point is not None:
            return Renderer(package, level=level, transfer=transfer, point=point)
        return ray_caster_of(package, level, transfer)(package, level=level, transfer=transfer)
    if point is not None:
        raise undrawable(package, f"anything around point {point}", transfer, "its slices")
    return SliceRenderer(package, level=level, transfer=transfer)


def ray_caster_of(package: Package, level: int | None, transfer: str | None) -> type[Renderer]:
    """Return the renderer that draws this with shaders. If the package has a mesh for it, rays begin at the mesh."""
    return ProxyRenderer if has_mesh(package, level, transfer) else Renderer
