"""Choose the renderer of a package after an edit of its transfer function."""

from volprep.parts.editing.inputs import edit_with
from volprep.render.renderer import Renderer
from volprep.render.slices import SliceRenderer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction


def edited_renderer(
    package: Package,
    function: TransferFunction,
    *,
    level: int | None = None,
    transfer: str | None = None,
    point: int | None = None,
) -> Renderer | SliceRenderer:
    """Return the renderer of a package with `function` in place of the one that it draws, into 8 bits.

    Raises VP5023 for a package whose functions are not editable, and the errors of `Renderer` and `SliceRenderer`.
    """
    if package.manifest.profile.has_shaders:
        return Renderer(package, level=level, transfer=transfer, point=point, edit=edit_with(function))
    if point is not None:
        fields = {"level": f"around point {point}", "transfer": transfer or "any", "known": "its slices"}
        raise VolprepError("VP5018", package=package.path, **fields)
    return SliceRenderer(package, level=level, transfer=transfer, edit=function)
