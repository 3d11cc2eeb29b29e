"""Error against run time: one oblique view, drawn with several steps at every level.

The view is oblique because rays along an axis meet the voxels in step, which can make a step look better or worse than
it is. The quadrature error is that of a float target, rays running to their end, against the oracle with the lookup
table as transfer function: it excludes data, table, early termination, and the 8 bits of the target, so its order is
visible.

The finest level is drawn in a 16th of the report's pixels, coarse levels in a quarter: every fourth or every second
row and column, whose truth the report's own picture has. Only the errors of the nominal step, which the verdict judges,
come from the whole picture.
"""

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass

from volprep.render.renderer import Renderer
from volprep.render.renderers import ray_caster_of
from volprep.render.turns import CERTAIN_TURNS, turns_of_rays
from volprep.validation.bench import Bench
from volprep.validation.comparison.precise_target import finite, most_precise
from volprep.validation.comparison.views import ViewedProgram
from volprep.validation.results.measurements import Breakdown, LevelFloor, Sweep, SweepPoint, Target, WayName
from volprep.validation.subjects.subject import Subject, as_sparse, errors
from volprep.validation.timing.full_rays import uncut
from volprep.validation.timing.order import OrderFacts, convergence
from volprep.validation.timing.rays import chords_mm, samples
from volprep.validation.timing.turns import Milliseconds, in_turns
from volprep_formats.arrays import Float32Array, Float64Array
from volprep_formats.package.program import PictureProgram
from volprep_formats.package.reader import Package

SWEEP_VIEW = "anterior-left"
"""Oblique to all axes of a patient."""
_RATIOS = (16.0, 8.0, 4.0, 2.0, 1.0, 0.5, 0.25, 0.125)
"""Steps over the nominal step of the level."""
_FINEST_LEVEL_STEPS = 6
_COARSE_RATIOS = (2.0, 1.0, 0.5)
"""A coarse level is chosen to be cheap: much finer steps than its nominal one are of no use there."""
_LEAST_RATIO = 0.5
_LONG_MS = 100.0
"""Steps finer than half of the nominal one are not timed where one draw takes this long: they are too slow to use."""
_SLOW_MS = 3.0
"""Timed pictures have a quarter, a 16th or a 64th of the pixels if a nominal draw in them still takes longer than this.
A driver that draws with the processor takes 2.5 to 4 times as long for four times the pixels: with 10 ms in place of 3,
timing took a quarter of the validation of 8³ voxels. A GPU takes less, and would be timed at its overhead."""
_LEAST_TIMED = 32
"""Width and height below which pictures are not made smaller for timing."""

TimedStep = tuple[int, float]
"""Level, and step over the nominal one."""


@dataclass(frozen=True)
class _Precise:
    """Pictures of the finest level in a float target."""

    target: Target
    uncut: list[Float32Array]
    """For each step: rays run to their end."""
    nominal: Float32Array
    """The nominal step, as the package draws it."""
    in_8_bits: Float32Array
    """The same in the target of the report."""


