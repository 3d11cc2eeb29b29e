"""volprep presets: the transfer functions that come with volprep."""

import sys

from volprep_cli.console import Json, print_json, print_line

_CELLS = 48
"""Width of the strip of colours, in characters."""


def presets(as_json: Json = False) -> None:
    """List the transfer functions that come with volprep, on a terminal with their colours over black.

    Choose one with --preset NAME, or with preset = "NAME" in [[transfer]] of a scene.
    """
    from volprep.scene.points import Measure
    from volprep.scene.presets import load_preset, preset_names

    listed = [(name, load_preset(name)) for name in preset_names()]
    if as_json:
        print_json(
            {"presets": [{"name": name, "shows": preset.shows, "values": preset.values} for name, preset in listed]}
        )
        return
    for name, preset in listed:
        print_line(f"{name:<16} {preset.shows}")
        if sys.stdout.isatty():
            from volprep.truth.strip import strip

            # Places in the range become percent; the diagonal is that of a head.
            function = preset.function(name, Measure(low=0.0, high=100.0, diagonal_mm=300.0))
            cells = "".join(f"\033[48;2;{red};{green};{blue}m " for red, green, blue in strip(function, _CELLS))
            first, last = function.points[0].value, function.points[-1].value
            unit = " %" if preset.values == "range" else ""
            sys.stdout.write(f"{first:>16g}{unit} {cells}\033[0m {last:g}{unit}\n")
