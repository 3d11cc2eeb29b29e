"""The nine standard views of one program: drawn, and compared with the truth."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from volprep.render.renderer import Renderer
from volprep.render.renderers import renderer_of
from volprep.render.slices import SliceRenderer
from volprep.truth.kept_light import small_things
from volprep.truth.oracle import DEFAULT_TOLERANCE, OraclePicture
from volprep.truth.picture import encoded
from volprep.validation.bench import Bench
from volprep.validation.comparison.colours import coloured, gain_for, largest_difference
from volprep.validation.comparison.seen import seen_numbers, width_pixels
from volprep.validation.folder import PICTURES, ReportFolder
from volprep.validation.results.measurements import Driver, ProgramResult, ViewPictures, ViewResult
from volprep.validation.subjects.subject import Subject, as_sparse, errors
from volprep.validation.verdicts.verdict import passes, share_of
from volprep_formats.arrays import Float32Array, FloatArray

_SURE = 0.75
"""Share of a limit up to which a drafted truth decides. Its bound is a hundredth of the usual tolerance of RMSE and a
2500th of that of the largest error, moves kept light by 0.005, a fiftieth of what may be lost, and moves at most a
pixel in 20 to another step of 8 bits, which FLIP sees."""

_Compared = tuple[ViewResult, Float32Array]
"""The result of a view, and the largest difference of each pixel."""


class Drawn(Protocol):
    """A program or its equivalent."""

    @property
    def name(self) -> str:
        """Its name."""

    @property
    def transfer(self) -> str:
        """Name of the transfer function that it draws."""

    @property
    def levels(self) -> tuple[int, ...]:
        """Levels that it draws."""


@dataclass(frozen=True)
class ViewedProgram:
    """The views of one program, and the results that the sweep reuses."""

    level: int
    """Finest level of the program, which was drawn."""
    views: tuple[ViewResult, ...]
    """Standard views."""
    differences: dict[str, Float32Array]
    """Largest difference of each pixel's channels by file name of the picture, not drawn yet: all share one gain."""
    truth: OraclePicture
    """Truth in the view of the sweep."""
    on_data: OraclePicture
    """Oracle on the package's data in the view of the sweep; it may have only every second row and column."""
    truths: dict[str, Float32Array]
    """Truth in each standard view, premultiplied linear."""
    drawn: dict[str, Float32Array]
    """Pictures of the package in each standard view."""
    driver: Driver
    """The OpenGL ES that drew."""


@dataclass(frozen=True)
class Statement:
    """Pictures of one transfer function, and their renderer."""

    bench: Bench
    """Its subject, and where results go."""
    program: Drawn
    """The program, or its equivalent, that draws it."""
    viewed: ViewedProgram
    """Its truths and its pictures."""


@dataclass(frozen=True)
class MeasuredPrograms:
    """All programs of a package."""

    programs: tuple[ProgramResult, ...]
    """Measurements of each view."""
    gain: float
    """Gain of the pictures of differences."""
    driver: Driver
    """The OpenGL ES that drew."""
    statements: tuple[Statement, ...]
    """The pictures of the finest level."""


