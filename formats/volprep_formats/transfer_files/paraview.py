"""Colour maps of ParaView (.json): a list whose first entry has RGBPoints and Points.

RGBPoints are value, red, green and blue; Points are value, opacity, midpoint and sharpness. Only linear RGB
interpolation is supported: other colour spaces, and midpoints and sharpness other than 0.5 and 0, are refused.
"""

import json

from volprep_formats.transfer_files.points import FilePoint, joined, knots, number

_LINEAR = (0.5, 0.0)


def read_paraview(text: str) -> list[FilePoint]:
    """Read the points. Raises ValueError with a description of the problem."""
    found = json.loads(text)
    entry = found[0] if isinstance(found, list) and found else found
    if not isinstance(entry, dict):
        msg = "no list of colour maps"
        raise ValueError(msg)  # noqa: TRY004 - a wrong file, not a wrong call
    space = entry.get("ColorSpace", "RGB")
    if space != "RGB":
        msg = f"its colours are mixed in {str(space)[:40]}, not in RGB"
        raise ValueError(msg)
    colours = knots(_numbers(entry, "RGBPoints"), 4, "RGBPoints")
    flat = _numbers(entry, "Points")
    if any((flat[i], flat[i + 1]) != _LINEAR for i in range(2, len(flat) - 1, 4)):
        msg = "Points: midpoints and sharpness other than 0.5 and 0 are not linear"
        raise ValueError(msg)
    # Midpoint and sharpness are 0.5 and 0, as knots may be.
    opacities = [knot[:2] for knot in knots(flat, 4, "Points")]
    return joined(colours, opacities)


def _numbers(entry: dict[str, object], key: str) -> list[float]:
    found = entry.get(key)
    if not isinstance(found, list):
        msg = f"{key} is missing"
        raise ValueError(msg)  # noqa: TRY004 - a wrong file, not a wrong call
    return [number(load) for load in found]
