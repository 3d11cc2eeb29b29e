"""One picture of a package, from the choice of a camera to the file."""

from dataclasses import dataclass
from pathlib import Path

from volprep.parts.editing.inputs import edit_with
from volprep.pipeline.framing import filled
from volprep.render.choose import renderer_of
from volprep.render.hybrid import HybridWish, hybrid_picture
from volprep.scene.request import load_edit
from volprep.truth.camera import Camera, standard_views, view_from
from volprep.truth.picture import Background, encoded
from volprep_formats.arrays import FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Vector
from volprep_formats.output import require_place, write_file
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes


@dataclass(frozen=True)
class Shot:
    """What to draw, and how."""

    view: str
    """Name of a standard view; used if there is no eye."""
    eye_mm_xyz: Vector | None
    """Where to look from, in the patient's space (LPS)."""
    shape_hw: tuple[int, int]
    """Height and width in pixels."""
    background: Background
    """What is behind the volume."""
    level: int | None
    """Level to draw; the finest if absent."""
    point: int | None
    """Point of the grid whose sub-volumes are drawn, in place of a level."""
    transfer: str | None
    """Transfer function to draw with; the first if absent."""
    step_mm: float | None
    """Distance of the samples; the package's own if absent."""
    edit: Path | None = None
    """File of a transfer function to draw in place of the package's."""
    fill: bool = False
    """Whether what is seen fills the picture; if not, all views show the volume in one size."""
    hybrid: HybridWish | None = None
    """Lines around the volume, and a smaller picture of it; what the package asks for if absent."""


@dataclass(frozen=True)
class Taken:
    """What was drawn."""

    level: int
    """Level."""
    drawn_by: str
    """Program, or slices."""
    driver: str
    """Driver."""
    seen: float
    """Part of the pixels in which something is seen."""


def draw(package_path: Path, shot: Shot) -> tuple[FloatArray, Taken]:
    """Draw a package: a premultiplied linear picture [H, W, 4], and what drew it.

    Raises what `Package.open`, `renderer_of`, `load_edit` and `hybrid_picture` raise, VP5020 and VP5022 for
    an impossible camera.
    """
    package = Package.open(package_path)
    grid = package.manifest.levels[0].grid
    height, width = shot.shape_hw
    camera = _camera(package.manifest, shot)
    edit = None if shot.edit is None else edit_with(load_edit(shot.edit, grid))
    with renderer_of(package, level=shot.level, transfer=shot.transfer, point=shot.point, edit=edit) as renderer:
        box_from_clip = camera.box_from_clip(grid, width / max(height, 1))
        if shot.fill and min(shot.shape_hw) > 0:
            box_from_clip = filled(renderer, box_from_clip, shot.shape_hw)
        asked = None if package.manifest.render is None else package.manifest.render.hybrid
        hybrid = shot.hybrid or (None if asked is None else HybridWish.of_package(asked, shot.shape_hw))
        if hybrid is None:
            picture = renderer.render(box_from_clip, shot.shape_hw, shot.step_mm)
        else:
            picture = hybrid_picture(renderer, hybrid, box_from_clip, shot.shape_hw, shot.step_mm)
        seen = float((picture[..., 3] > 0.0).mean())
        return picture, Taken(renderer.level.index, renderer.name, str(renderer.driver), seen)


def take(package_path: Path, shot: Shot, picture_path: Path) -> Taken:
    """Draw a package to a PNG file. Raises what `draw` raises, and VP5021 where the file cannot be written."""
    if picture_path.suffix.lower() != ".png":
        raise VolprepError("VP5021", path=picture_path, error="pictures are PNG files, so that its name ends in .png")
    require_place(picture_path, "VP5021")
    picture, taken = draw(package_path, shot)
    write_file(picture_path, png_bytes(encoded(picture, shot.background)), "VP5021")
    return taken


def _camera(manifest: Manifest, shot: Shot) -> Camera:
    grid = manifest.levels[0].grid
    projection = manifest.render.projection if manifest.render else "orthographic"
    if shot.eye_mm_xyz is not None:
        return view_from(grid, shot.eye_mm_xyz, projection)
    views = standard_views(grid, projection)
    if shot.view not in views:
        raise VolprepError("VP5022", name=shot.view, known=", ".join(views))
    return views[shot.view]
