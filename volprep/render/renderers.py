"""Choose the renderer of a package: with shaders, with shaders and proxy geometry, or slices without shaders."""

from typing import Protocol

from volprep.render.inputs import Inputs, undrawable
from volprep.render.proxy_renderer import ProxyRenderer, has_mesh
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction


class EditOfFunction(Protocol):
    """A transfer function that a user puts in place of the one that is drawn."""

    @property
    def function(self) -> TransferFunction:
        """The function, for slices."""

    def __call__(self, package: Package, inputs: Inputs) -> Inputs:
        """Return the inputs of a program after the edit."""


def renderer_of(
    package: Package,
    *,
    level: int | None = None,
    transfer: str | None = None,
    point: int | None = None,
    edit: EditOfFunction | None = None,
) -> Renderer | SliceRenderer:
    """Return the renderer of a package, into 8 bits, also after an edit. Errors as `Renderer` and `SliceRenderer`."""
    if package.manifest.profile.has_shaders:
        if point is not None or edit is not None:
            return Renderer(package, level=level, transfer=transfer, point=point, edit=edit)
        return ray_caster_of(package, level, transfer)(package, level=level, transfer=transfer)
    if point is not None:
        raise undrawable(package, f"anything around point {point}", transfer, "its slices")
    return SliceRenderer(package, level=level, transfer=transfer, edit=edit.function if edit else None)


def ray_caster_of(package: Package, level: int | None, transfer: str | None) -> type[Renderer]:
    """Return the renderer that draws this with shaders. If the package has a mesh for it, rays begin at the mesh."""
    return ProxyRenderer if has_mesh(package, level, transfer) else Renderer
