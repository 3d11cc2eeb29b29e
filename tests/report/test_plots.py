"""What the plots of a report show."""

import re

from sample_report import VIEWS, errors, report_of
from tiny_packages import function

from volprep.report.plots import (
    DeviceCurve,
    curves_against_time,
    error_against_step,
    error_against_time,
    transfer_plot,
)


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
