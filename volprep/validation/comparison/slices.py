"""Validate a package of slices: its views against the oracle, and its only point of error against run time.

Slices have no step, no lookup table and no float target, so there is nothing to sweep: the error comes from classifying
before the filter, from the number of slices, from the angle and from 8 bits. The first two are separated from the
others by compositing the texels in double precision.
"""

from dataclasses import dataclass

from volprep.render.slices import SliceRenderer
from volprep.truth.stacks import stack_picture
from volprep.validation.bench import Bench
from volprep.validation.comparison.edits_and_cuts import judge_edited_slices
from volprep.validation.comparison.views import (
    MeasuredPrograms,
    Statement,
    ViewedProgram,
    draw_differences,
    measure_views,
)
from volprep.validation.results.measurements import Breakdown, Convergence, LevelFloor, ProgramResult, Sweep, SweepPoint
from volprep.validation.subjects.subject import as_sparse, errors
from volprep.validation.timing.rays import chords_mm, samples
from volprep.validation.timing.sweep import SWEEP_VIEW
from volprep.validation.timing.turns import in_turns
from volprep_formats.package.parts.slices.texels import slice_texels

_LIMIT = "Slices are as far apart as voxels are: there is no step to refine."


@dataclass(frozen=True)
class Stacks:
    """The stacks of slices of one transfer function, with the attributes of a program that they share."""

    transfer: str
    """Name of the transfer function."""
    levels: tuple[int, ...]
    """The level that they hold."""
    technique: str = "slices"
    """Technique that draws them."""

    @property
    def name(self) -> str:
        """Name in the report, and in the names of pictures."""
        return f"slices-{self.transfer}"


def measure_slices(bench: Bench) -> MeasuredPrograms:
    """Measure the slices of all transfer functions.

    Raises the errors of `SliceRenderer`.
    """
    manifest = bench.subject.package.manifest
    levels = tuple(level.index for level in manifest.levels)
    each = [Stacks(function.name, levels) for function in manifest.transfer_functions]
    viewed = [measure_views(bench, stacks, SWEEP_VIEW) for stacks in each]
    gain = draw_differences(viewed, bench.folder)
    results = tuple(
        ProgramResult(
            program=stacks.name,
            technique=stacks.technique,
            transfer=stacks.transfer,
            level=views.level,
            views=views.views,
            sweep=_sweep(bench, stacks, views),
            others=tuple(judge_edited_slices(bench, stacks.transfer, stacks.name)),
        )
        for stacks, views in zip(each, viewed, strict=True)
    )
    statements = tuple(Statement(bench, stacks, views) for stacks, views in zip(each, viewed, strict=True))
    return MeasuredPrograms(results, gain, viewed[0].driver, statements)


def _sweep(bench: Bench, stacks: Stacks, viewed: ViewedProgram) -> Sweep:
    subject = bench.subject
    box_from_clip = subject.views[SWEEP_VIEW]
    truth, on_data = viewed.truth.rgba, viewed.on_data.rgba
    with SliceRenderer(subject.package, transfer=stacks.transfer) as renderer, bench.clock.part("timing"):
        picture = renderer.render(box_from_clip, subject.shape_hw)
        times = in_turns({"nominal": lambda: renderer.time_ms(box_from_clip, subject.shape_hw, repeats=1)})
        step_mm = renderer.distance_mm(box_from_clip)
        (axis, _), factor = renderer.facing(box_from_clip), renderer.factor(box_from_clip)
        level, layers = renderer.level, renderer.layers(axis)
    with bench.clock.part("oracle"):
        texels = slice_texels(subject.package, stacks.transfer, axis)
        of_paths, of_factor = (
            stack_picture(texels, axis, level.grid, box_from_clip, subject.shape_hw, longer, layers)
            for longer in ("exact", factor)
        )
    counts = samples(chords_mm(box_from_clip, subject.shape_hw, subject.grid), step_mm)
    data = errors(on_data, as_sparse(truth, len(on_data)))
    point = SweepPoint(
        level=level.index,
        step_mm=step_mm,
        step_ratio=1.0,
        samples_mean=float(counts[counts > 0].mean()),
        samples_max=int(counts.max()),
        draw=times["nominal"],
        total=errors(picture, truth),
        drawing=errors(as_sparse(picture, len(on_data)), on_data),
    )
    sizes = {record.path: record.size_bytes for record in subject.package.manifest.files}
    textures = [texture for texture in subject.package.manifest.textures if texture.transfer == stacks.transfer]
    floor = LevelFloor(
        level=level.index,
        shape_zyx=level.grid.shape_zyx,
        texture_bytes=sum(sizes[texture.file] for texture in textures),
        data=data,
    )
    return Sweep(
        view=SWEEP_VIEW,
        timed_size=subject.shape_hw[0],
        float_target=None,
        points=(point,),
        floors=(floor,),
        breakdown=Breakdown(
            data=data,
            table=errors(on_data, on_data),
            quadrature=None,
            termination=None,
            target=errors(picture, of_factor),
            texels=errors(of_paths, truth),
            angle=errors(of_factor, of_paths),
        ),
        convergence=Convergence(expected=2.0, slopes=(), observed=None, fitted_steps_mm=(), limits=(_LIMIT,)),
    )
