"""The pictures of a walk through a package with sub-volumes, and how far each is from what the package holds."""

import json
from pathlib import Path

from volprep.lab.walk.shots import WalkScene, WalkShot, block_shot, cut_shot, level_shot, place_shot, walk_scene
from volprep.lab.walk.walker import Walker
from volprep.render.cut import Cut, cut
from volprep.scene.walk import ShownValues, WalkStep, load_walk
from volprep.truth.picture import encoded
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Vector
from volprep_formats.output import output_errors, require_place, taken, write_file
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.parts.subvolumes.places import local_of, overall_of, voxel_of
from volprep_formats.package.parts.subvolumes.record import Move, PointKind
from volprep_formats.package.program import CompositingName
from volprep_formats.package.reader import Package
from volprep_formats.png import png_bytes
from volprep_formats.progress import Progress
from volprep_formats.record import Record


class CutPlace(Record):
    """Where the middle of a box that was cut lies."""

    start_zyx: tuple[int, int, int]
    """First voxel of the box."""
    stop_zyx: tuple[int, int, int]
    """Voxel after the last one."""
    voxel_xyz: Vector
    """Voxel of level 0 in the middle."""
    piece: int
    """Number of the sub-volume that holds this voxel."""
    local_xyz: Vector
    """Its coordinates in the texture of the sub-volume."""
    overall_xyz: Vector | None = None
    """Its overall coordinates in the block that was shown before; absent if there was none."""


class WalkPicture(Record):
    """A picture of a walk."""

    file: str
    """PNG file."""
    shown: str
    """Description of the picture."""
    level: int
    """Level; 0 for sub-volumes and boxes."""
    point: int | None = None
    """Point of the grid around which there are sub-volumes; absent if none are shown."""
    kind: PointKind | None = None
    """Kind of this point."""
    asked: tuple[Move, ...] = ()
    """Moves that the step asked for."""
    made: tuple[Move, ...] = ()
    """Those that are legal at the point where it began, and were made."""
    zoom: float
    """How many times larger the volume is than where its diagonal fills the picture."""
    voxel_pixels: float
    """Shortest side of a voxel in pixels."""
    cut: CutPlace | None = None
    """The box that is shown or marked."""
    program: str
    """The renderer."""
    rmse: float
    """Root mean square difference from the oracle on what the package holds."""
    maximum: float
    """Largest difference."""
    truth_bound: float
    """No pixel of the oracle's picture is farther from the truth than this."""
    passed: bool
    """Whether both are within the scene's tolerance."""


class WalkReport(Record):
    """All pictures of a walk."""

    package: str
    """Name of the scene."""
    compositing: CompositingName
    """The compositing."""
    transfer: str
    """Transfer function."""
    size: int
    """Width and height of the pictures."""
    tolerance: Tolerance
    """Largest error of a picture."""
    driver: str
    """The OpenGL ES that drew."""
    pictures: tuple[WalkPicture, ...]
    """The pictures, in the order of the steps."""

    @property
    def failed(self) -> tuple[WalkPicture, ...]:
        """Pictures that are farther off than the tolerance."""
        return tuple(picture for picture in self.pictures if not picture.passed)


