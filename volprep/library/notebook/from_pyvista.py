"""`volprep.from_pyvista`: a volume of a pyvista plotter with its transfer function."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

from volprep.library.notebook.show import built_widget
from volprep.library.notebook.sources import scan_file
from volprep.library.notebook.widget import VolumeWidget
from volprep.scene.points import ScenePoint
from volprep.scene.profiles import load_profile
from volprep.scene.request import UNNAMED, Request
from volprep.scene.scene import Scene
from volprep.scene.transfer import SceneTransfer
from volprep_formats.diagnostics import VolprepError
from volprep_formats.path_text import path_text
from volprep_formats.progress import Progress
from volprep_formats.source import SourceSpec

_SAMPLES = 64
"""Points that a function has at least: VTK blends sRGB colours between its own, volprep linear light."""


class VtkPlotter(Protocol):
    """A `pyvista.Plotter`."""

    @property
    def renderer(self) -> object:
        """The renderer with its actors."""


def from_pyvista(
    plotter: VtkPlotter,
    *,
    volume: int | None = None,
    profile: str | None = None,
    editable: bool = False,
    background: str = "#000000",
    progress: Progress | None = None,
) -> VolumeWidget:
    """Show a volume of a pyvista plotter, with its colours and opacities.

    Opacities keep their unit distance, and `shade=True` becomes a light at the viewer. Light is added in linear space,
    where VTK adds sRGB codes: haze is brighter than in VTK. Positions are taken as the patient's space (LPS).

    Parameters
    ----------
    plotter
        Plotter with an ImageData that was added with `add_volume`.
    volume
        Number of the volume, from 0, if the plotter has several.
    profile
        Class of devices; "gles3" if absent.
    editable
        Whether the widget's `points` may change the transfer function.
    background
        Background colour, "#rrggbb".
    progress
        Progress callback, or None.

    Returns
    -------
    VolumeWidget
        The widget, as `show` returns it.

    Raises
    ------
    VolprepError
        VP7090 without the extra `notebook`, VP7093 for a volume that cannot be taken, and the errors of
        `build_package`.
    """
    actor = _actor(plotter, volume)
    shown = actor.GetProperty()
    with TemporaryDirectory(prefix="volprep-") as name:
        folder = Path(name)
        file = Path(str(scan_file(_placed(actor), folder)))
        device = load_profile(profile or "gles3", Path())
        scene = Scene.model_validate(
            {
                "name": UNNAMED,
                "source": SourceSpec(path=path_text(file)),
                "transfer": (_function(shown),),
                "editable": editable,
                "render": {"lighting": "headlight" if shown.GetShade() and device.has_shaders else "none"},
            }
        )
        request = Request(scene=scene.lit(device), profile=device, scene_path=None)
        return built_widget(request, folder, progress, background=background)


def _actor(plotter: Any, number: int | None) -> Any:
    """Return the volume of that number, or the only one. Raises VP7093 for one that cannot be taken."""
    from vtkmodules.vtkRenderingCore import vtkVolume  # noqa: PLC0415 - optional, loaded with the plotter

    found: list[Any] = [actor for actor in plotter.renderer.actors.values() if isinstance(actor, vtkVolume)]
    if number is None and len(found) > 1:
        raise VolprepError("VP7093", reason=f"the plotter has {len(found)} volumes")
    index = number or 0
    if not 0 <= index < len(found):
        raise VolprepError("VP7093", reason=f"the plotter has {len(found)} volumes, and number {index} is wanted")
    actor = found[index]
    mapper = actor.GetMapper()
    if not mapper.GetInput().IsA("vtkImageData"):
        raise VolprepError("VP7093", reason=f"it is a {mapper.GetInput().GetClassName()}")
    if mapper.GetBlendMode() != mapper.COMPOSITE_BLEND:
        raise VolprepError("VP7093", reason="its blending is not composite")
    return actor


def _placed(actor: Any) -> Any:
    """Return the actor's image where the actor shows it."""
    import pyvista  # noqa: PLC0415 - optional, loaded with the plotter

    image = pyvista.wrap(actor.GetMapper().GetInput()).copy(deep=False)
    matrix = pyvista.array_from_vtkmatrix(actor.GetMatrix())
    columns = matrix[:3, :3] @ np.array(image.direction_matrix) * np.array(image.spacing)
    spacing = np.linalg.norm(columns, axis=0)
    origin = matrix[:3, :3] @ np.array(image.origin) + matrix[:3, 3]
    image.origin, image.spacing, image.direction_matrix = tuple(origin), tuple(spacing), columns / spacing
    return image


def _function(shown: Any) -> SceneTransfer:
    """Return the colours and opacities of a vtkVolumeProperty as one transfer function."""
    colour, opacity = shown.GetRGBTransferFunction(), shown.GetScalarOpacity()
    grey = shown.GetGrayTransferFunction() if shown.GetColorChannels() == 1 else None
    functions = [opacity, colour if grey is None else grey]
    low, high = (edge(function.GetRange()[i] for function in functions) for i, edge in enumerate((min, max)))
    nodes = [node for function in functions for node in _nodes(function)]
    values = np.unique([*nodes, *np.linspace(low, high, _SAMPLES)])

    def tone(value: float) -> tuple[float, ...]:
        found = (grey.GetValue(value),) * 3 if grey is not None else colour.GetColor(value)
        return tuple(min(max(value, 0.0), 1.0) for value in found)

    points = [
        ScenePoint(value=value, colour=tone(value), opacity=min(max(opacity.GetValue(value), 0.0), 1.0))
        for value in values.tolist()
    ]
    return SceneTransfer(
        name="pyvista", reference_mm=shown.GetScalarOpacityUnitDistance(), points=tuple(points), colour_space="srgb"
    )


def _nodes(function: Any) -> list[float]:
    width = 6 if function.IsA("vtkColorTransferFunction") else 4
    node = [0.0] * width
    found = []
    for index in range(function.GetSize()):
        function.GetNodeValue(index, node)
        found.append(node[0])
    return found
