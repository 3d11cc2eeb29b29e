"""One picture of a package, from the choice of a camera to the file."""

from dataclasses import dataclass
from pathlib import Path

from volprep.parts.editing.inputs import FunctionEdit
from volprep.pipeline.framing import filled
from volprep.render.hybrid import HybridWish, hybrid_picture
from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import choose
from volprep.render.on_demand.inputs import from_bricks
from volprep.render.on_demand.rays import view_loss
from volprep.render.renderer import Renderer
from volprep.render.renderers import renderer_of
from volprep.render.slices import SliceRenderer
from volprep.scene.request import load_edit
from volprep.truth.camera import Camera, standard_views, view_from, widest_view
from volprep.truth.picture import Background, encoded
from volprep_formats.arrays import Float64Array, FloatArray
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Vector
from volprep_formats.output import write_file
from volprep_formats.package.channel_packages import package_of_transfer
from volprep_formats.package.manifest import Manifest
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes, require_png_place


@dataclass(frozen=True)
class Shot:
    """Settings of a picture."""

    view: str | None
    """Name of a standard view; used if there is no eye. If absent, the one that shows most of the volume."""
    eye_mm_xyz: Vector | None
    """Where to look from, in the patient's space (LPS)."""
    shape_hw: tuple[int, int]
    """Height and width in pixels."""
    background: Background
    """Background behind the volume."""
    level: int | None
    """Level to draw; the finest if absent."""
    point: int | None
    """Point of the grid whose sub-volumes are drawn, in place of a level."""
    transfer: str | None
    """Transfer function to draw with; the first if absent."""
    step_mm: float | None
    """Distance of the samples; the package's own if absent."""
    frame: int = 0
    """Frame of a time series."""
    edit: Path | None = None
    """File of a transfer function to draw in place of the package's."""
    fill: bool = False
    """Whether the visible part fills the picture; if not, all views show the volume in one size."""
    hybrid: HybridWish | None = None
    """Lines around the volume, and a smaller picture of it; the settings of the package if absent."""
    brick_bytes: int | None = None
    """Memory for bricks on demand. The picture is then drawn from these."""


@dataclass(frozen=True)
class Taken:
    """The picture that was drawn."""

    level: int
    """Level."""
    drawn_by: str
    """Program, or slices."""
    driver: str
    """Driver."""
    seen: float
    """Part of the pixels in which something is seen."""
    notes: tuple[str, ...] = ()
    """Missing bricks of a picture from bricks on demand, and the bound of the error that they make."""


def draw(package_path: Path, shot: Shot) -> tuple[FloatArray, Taken]:
    """Draw a package: a premultiplied linear picture [H, W, 4], and what drew it.

    Raises the errors of `Package.open`, `renderer_of`, `load_edit` and `hybrid_picture`, VP5020 and VP5022 for an
    impossible camera.
    """
    package = package_of_transfer(Package.open(package_path, frame=shot.frame), shot.transfer)
    grid = package.manifest.box
    height, width = shot.shape_hw
    camera = camera_of(package.manifest, shot)
    with renderer_for(package, shot) as renderer:
        box_from_clip = camera.box_from_clip(grid, width / max(height, 1))
        if shot.fill and min(shot.shape_hw) > 0:
            box_from_clip = filled(renderer, box_from_clip, shot.shape_hw)
        if shot.brick_bytes is not None:
            return _from_bricks(package, shot, shot.brick_bytes, box_from_clip)
        picture = rendered(renderer, package, shot, box_from_clip)
        return picture, taken_by(renderer, picture)


def take(package_path: Path, shot: Shot, picture_path: Path) -> Taken:
    """Draw a package to a PNG file. Raises the errors of `draw`, and VP5021 where the file cannot be written."""
    require_png_place(picture_path)
    picture, taken = draw(package_path, shot)
    write_file(picture_path, png_bytes(encoded(picture, shot.background)), "VP5021")
    return taken


def rendered(
    renderer: Renderer | SliceRenderer, package: Package, shot: Shot, box_from_clip: Float64Array
) -> FloatArray:
    """Draw with the lines and the smaller picture that the shot or its package asks for."""
    settings = package.manifest.render
    asked = None if settings is None else settings.hybrid
    hybrid = shot.hybrid or (None if asked is None else HybridWish.of_package(asked, shot.shape_hw))
    if hybrid is None:
        return renderer.render(box_from_clip, shot.shape_hw, shot.step_mm)
    return hybrid_picture(renderer, hybrid, box_from_clip, shot.shape_hw, shot.step_mm)


def taken_by(renderer: Renderer | SliceRenderer, picture: FloatArray) -> Taken:
    """Say what drew a picture, and how much of it."""
    seen = float((picture[..., 3] > 0.0).mean())
    return Taken(renderer.level.index, renderer.name, str(renderer.driver), seen)


def _from_bricks(
    package: Package, shot: Shot, most_bytes: int, box_from_clip: Float64Array
) -> tuple[FloatArray, Taken]:
    """Draw from the bricks that fit into a memory, those first whose loss is greatest."""
    bricks, damaged = BrickFile.of(package), list[VolprepError]()
    view = view_loss(bricks, box_from_clip, shot.shape_hw)
    chosen = choose(bricks, view, min(most_bytes // bricks.layout.brick_bytes, bricks.layout.places), 0.0)
    inputs = from_bricks(bricks, chosen.held, shot.transfer, damaged.append)
    with Renderer(package, transfer=shot.transfer, edit=lambda _package, _inputs: inputs) as renderer:
        picture = renderer.render(box_from_clip, shot.shape_hw, shot.step_mm)
        stored = sum(int(value.sum()) for value in bricks.stored)
        notes = f"within {chosen.bound:.2g} of the picture of all bricks: {chosen.bricks} of {stored} are held"
        seen = float((picture[..., 3] > 0.0).mean())
        driver = str(renderer.driver)
        return picture, Taken(0, renderer.name, driver, seen, (notes, *(str(brick) for brick in damaged)))


def renderer_for(package: Package, shot: Shot) -> Renderer | SliceRenderer:
    """Return the renderer of a picture. Raises the errors of `renderer_of` and `load_edit`."""
    edit = None if shot.edit is None else FunctionEdit(load_edit(shot.edit, package.manifest.levels[0].grid))
    return renderer_of(package, level=shot.level, transfer=shot.transfer, point=shot.point, edit=edit)


def camera_of(manifest: Manifest, shot: Shot) -> Camera:
    """Return the camera of a picture. Raises VP5020 and VP5022 for an impossible one."""
    grid = manifest.box
    projection = manifest.render.projection if manifest.render else "orthographic"
    if shot.eye_mm_xyz is not None:
        return view_from(grid, shot.eye_mm_xyz, projection)
    views = standard_views(grid, projection)
    name = shot.view or widest_view(grid)
    if name not in views:
        raise VolprepError("VP5022", name=name, known=", ".join(views))
    return views[name]