def walk(package_path: Path, walk_path: Path, folder: Path, progress: Progress, *, force: bool = False) -> WalkReport:
    """Draw a walk: walk-001.png, ... and walk.json in `folder`.

    Raises the errors of `load_walk` and `Package.open`, VP4050 for a package without sub-volumes, VP5018 for one that
    cannot draw them, VP5023 or VP4053 where values are chosen that a package cannot edit, VP3181 and VP5022 for a step
    that cannot be made, VP1251 or VP1254 where a name is taken and `force` is not given, VP4020 where nothing can
    be written.
    """
    wanted = load_walk(walk_path)
    scene = walk_scene(Package.open(package_path), wanted.transfer, wanted.size)
    names = [f"walk-{number:03}.png" for number in range(1, len(wanted.step) + 1)]
    _require_room(folder, [*names, "walk.json"], force=force)
    walker, values = Walker.at_the_front(scene.ground), ShownValues()
    box: tuple[Cut, CutPlace] | None = None
    pictures: list[WalkPicture] = []
    driver = ""
    progress.start("walk", len(names))
    for number, (name, step) in enumerate(zip(names, wanted.step, strict=True), start=1):
        values = _changed(values, step)
        if step.cuts:
            box = _cut(scene, walker, step)
        walker = walker.after(step, number)
        if step.show_of == "grid":
            shot, held = _on_the_grid(scene, walker, values), None
        elif box is None:
            raise VolprepError("VP3181", number=number, problem="it shows a box, and none was cut before")
        else:
            draw, held = (place_shot if step.show_of == "place" else cut_shot), box[1]
            shot = draw(scene, walker, values, box[0])
        write_file(folder / name, png_bytes(encoded(shot.picture, "black")))
        pictures.append(_record(scene, walker, name, shot, held))
        driver = shot.driver
        progress.advance()
    report = WalkReport(
        package=scene.package.manifest.name,
        compositing=scene.program.compositing,
        transfer=scene.program.transfer,
        size=wanted.size,
        tolerance=scene.render.tolerance,
        driver=driver,
        pictures=tuple(pictures),
    )
    text = json.dumps(report.model_dump(mode="json", exclude_none=True), indent=2, sort_keys=True)
    write_file(folder / "walk.json", (text + "\n").encode())
    return report


def _require_room(folder: Path, names: list[str], *, force: bool) -> None:
    for name in names:
        if (folder / name).exists() and not force:
            raise taken(folder / name)
    with output_errors(folder):
        folder.mkdir(parents=True, exist_ok=True)
    require_place(folder / names[-1])


def _changed(values: ShownValues, step: WalkStep) -> ShownValues:
    """Return which values are shown after a step."""
    named = {name: getattr(step, name) for name in ShownValues.model_fields}
    update = {name: value for name, value in named.items() if value is not None}
    return ShownValues.model_validate({**values.model_dump(), **update})


def _cut(scene: WalkScene, walker: Walker, step: WalkStep) -> tuple[Cut, CutPlace]:
    """Cut the box that a step names, around a voxel or a place of the volume shown before."""
    grid = scene.ground.grid
    overall = None
    if step.tap is None:
        assert step.cut is not None  # noqa: S101 - the step cuts
        voxel = step.cut
        if walker.point is not None:
            overall = overall_of(grid, walker.point, voxel)
    else:
        overall = step.tap
        voxel = _tapped(scene, walker, step.tap)
    found = cut(scene.package, voxel, step.cut_size)
    piece, local = local_of(grid, voxel)
    place = CutPlace(
        start_zyx=found.record.start_zyx,
        stop_zyx=found.record.stop_zyx,
        voxel_xyz=voxel,
        piece=piece,
        local_xyz=local,
        overall_xyz=overall,
    )
    return found, place


def _tapped(scene: WalkScene, walker: Walker, overall_xyz: Vector) -> Vector:
    if walker.point is not None:
        return voxel_of(scene.ground.grid, walker.point, overall_xyz)
    x, y, z = (at * n - 0.5 for at, n in zip(overall_xyz, scene.ground.level_grid.shape_zyx[::-1], strict=True))
    return x, y, z


def _on_the_grid(scene: WalkScene, walker: Walker, values: ShownValues) -> WalkShot:
    return level_shot(scene, walker, values) if walker.point is None else block_shot(scene, walker, values)


def _record(scene: WalkScene, walker: Walker, name: str, shot: WalkShot, held: CutPlace | None) -> WalkPicture:
    tolerance = scene.render.tolerance
    point = walker.point if held is None else None
    return WalkPicture(
        file=name,
        shown=shot.shown,
        level=shot.level,
        point=point,
        kind=None if point is None else scene.ground.grid.points[point].kind,
        asked=walker.asked,
        made=walker.made,
        zoom=walker.zoom,
        voxel_pixels=shot.voxel_pixels,
        cut=held,
        program=shot.program,
        rmse=shot.rmse,
        maximum=shot.maximum,
        truth_bound=shot.truth_bound,
        passed=shot.rmse <= tolerance.rmse and shot.maximum <= tolerance.maximum,
    )
