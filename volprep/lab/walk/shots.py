"""One picture of a walk, and its truth: the oracle on the texels and the table that are drawn.

So the drawing itself is judged: of a level, of the sub-volumes around a point, or of a box that was cut. Whether these
are right for the scan, validation says.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from volprep.lab.walk.truth import shown_of_cut, shown_of_level
from volprep.lab.walk.walker import Ground, Walker, drawn_level
from volprep.parts.editing.inputs import FunctionEdit, edited_inputs
from volprep.parts.subvolumes.cut_inputs import inputs_of_cut
from volprep.render.block_inputs import block_inputs
from volprep.render.box_lines import box_lines, mark_lines
from volprep.render.cut import Cut, cut_box
from volprep.render.inputs import Edit, Inputs, level_inputs
from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.scene.walk import ShownValues
from volprep.truth.decoded import table_function
from volprep.truth.oracle import OraclePicture
from volprep.truth.part import picture_of_part
from volprep_formats.arrays import Float32Array
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid
from volprep_formats.package.manifest import RenderSettings
from volprep_formats.package.parts.subvolumes.places import ends_mm, sides_of, voxels_of
from volprep_formats.package.parts.subvolumes.record import decode_grid
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction

_MARK = (1.0, 0.1, 0.02)
"""Linear light, of the lines around a box."""


@dataclass(frozen=True)
class WalkScene:
    """Settings that stay the same during a walk."""

    package: Package
    """The package."""
    render: RenderSettings
    """How it wants to be drawn."""
    program: PictureProgram
    """The program of its sub-volumes."""
    ground: Ground
    """The package, the pieces or the cut that the walk leads through."""

    @property
    def shape_hw(self) -> tuple[int, int]:
        """Height and width of the pictures."""
        return self.ground.pixels, self.ground.pixels


@dataclass(frozen=True)
class WalkShot:
    """A picture, and how far it is from the truth."""

    picture: Float32Array
    """[H, W, 4], premultiplied linear, with lines if it has some."""
    shown: str
    """Description of the picture."""
    level: int
    """Level."""
    voxel_pixels: float
    """Shortest side of a voxel in pixels."""
    program: str
    """The renderer."""
    driver: str
    """Where."""
    rmse: float
    """Difference from the truth."""
    maximum: float
    """Largest difference."""
    truth_bound: float
    """Largest error of the truth."""


def walk_scene(package: Package, transfer: str | None, pixels: int) -> WalkScene:
    """Return the volume that a walk leads through.

    Raises VP4050 and VP5018 for a package that has no such walk.
    """
    manifest = package.manifest
    files, level_grid, render = manifest.subvolumes, manifest.grid, manifest.render
    if files is None or level_grid is None or render is None:
        raise VolprepError("VP4050", path=package.path)
    program = block_inputs(package, 0, transfer or manifest.pictures[0].name).program
    ground = Ground(
        grid=decode_grid(package.read_bytes(files.grid), package.path, files.grid),
        level_grid=level_grid,
        voxel_mm={0: min(level_grid.spacing_mm_zyx), **_voxels_mm(package, coarser=True)},
        projection=render.projection,
        pixels=pixels,
    )
    return WalkScene(package, render, program, ground)


def level_shot(scene: WalkScene, walker: Walker, values: ShownValues) -> WalkShot:
    """Draw a whole level."""
    assert walker.level is not None  # noqa: S101 - after a step there is a level
    return _whole(scene, walker, values, walker.level, walker.zoom, None)


def place_shot(scene: WalkScene, walker: Walker, values: ShownValues, found: Cut) -> WalkShot:
    """Draw the volume as large as the picture, in the level that fits, with the lines of its box and of a cut."""
    ground = scene.ground
    held = _voxels_mm(scene.package, coarser=False)
    level = drawn_level(held, ground.grid.view, ground.pixel_mm(1.0), None)
    return _whole(scene, walker, values, level, 1.0, found)


def block_shot(scene: WalkScene, walker: Walker, values: ShownValues) -> WalkShot:
    """Draw the sub-volumes around a point."""
    assert walker.point is not None  # noqa: S101 - there is a point
    ground, point = scene.ground, walker.point
    camera = walker.camera(walker.looks_at, ground.diagonal_mm / walker.zoom)
    sides = sides_of(ground.grid, point)
    z, y, x = (slice(*ends) for ends in zip(*voxels_of(sides), strict=True))
    shown = shown_of_cut(scene.package, scene.program, cut_box(scene.package, (z, y, x)))
    volume = shown.volume
    inputs = block_inputs(scene.package, point, scene.program.transfer)
    edit, functions = _edited(scene, values, inputs)
    truth = picture_of_part(
        shown.drawn_with(functions),
        shown.joined,
        camera.box_from_clip(volume.grid, 1.0),
        scene.shape_hw,
        ends_mm(sides, volume.grid.spacing_mm_zyx),
    )
    with Renderer(scene.package, point=point, transfer=scene.program.transfer, edit=edit) as renderer:
        drawn = renderer.render(camera.box_from_clip(_box(scene), 1.0), scene.shape_hw)
        pixel_mm = ground.pixel_mm(walker.zoom)
        return _shot(renderer, drawn, drawn, truth, f"sub-volumes around point {point}", pixel_mm)


def cut_shot(scene: WalkScene, walker: Walker, values: ShownValues, found: Cut) -> WalkShot:
    """Draw a box of the full resolution as large as the picture, with the program of sub-volumes."""
    record = found.record
    middle = tuple((a + b - 1) / 2 for a, b in zip(record.start_zyx[::-1], record.stop_zyx[::-1], strict=True))
    field_mm = float(np.linalg.norm(record.grid.extent_mm_zyx))
    camera = walker.camera((middle[0], middle[1], middle[2]), field_mm)
    edit, functions = _edited(scene, values, block_inputs(scene.package, 0, scene.program.transfer))
    shown = shown_of_cut(scene.package, scene.program, found)
    matrix = camera.box_from_clip(record.grid, 1.0)
    truth = shown.drawn_with(functions)(shown.joined, matrix, scene.shape_hw)
    both = _one_after_the_other(inputs_of_cut(found), edit)
    with Renderer(scene.package, point=0, transfer=scene.program.transfer, edit=both) as renderer:
        drawn = renderer.render(camera.box_from_clip(_box(scene), 1.0), scene.shape_hw)
        return _shot(renderer, drawn, drawn, truth, "a box of level 0", field_mm / scene.ground.pixels)


def _whole(  # noqa: PLR0917 - subject, source, view and size
    scene: WalkScene, walker: Walker, values: ShownValues, level: int, zoom: float, marked: Cut | None
) -> WalkShot:
    package, transfer = scene.package, scene.program.transfer
    pixel_mm = scene.ground.pixel_mm(zoom)
    camera = walker.camera(scene.ground.middle, scene.ground.diagonal_mm / zoom)
    shown = shown_of_level(package, scene.program, level)
    grid = shown.volume.grid
    edit, functions = _edited(scene, values, level_inputs(package, level, transfer))
    truth = shown.drawn_with(functions)(shown.joined, camera.box_from_clip(grid, 1.0), scene.shape_hw)
    with _renderer(package, level, transfer, edit) as renderer:
        matrix = camera.box_from_clip(_box(scene), 1.0)
        drawn = renderer.render(matrix, scene.shape_hw)
        if marked is None:
            return _shot(renderer, drawn, drawn, truth, f"level {level}", pixel_mm)
        extent_mm = np.array(_box(scene).extent_mm_zyx[::-1])
        spacing_mm = np.array(marked.record.grid.spacing_mm_zyx[::-1])
        low, high = (np.array(at[::-1]) * spacing_mm for at in (marked.record.start_zyx, marked.record.stop_zyx))
        lines = [box_lines(matrix, extent_mm), mark_lines(matrix, low, high, _MARK)]
        picture = renderer.render_with_lines(matrix, scene.shape_hw, scene.shape_hw, lines)
        return _shot(renderer, picture, drawn, truth, f"the place of a box in level {level}", pixel_mm)


def _renderer(package: Package, level: int, transfer: str, edit: Edit | None) -> Renderer:
    if edit is not None:
        return Renderer(package, level=level, transfer=transfer, edit=edit)
    return ray_caster_of(package, level, transfer)(package, level=level, transfer=transfer)


def _shot(  # noqa: PLR0917 - a picture, its truth, and its description
    renderer: Renderer, picture: Float32Array, drawn: Float32Array, truth: OraclePicture, shown: str, pixel_mm: float
) -> WalkShot:
    difference = drawn.astype(np.float64) - truth.rgba
    return WalkShot(
        picture=picture,
        shown=shown,
        level=renderer.level.index,
        voxel_pixels=min(renderer.level.grid.spacing_mm_zyx) / pixel_mm,
        program=renderer.name,
        driver=str(renderer.driver),
        rmse=float(np.sqrt(np.mean(difference**2))),
        maximum=float(np.abs(difference).max()),
        truth_bound=float(truth.bound.max()),
    )


def _edited(scene: WalkScene, values: ShownValues, inputs: Inputs) -> tuple[Edit | None, dict[str, TransferFunction]]:
    """Return what an app does to show only some values, and the transfer functions that are drawn then, by name.

    Raises VP4053 for some values of a scan with segments.
    """
    package, transfer, level = scene.package, scene.program.transfer, inputs.level.index
    picture = package.manifest.picture(transfer)
    names = [medium.transfer for medium in picture.media] if picture else []
    if values.is_plain:
        return None, {name: _drawn_function(package, inputs, name) for name in names}
    if names != [transfer]:
        raise VolprepError("VP4053", path=package.path)
    function = package.manifest.function(transfer)
    wanted = values.of(function)
    texels = edited_inputs(package, inputs, wanted).texels
    return FunctionEdit(wanted), {transfer: table_function(package, transfer, level, texels)}


def _drawn_function(package: Package, inputs: Inputs, name: str) -> TransferFunction:
    """Return the transfer function as the program reads it, from its table or from the control points."""
    if inputs.program.classification == "control-points":
        return package.manifest.function(name)
    return table_function(package, name, inputs.level.index)


def _one_after_the_other(first: Edit, then: Edit | None) -> Edit:
    if then is None:
        return first
    second: Callable[[Package, Inputs], Inputs] = then
    return lambda package, inputs: second(package, first(package, inputs))


def _box(scene: WalkScene) -> Grid:
    return scene.package.manifest.levels[0].grid


def _voxels_mm(package: Package, *, coarser: bool) -> dict[int, float]:
    """Return the shortest side of a voxel of each level that the package holds."""
    levels = package.manifest.levels
    return {level.index: min(level.grid.spacing_mm_zyx) for level in levels if level.index or not coarser}
