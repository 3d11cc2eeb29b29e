"""What the plots of a report show."""

import re
from itertools import product

from sample_report import VIEWS, errors, report_of
from tiny_packages import function

from volprep.report.canvas import SERIES, Axes, Axis
from volprep.report.canvas import plot as plot_of
from volprep.report.plots import DeviceCurve, curves_against_time, error_against_step, error_against_time, transfer_plot


def test_the_area_under_a_transfer_function_has_its_colours() -> None:
    ramp = function((0.0, (0.0, 0.0, 0.0), 0.1), (100.0, (1.0, 0.0, 0.0), 0.5), name="ramp")
    plot = transfer_plot(ramp, (0.0, 100.0), "HU")
    for svg in (plot.wide, plot.narrow):
        filled = set(re.findall(r"fill: #([0-9a-f]{2})0000; stroke: #\1", svg))
        assert len(filled) > 60


def test_a_function_of_a_picture_of_one_value_is_plotted_as_opacity() -> None:
    white = (1.0, 1.0, 1.0)
    ramp = function((0.0, white, 0.0), (7.0, white, 7.0), name="ramp", reference_mm=2.0)
    assert ">opacity<" in transfer_plot(ramp, (0.0, 7.0), "", 2.0).wide
    assert ">extinction per mm<" in transfer_plot(ramp, (0.0, 7.0), "").wide


def test_errors_that_are_all_0_have_a_linear_axis() -> None:
    report = report_of((0.0,) * len(VIEWS))
    (program,) = report.programs
    none = {"total": errors(0.0), "drawing": errors(0.0), "quadrature": errors(0.0)}
    points = tuple(point.model_copy(update=none) for point in program.sweep.points)
    exact = program.model_copy(update={"sweep": program.sweep.model_copy(update={"points": points})})
    curve = DeviceCurve("phone", front=((10.0, 0.0), (20.0, 0.0)), beside=())
    for plot in (
        error_against_time(exact, report),
        error_against_step(exact, report),
        curves_against_time([curve], 0.01),
    ):
        assert ">0<" in plot.wide


def test_ticks_of_an_axis_are_round_numbers_within_it_and_no_closer_than_their_room() -> None:
    for logarithmic, values in product(
        (False, True), ((0.9, 1.1), (3e-6, 2.0), (5.0, 5.0), (1e-9, 1e9), (0.002, 0.07))
    ):
        axis = Axis(logarithmic=logarithmic, values=[*values])
        places = [axis.place(tick) for tick in axis.ticks(300.0, 30.0)]
        assert 2 <= len(places) <= 10
        assert all(-1e-9 <= place <= 1 + 1e-9 for place in places)
        assert places == sorted(places)


def test_a_plot_has_a_point_where_its_value_lies_and_foreign_names_are_escaped() -> None:
    def draw(axes: Axes) -> None:
        axes.x, axes.y = Axis(low=0.0, high=10.0), Axis(low=0.0, high=1.0)
        axes.plot([(5.0, 0.75)], SERIES[0], "<b>&", marker="o", dashes=None)

    wide = plot_of(draw, height_inches=1.0).wide
    assert '<g transform="translate(309.60 18.00)"><circle' in wide
    assert "&lt;b&gt;&amp;" in wide
    assert "<b>" not in wide


def test_points_that_do_not_stretch_the_axes_leave_them() -> None:
    axes = Axes()
    axes.plot([(1.0, 1.0), (2.0, 2.0)], SERIES[0])
    before = axes.y.place(1.5)
    axes.plot([(1.0, 100.0)], SERIES[1], stretches=False)
    assert axes.y.place(1.5) == before


def test_a_name_without_room_on_the_right_of_its_point_is_written_on_its_left() -> None:
    def draw(axes: Axes) -> None:
        axes.x, axes.y = Axis(low=0.0, high=10.0), Axis(low=0.0, high=1.0)
        axes.text((9.0, 0.5), "a name of thirty letters, about", 8, 0)

    plot = plot_of(draw)
    assert re.search(r'<text x="565.28"[^>]*text-anchor: start', plot.wide) is None
    assert re.search(r'<text x="549.28"[^>]*text-anchor: end', plot.wide)
