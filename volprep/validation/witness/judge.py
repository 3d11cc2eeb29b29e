"""Whether VTK, which draws the scan with the same cameras and functions, agrees with the truth and with the package.

With its own code, VTK draws the data that volprep has read: voxels, their places, cameras and control points. Its
pictures have errors of their own, which are estimated from the pictures. For each channel of each pixel they are

- its steps, and its samples of the transfer function: the scan is drawn twice, with half the step and twice the
  samples. A rule of first order, which VTK's is where rays enter and where it looks for a maximum, is then wrong by
  what this changes; one of second order by a third of that. Twice the change is allowed, because for a few
  pixels the change may be smaller than on average.
- its target of 8 bits: half of 1/255.
- its rays, which end at an opacity of 254/255: where a pixel is as opaque as that, another 1/255.

The bound of a view is the root mean square of their sum. Single pixels may be further off: where a step meets a thin
structure, both steps may miss it by chance. So the largest difference is reported, not judged.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from volprep.truth.picture import encoded
from volprep.validation.comparison.colours import coloured, gain_for, largest_difference
from volprep.validation.comparison.views import Statement
from volprep.validation.folder import PICTURES
from volprep.validation.witness.records import NotWitnessed, Witness, WitnessedProgram, WitnessView
from volprep.validation.witness.vtk_views import MOST_VOXELS, Blend, VtkViews, draw_views
from volprep.vtk.process import has_pyvista
from volprep_formats.arrays import Float32Array, FloatArray
from volprep_formats.installation import how_to_add
from volprep_formats.package.program import LAID_OVER, CompositingName

_BLENDS: Mapping[CompositingName, Blend] = {"maximum": "maximum", **dict.fromkeys(LAID_OVER, "composite")}
_SAFETY = 2.0
_STEP_OF_TARGET = 1 / 255
_OPAQUE = 253.5 / 255
"""VTK's rays end above 254/255; half a step of the target below it they may have ended."""


def ask_witness(statements: Iterable[Statement], kept_view: str, scratch: Path) -> Witness:
    """Let VTK draw the programs that it can draw. `kept_view` is the view whose pictures are written.

    Without pyvista nothing is drawn, and that is named. Raises VP6041 if VTK cannot draw.
    """
    if not has_pyvista():
        absent = f"pyvista is not installed, which is in the extra witness: {how_to_add('witness')}"
        return Witness(renderer=None, driver=None, programs=(), missing=(NotWitnessed(item="VTK", reason=absent),))
    found: list[WitnessedProgram] = []
    missing: list[NotWitnessed] = []
    views: VtkViews | None = None
    for statement in statements:
        blend = _BLENDS.get(statement.bench.subject.compositing)
        reason = _why_not(statement)
        if blend is None or reason is not None:
            no_blend = f"VTK has no compositing {statement.bench.subject.compositing}"
            missing.append(NotWitnessed(item=statement.program.name, reason=reason or no_blend))
            continue
        subject, bench = statement.bench.subject, statement.bench
        bench.progress.start(f"VTK draws {statement.program.transfer}", 1)
        with bench.clock.part("witness"):
            function = subject.function(statement.program.transfer)
            cameras = [*subject.cameras.values()]
            views = draw_views(subject.scan, function, blend, cameras, pixels=subject.shape_hw[0], scratch=scratch)
        bench.progress.advance()
        found.append(_judged(statement, views, kept_view))
    return Witness(
        renderer=None if views is None else views.renderer,
        driver=None if views is None else views.driver,
        programs=tuple(found),
        missing=tuple(missing),
    )


def _why_not(asked: Statement) -> str | None:
    """Return why VTK cannot draw it as it should be; None if it can."""
    subject = asked.bench.subject
    if subject.is_of_several:
        return "VTK composites several volumes otherwise; each channel by itself is witnessed"
    if subject.has_baked_light(asked.program.transfer):
        return "its light was computed once, which VTK does not have; path tracing judges it"
    if subject.scan.normals is not None:
        return "it is lit, and VTK measures gradients and lights otherwise"
    if subject.scan.nearest:
        return "its voxels are labels, whose edges VTK's samples do not meet"
    voxels = subject.scan.stored.size
    if voxels > MOST_VOXELS:
        return f"the scan has {voxels} voxels, and VTK would hold all of them twice: {MOST_VOXELS} at most"
    return None


def _judged(asked: Statement, drawn: VtkViews, kept_view: str) -> WitnessedProgram:
    tolerance = asked.bench.subject.render.tolerance.rmse
    views = []
    for name, coarse, fine in zip(asked.viewed.truths, drawn.coarse, drawn.fine, strict=True):
        truth, ours = asked.viewed.truths[name], asked.viewed.drawn[name]
        views.append(compared(name, (coarse, fine), truth, ours, tolerance))
        if name == kept_view:
            picture = f"{PICTURES}/{asked.program.name}-witness.png"
            asked.bench.folder.picture(picture, _side_by_side((truth, ours, fine)))
    return WitnessedProgram(
        program=asked.program.name,
        transfer=asked.program.transfer,
        step_mm=drawn.step_mm,
        entries=drawn.entries,
        views=tuple(views),
        picture=picture,
    )


def compared(
    name: str, vtk: tuple[FloatArray, FloatArray], truth: FloatArray, ours: FloatArray, tolerance: float
) -> WitnessView:
    """Judge one view: VTK's coarse and fine pictures, the truth, and the package's; [H, W, 4] premultiplied linear."""
    coarse, fine = vtk
    steps = _SAFETY * np.abs(coarse.astype(np.float64) - fine)
    ended = np.where(fine[..., 3:] >= _OPAQUE, _STEP_OF_TARGET, 0.0)
    bound = _rms(steps + ended + _STEP_OF_TARGET / 2)
    difference = fine.astype(np.float64) - truth
    truth_rmse, drawn_rmse = _rms(difference), _rms(fine.astype(np.float64) - ours)
    return WitnessView(
        view=name,
        passed=truth_rmse <= bound and drawn_rmse <= bound + tolerance,
        truth_rmse=truth_rmse,
        truth_maximum=float(np.abs(difference).max()),
        drawn_rmse=drawn_rmse,
        bound=bound,
        step_part=_rms(steps),
    )


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _side_by_side(pictures: Sequence[Float32Array]) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    difference = largest_difference(pictures[-1], pictures[0])
    shown = [encoded(picture, "black") for picture in pictures]
    return np.concatenate([*shown, coloured(difference, gain_for(difference))], axis=1)
