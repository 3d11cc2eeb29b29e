"""volprep presets: the transfer functions that come with volprep."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import print_colours, print_json, print_line, progress, wants_json
from volprep_cli.outputs import Force, require_new

if TYPE_CHECKING:
    from volprep.scene.presets import Preset

Scan = Annotated[Path | None, typer.Argument(help="Draw this scan with each preset.", metavar="[SCAN]")]
Pictures = Annotated[
    Path | None,
    typer.Option("-o", "--output", help="Folder for pictures of SCAN, a PNG file for each preset.", metavar="FOLDER"),
]
_CELLS = 48
"""Width of the strip of colours, in characters."""


def presets(scan: Scan = None, output: Pictures = None, *, force: Force = False) -> None:
    """List the transfer functions that come with volprep; a terminal shows their colours over black.

    With SCAN and -o, write a picture of the scan with each. Choose one with --preset NAME, or with preset = "NAME" in
    [[transfer]] of a scene.
    """
    from volprep.scene.presets import load_preset, preset_names

    if (scan is None) != (output is None):
        raise typer.BadParameter("pictures need both a SCAN and a FOLDER", param_hint="SCAN, --output")
    if scan is not None and output is not None:
        _draw(scan, output, force=force)
        return
    listed = [(name, load_preset(name)) for name in preset_names()]
    if wants_json():
        print_json(
            {"presets": [{"name": name, "shows": preset.shows, "values": preset.values} for name, preset in listed]}
        )
        return
    for name, preset in listed:
        print_line(f"{name:<20} {preset.shows}")
        if sys.stdout.isatty():
            _print_strip(name, preset)


def _draw(scan: Path, folder: Path, *, force: bool) -> None:
    from volprep.pipeline.preset_pictures import draw_presets, picture_paths
    from volprep.scene.request import request_of

    for path in picture_paths(folder).values():
        require_new(path, force=force)
    with progress() as watcher:
        drawn = draw_presets(request_of(scan), folder, watcher)
    if wants_json():
        told = [
            {
                "name": preset.name,
                "picture": None if preset.picture is None else str(preset.picture),
                "note": preset.why_not,
            }
            for preset in drawn
        ]
        print_json({"presets": told})
        return
    for preset in drawn:
        where = "no picture" if preset.picture is None else str(preset.picture)
        print_line(f"{preset.name:<20} {where}{f': {preset.why_not}' if preset.why_not else ''}")


def _print_strip(name: str, preset: "Preset") -> None:
    """Print the colours of a preset over black, between the ends of its values."""
    from volprep.scene.points import Measure
    from volprep.truth.strip import strip

    # Places in the range become percent; the diagonal is that of a head.
    function = preset.function(name, Measure(low=0.0, high=100.0, diagonal_mm=300.0))
    cells = "".join(f"\033[48;2;{red};{green};{blue}m " for red, green, blue in strip(function, _CELLS))
    first, last = function.points[0].value, function.points[-1].value
    unit = " %" if preset.values == "range" else ""
    print_colours(f"{first:>16g}{unit} {cells}\033[0m {last:g}{unit}")
