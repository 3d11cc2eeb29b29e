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
