"""Volume properties of 3D Slicer (.vp): nine lines; the seventh is the opacity and the last the colour.

Each of these is a count of numbers and the numbers: value and opacity, or value, red, green and blue (Slicer's
developer guide, volume rendering). Shading and gradient opacity are ignored.
"""

from volprep_formats.transfer_files.points import FilePoint, Knot, joined, knots, number

_OPACITY_LINE = 6
_COLOUR_LINE = 8


def read_slicer(text: str) -> list[FilePoint]:
    """Read the points. Raises ValueError with a description of the problem."""
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) <= _COLOUR_LINE:
        msg = f"{len(lines)} lines, expected {_COLOUR_LINE + 1}"
        raise ValueError(msg)
    return joined(
        _function(lines[_COLOUR_LINE], 4, "colour transfer function"),
        _function(lines[_OPACITY_LINE], 2, "scalar opacity"),
    )


def _function(line: str, width: int, what: str) -> list[Knot]:
    count, *rest = line.split()
    if number(count) != len(rest):
        msg = f"{what}: {count[:40]} numbers promised, {len(rest)} there"
        raise ValueError(msg)
    return knots([number(value) for value in rest], width, what)