class _Sweeper:
    """Draws one program in the view of the sweep."""

    def __init__(self, bench: Bench, program: PictureProgram, viewed: ViewedProgram) -> None:
        subject = bench.subject
        self._subject = subject
        self.small, self.smallest = subject.small, subject.smallest
        """The same in fewer pixels, for coarse levels and for the finest."""
        self._program = program
        self._finest = viewed.level
        self._nominal = next((view for view in viewed.views if view.view == SWEEP_VIEW), None)
        self._clock = bench.clock
        self._progress = bench.progress
        self._box_from_clip = subject.views[SWEEP_VIEW]
        self._chords = chords_mm(self._box_from_clip, subject.shape_hw, subject.grid)

    def ratios(self, level: int) -> tuple[float, ...]:
        """Return the six finest steps that shader and driver can draw, as multiples of the nominal one."""
        manifest = self._subject.package.manifest
        step_mm = self._renderer(self._subject.package, level, "rgba8").nominal_mm
        least = self._program.step_mm_min or 0.0
        possible = tuple(ratio for ratio in _RATIOS if ratio * step_mm >= least)
        if turns_of_rays(manifest, self._program, level, possible[-1] * step_mm) > CERTAIN_TURNS:
            with self._renderer(self._subject.package, level, "rgba8") as renderer:
                possible = tuple(ratio for ratio in possible if renderer.draws_step(ratio * step_mm))
        return possible[-_FINEST_LEVEL_STEPS:]

    def draw(self, renderer: Renderer, ratio: float, subject: Subject) -> Float32Array:
        """Draw the rays of `subject` with a multiple of the nominal step of the level."""
        step_mm = ratio * renderer.nominal_mm
        with self._clock.part("drawing"):
            return renderer.render(*subject.rays(SWEEP_VIEW), step_mm)

    def precise(self, level: int, ratios: tuple[float, ...]) -> _Precise | None:
        """Draw into the most precise target that the driver has; None if it has 8 bits only."""
        drawn = self._renderer(self._subject.package, level, "rgba8").program
        package = uncut(self._subject.package, drawn)
        found = None
        if package is not None:
            found = most_precise(lambda target: self._precise(package, level, ratios, target))
        if found is None:
            self._progress.advance(len(ratios))
        return found

    def _precise(self, package: Package, level: int, ratios: tuple[float, ...], target: Target) -> _Precise:
        pictures = []
        with self._renderer(package, level, target) as renderer:
            for ratio in ratios:
                pictures.append(finite(self.draw(renderer, ratio, self.smallest), renderer.program.name, target))
                self._progress.advance()
        with self._renderer(self._subject.package, level, target) as renderer:
            nominal = finite(self.draw(renderer, 1.0, self.smallest), renderer.program.name, target)
        with self._renderer(self._subject.package, level, "rgba8") as renderer:
            in_8_bits = self.draw(renderer, 1.0, self.smallest)
        return _Precise(target, pictures, nominal, in_8_bits)

    def times(
        self, steps: Sequence[TimedStep], others: Mapping[WayName, Renderer]
    ) -> tuple[int, dict[TimedStep, Milliseconds], dict[WayName, Milliseconds]]:
        """Time steps of levels, and the nominal step of `others`, all in turns; leave out steps that take too long.

        Return the width and height of the pictures first.
        """
        with ExitStack() as stack, self._clock.part("timing"):
            levels = {level for level, _ in steps}
            opened = {level: self._open(stack, level) for level in levels}
            shape_hw = self._timed_hw(opened[min(levels)])
            draws: dict[TimedStep | WayName, Callable[[], float]] = {
                (level, ratio): self._draw_ms(opened[level], shape_hw, ratio * opened[level].nominal_mm)
                for level, ratio in steps
            }
            draws |= {name: self._draw_ms(renderer, shape_hw, None) for name, renderer in others.items()}
            # The first draw of each is not counted: it compiles, and pages in.
            first = {key: draw() for key, draw in draws.items()}
            long = {
                key for key, ms in first.items() if ms > _LONG_MS and isinstance(key, tuple) and key[1] < _LEAST_RATIO
            }
            found = in_turns({key: draw for key, draw in draws.items() if key not in long})
        of_steps = {key: time for key, time in found.items() if isinstance(key, tuple)}
        return shape_hw[0], of_steps, {key: time for key, time in found.items() if not isinstance(key, tuple)}

    def _timed_hw(self, finest: Renderer) -> tuple[int, int]:
        """Return the size of pictures to time: that of the report, or a smaller one for a slow driver."""
        _, (pixels, _) = self.small.rays(SWEEP_VIEW)
        for size in dict.fromkeys(max(-(-pixels // part), min(pixels, _LEAST_TIMED)) for part in (4, 2, 1)):
            shape_hw = (size, size)
            # The first draw is not counted: it compiles, and pages in.
            if finest.time_ms(self._box_from_clip, shape_hw, repeats=1) > _SLOW_MS:
                return shape_hw
        return self._subject.shape_hw

    def _open(self, stack: ExitStack, level: int) -> Renderer:
        return stack.enter_context(self._renderer(self._subject.package, level, "rgba8"))

    def _draw_ms(self, renderer: Renderer, shape_hw: tuple[int, int], step_mm: float | None) -> Callable[[], float]:
        camera = self._box_from_clip
        return lambda: renderer.time_ms(camera, shape_hw, step_mm, repeats=1, warm=False)

    def points(
        self,
        level: int,
        ratios: tuple[float, ...],
        on_data: Float64Array,
        truth: Float64Array,
        times: Mapping[TimedStep, Milliseconds],
    ) -> list[SweepPoint]:
        """Draw one level with every step in the few pixels that the oracle has drawn."""
        with self._renderer(self._subject.package, level, "rgba8") as renderer:
            return [self._point(renderer, ratio, on_data, truth, times.get((level, ratio))) for ratio in ratios]

    def _renderer(self, package: Package, level: int, target: Target) -> Renderer:
        transfer = self._program.transfer
        return ray_caster_of(package, level, transfer)(package, level=level, transfer=transfer, target=target)

    def _point(
        self, renderer: Renderer, ratio: float, on_data: Float64Array, truth: Float64Array, draw: Milliseconds | None
    ) -> SweepPoint:
        level = renderer.level.index
        step_mm = ratio * renderer.nominal_mm
        counts = samples(self._chords, step_mm)
        known = self._nominal if (level, ratio) == (self._finest, 1.0) else None
        if known is None:
            picture = self.draw(renderer, ratio, self.smallest if level == self._finest else self.small)
            with self._clock.part("comparing"):
                total, drawing = errors(picture, truth), errors(picture, on_data)
        else:
            total, drawing = known.total, known.drawing
        self._progress.advance()
        return SweepPoint(
            level=level,
            step_mm=step_mm,
            step_ratio=ratio,
            # A picture may have so few pixels that no ray meets a thin volume.
            samples_mean=float(counts[counts > 0].mean()) if counts.any() else 0.0,
            samples_max=int(counts.max()),
            draw=draw,
            total=total,
            drawing=drawing,
        )

    def floor(self, level: int, on_data: Float64Array, truth: Float64Array) -> LevelFloor:
        """Return the smallest error that one level can reach."""
        manifest = self._subject.package.manifest
        sizes = {record.path: record.size_bytes for record in manifest.files}
        return LevelFloor(
            level=level,
            shape_zyx=manifest.level(level).grid.shape_zyx,
            texture_bytes=sum(sizes[texture.file] for texture in manifest.textures_of(level=level)),
            data=errors(on_data, truth),
        )


def measure_sweep(
    bench: Bench, program: PictureProgram, viewed: ViewedProgram, others: Mapping[WayName, Renderer]
) -> tuple[Sweep, dict[WayName, Milliseconds]]:
    """Measure error and time of each step at each level that `program`, or its like for coarser levels, draws.

    `others` are timed in the same turns, with their nominal steps; their times are returned, too.
    """
    subject, clock = bench.subject, bench.clock
    finest, *coarser = subject.levels(program)
    sweeper = _Sweeper(bench, program, viewed)
    ratios = sweeper.ratios(finest)
    steps = 2 * len(ratios) + len(_COARSE_RATIOS) * len(coarser)
    bench.progress.start(f"error against time, {program.name}", steps)
    small, smallest = sweeper.small, sweeper.smallest
    truth, on_data = (smallest.of_its_rays(picture.rgba) for picture in (viewed.truth, viewed.on_data))
    with clock.part("oracle"):
        on_table = smallest.on_table(program.transfer, SWEEP_VIEW, finest).rgba
    precise = sweeper.precise(finest, ratios)
    timed = [(finest, ratio) for ratio in ratios] + [(level, ratio) for level in coarser for ratio in _COARSE_RATIOS]
    timed_size, times, of_others = sweeper.times(timed, others)
    points = sweeper.points(finest, ratios, on_data, truth, times)
    if precise is not None:
        points = [
            point.model_copy(update={"quadrature": errors(picture, on_table)})
            for point, picture in zip(points, precise.uncut, strict=True)
        ]
    floors = [sweeper.floor(finest, viewed.on_data.rgba, as_sparse(viewed.truth.rgba, len(viewed.on_data.rgba)))]
    nominal = ratios.index(1.0)
    breakdown = Breakdown(
        data=floors[0].data,
        table=errors(on_table, on_data),
        quadrature=points[nominal].quadrature,
        termination=errors(precise.nominal, precise.uncut[nominal]) if precise else None,
        target=errors(precise.in_8_bits, precise.nominal) if precise else None,
    )
    order = convergence(
        [point.step_mm for point in points],
        [point.quadrature.rmse for point in points if point.quadrature is not None],
        precise.target if precise else None,
        _order_facts(subject, program),
    )
    small_truth = small.of_its_rays(viewed.truth.rgba)
    for level in coarser:
        with clock.part("oracle"):
            on_data = small.drafted.on_data(program.transfer, SWEEP_VIEW, level).rgba
        points += sweeper.points(level, _COARSE_RATIOS, on_data, small_truth, times)
        floors.append(sweeper.floor(level, on_data, small_truth))
    sweep = Sweep(
        view=SWEEP_VIEW,
        timed_size=timed_size,
        float_target=precise.target if precise else None,
        points=tuple(points),
        floors=tuple(floors),
        breakdown=breakdown,
        convergence=order,
    )
    return sweep, of_others


def _order_facts(subject: Subject, program: PictureProgram) -> OrderFacts:
    return OrderFacts(
        technique=program.technique,
        compositing=program.compositing,
        classification=program.classification,
        lighting=program.lighting,
        labels=subject.scan.nearest,
        borders=subject.has_jumps_at_borders,
        functions=subject.functions(program.transfer),
    )


def nominal_time(sweep: Sweep, level: int) -> Milliseconds:
    """Return the times of the nominal step at a level."""
    return next(
        point.draw
        for point in sweep.points
        if (point.level, point.step_ratio) == (level, 1.0) and point.draw is not None
    )
