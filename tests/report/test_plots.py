"""What the plots of a report show."""

import re

from volprep.report.plots import transfer_plot
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint


def test_the_area_under_a_transfer_function_has_its_colours() -> None:
    ramp = TransferFunction(
        name="ramp",
        points=(
            TransferPoint(value=0.0, colour=(0.0, 0.0, 0.0), extinction_per_mm=0.1),
            TransferPoint(value=100.0, colour=(1.0, 0.0, 0.0), extinction_per_mm=0.5),
        ),
    )
    plot = transfer_plot(ramp, (0.0, 100.0), "HU")
    for svg in (plot.wide, plot.narrow):
        filled = set(re.findall(r"fill: #([0-9a-f]{2})0000; stroke: #\1", svg))
        assert len(filled) > 60


def test_a_function_of_a_picture_of_one_value_is_plotted_as_opacity() -> None:
    points = (TransferPoint(value=each, colour=(1.0, 1.0, 1.0), extinction_per_mm=each) for each in (0.0, 7.0))
    ramp = TransferFunction(name="ramp", points=tuple(points), reference_mm=2.0)
    assert ">opacity<" in transfer_plot(ramp, (0.0, 7.0), "", 2.0).wide
    assert ">extinction per mm<" in transfer_plot(ramp, (0.0, 7.0), "").wide