def measure_views(bench: Bench, program: Drawn, kept_view: str) -> ViewedProgram:
    """Draw and compare all standard views with the nominal step at the finest level, and write their pictures.

    `kept_view` is the view whose oracle pictures are given back. In the other views the truth is drafted; where that
    does not decide, it is drawn again.
    """
    subject, clock = bench.subject, bench.clock
    level = min(program.levels)
    compared: dict[str, Future[_Compared]] = {}
    kept: dict[str, tuple[OraclePicture, OraclePicture]] = {}
    truths: dict[str, Float32Array] = {}
    pictures: dict[str, Float32Array] = {}
    grid = subject.package.manifest.level(level).grid
    width = width_pixels(subject.cameras.values(), grid, subject.shape_hw[0])

    def compare(name: str, asked: Subject) -> Future[_Compared]:
        with clock.part("oracle"):
            truth = asked.truth(program.transfer, name)
            apart = 2 if name == kept_view else 4
            on_data = asked.on_data_beside(truth, program.transfer, name, level, apart=apart)
        truths[name] = truth.rgba.astype(np.float32)
        if name == kept_view:
            kept[name] = truth, on_data
        if name not in pictures:
            with clock.part("drawing"):
                pictures[name] = renderer.render(subject.views[name], subject.shape_hw)
        # No more than the pictures of two views are in memory.
        for earlier in [*compared.values()][-1:]:
            earlier.result()
        given = _names(program, name), name, width, truth, on_data, pictures[name]
        return beside.submit(_compared, bench, *given)

    bench.progress.start(f"nine views of {program.name}", len(subject.views))
    renderer = renderer_of(subject.package, level=level, transfer=program.transfer)
    # Comparing and writing run in one thread and leave other processors idle: the next view is drawn at the same time.
    with renderer, ThreadPoolExecutor(1) as beside:
        for name in subject.views:
            compared[name] = compare(name, subject if name == kept_view else subject.drafted)
            bench.progress.advance()
        for name, (view, _) in {name: pending.result() for name, pending in compared.items()}.items():
            # A sharper truth could change the verdict of the view.
            if view.truth_bound > DEFAULT_TOLERANCE and share_of(view.seen, subject.render.tolerance) > _SURE:
                compared[name] = compare(name, subject)
        results = [pending.result() for pending in compared.values()]
        driver = driver_of(renderer)
    views = tuple(view for view, _ in results)
    differences = {view.pictures.difference: difference for view, difference in results}
    return ViewedProgram(level, views, differences, *kept[kept_view], truths, pictures, driver)


def _compared(  # noqa: PLR0917 - a view, and its known results
    bench: Bench,
    names: ViewPictures,
    view: str,
    width: float,
    truth: OraclePicture,
    on_data: OraclePicture,
    drawn: Float32Array,
) -> _Compared:
    """Compare the pictures of one view, and write them; return the difference of each pixel, too.

    `on_data` may have only some rows and columns.
    """
    truth_of_data, drawn_of_data = (as_sparse(value, len(on_data.rgba)) for value in (truth.rgba, drawn))
    with bench.clock.part("comparing"):
        seen = seen_numbers(drawn, truth.rgba, small_things(drawn, truth.rgba, width), is_of_target=True)
        total = errors(drawn, truth.rgba)
        result = ViewResult(
            view=view,
            passed=passes(seen, bench.subject.render.tolerance),
            total=total,
            seen=seen,
            data=errors(on_data.rgba, truth_of_data),
            drawing=total if np.array_equal(on_data.rgba, truth.rgba) else errors(drawn_of_data, on_data.rgba),
            truth_bound=max(float(truth.bound.max()), float(on_data.bound.max())),
            pictures=names,
        )
    _write_pictures(bench.folder, names, truth.rgba, drawn)
    return result, largest_difference(drawn, truth.rgba)


def driver_of(renderer: Renderer | SliceRenderer) -> Driver:
    """Return the renderer's description for reports."""
    driver = renderer.driver
    return Driver(vendor=driver.vendor, renderer=driver.renderer, version=driver.version)


def draw_differences(viewed: list[ViewedProgram], folder: ReportFolder) -> float:
    """Write the pictures of all differences with one gain, and return the gain."""
    named = {name: difference for program in viewed for name, difference in program.differences.items()}
    gain = gain_for(np.stack(list(named.values())))
    for name, difference in named.items():
        folder.picture(name, coloured(difference, gain))
    return gain


def _names(program: Drawn, view: str) -> ViewPictures:
    stem = f"{PICTURES}/{program.name}-{view}"
    return ViewPictures(**{field: f"{stem}-{field.replace('_', '-')}.png" for field in ViewPictures.model_fields})


def _write_pictures(folder: ReportFolder, names: ViewPictures, truth: FloatArray, drawn: FloatArray) -> None:
    folder.picture(names.truth_black, encoded(truth, "black"))
    folder.picture(names.drawn_black, encoded(drawn, "black"))
    folder.picture(names.truth_white, encoded(truth, "white"))
    folder.picture(names.drawn_white, encoded(drawn, "white"))
