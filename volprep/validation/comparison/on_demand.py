"""Draw and judge bricks on demand: with all that the device holds, and with memory for fewer.

The standard views are a walk from all sides; one more goes in until the volume is four times as large, and one looks
from the middle of the volume. Each picture is one at rest, drawn from the bricks that its view, size and memory choose,
and compared with the truth. It may be off by the tolerance of the package and by the bound that the choice states for
the bricks that are missing: if the truth is farther away, the bound does not hold.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from volprep.render.on_demand.bricks import BrickFile
from volprep.render.on_demand.choice import choose
from volprep.render.on_demand.inputs import edit_of
from volprep.render.on_demand.rays import view_loss
from volprep.render.renderer import Renderer
from volprep.truth.camera import Camera, standard_views
from volprep.validation.bench import Bench
from volprep.validation.comparison.pixels import Picture, judged
from volprep.validation.comparison.seen import width_pixels
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.results.seen import OtherDrawing, OtherView
from volprep.validation.subjects.subject import Subject
from volprep_formats.arrays import Float64Array
from volprep_formats.package.manifest import Tolerance
from volprep_formats.package.program import PictureProgram

_SHARES = (1, 2, 6)
"""Parts of the bricks that fit into memory: all, a half, a sixth."""
_CLOSER = 4
"""How much larger the volume is in the near view."""
_NEAR, _INSIDE = "anterior-left, near", "anterior-left, from inside"


def judge_on_demand(bench: Bench, program: PictureProgram, viewed: ViewedProgram) -> Iterator[OtherDrawing]:
    """Compare pictures from bricks with the truth, if the picture is drawn from them."""
    subject, manifest = bench.subject, bench.subject.package.manifest
    picture = manifest.picture(program.transfer)
    if picture is None or picture.on_demand is None:
        return
    bricks = BrickFile.of(subject.package)
    stored = sum(int(value.sum()) for value in bricks.stored)
    views = {**subject.views, **_closer(subject)}
    truths = _truths(bench, program.transfer, viewed, views)
    bench.progress.start(f"bricks on demand of {program.transfer}", len(_SHARES))
    for share in _SHARES:
        places = min(stored // share, bricks.layout.places)
        found = [_view(bench, bricks, program, name, views[name], truths[name], places) for name in views]
        bounds = [bound for _, bound in found]
        yield OtherDrawing(
            item=f"bricks on demand, {places} of {stored}, with {program.transfer}: stated within "
            f"{min(bounds):.2g} to {max(bounds):.2g}",
            program=picture.on_demand.program,
            level=0,
            pixels=subject.shape_hw[0],
            views=tuple(view for view, _ in found),
            bound=max(bounds),
        )
        bench.progress.advance()


def _view(  # noqa: PLR0917 - a picture and its reference
    bench: Bench,
    bricks: BrickFile,
    program: PictureProgram,
    name: str,
    box_from_clip: Float64Array,
    truth: Picture,
    places: int,
) -> tuple[OtherView, float]:
    """Draw one view from so many bricks, and return the comparison and the stated bound."""
    subject = bench.subject
    chosen = choose(bricks, view_loss(bricks, box_from_clip, subject.shape_hw, one_ray=True), places, 0.0)
    edit = edit_of(bricks, chosen.held, program.transfer)
    with bench.clock.part("drawing"), Renderer(subject.package, transfer=program.transfer, edit=edit) as renderer:
        drawn = renderer.render(box_from_clip, subject.shape_hw)
    tolerance = subject.render.tolerance
    if chosen.bound > 0.0:
        tolerance = Tolerance(rmse=min(tolerance.rmse + chosen.bound, 1.0), maximum=1.0, flip=1.0, kept_light=0.0)
    width = width_pixels(subject.cameras.values(), subject.grid, subject.shape_hw[0])
    with bench.clock.part("comparing"):
        return judged(name, drawn, truth, tolerance, width), chosen.bound


def _closer(subject: Subject) -> Mapping[str, Float64Array]:
    """Return a view from near, and one from the middle of the volume."""
    camera = subject.cameras["anterior-left"]
    near = replace(camera, height_mm=camera.height_mm / _CLOSER)
    inside: Camera = standard_views(subject.grid, "perspective")["anterior-left"]
    matrix = inside.box_from_clip(subject.grid, 1.0)
    # Half of the depth of the view lies behind the middle of the volume: its near plane goes there.
    half = np.diag([1.0, 1.0, 0.5, 1.0])
    half[2, 3] = 0.5
    return {_NEAR: near.box_from_clip(subject.grid, 1.0), _INSIDE: matrix @ half}


def _truths(
    bench: Bench, transfer: str, viewed: ViewedProgram, views: Mapping[str, Float64Array]
) -> Mapping[str, Picture]:
    """Return the truth of each view; the scan's own box may be larger than that of the package."""
    subject = bench.subject
    found = dict(viewed.truths)
    moved = np.eye(4)
    moved[:3, 3] = _corner_mm(subject)
    with bench.clock.part("oracle"):
        for name in views.keys() - found.keys():
            truth = subject.through(subject.scan, transfer, moved @ views[name], subject.shape_hw)
            found[name] = truth.rgba.astype(np.float32)
    return found


def _corner_mm(subject: Subject) -> Float64Array:
    """Return the corner of the package's box in the scan's, x, y, z in millimetres."""
    world: Float64Array = np.asarray(subject.grid.corner_mm_xyz) - np.asarray(subject.scan.grid.corner_mm_xyz)
    found: Float64Array = np.asarray(subject.grid.direction).T @ world
    return found
