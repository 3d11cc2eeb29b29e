"""volprep look: recognise a scan before anything is built."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.choices import Choices, takes_choices
from volprep_cli.console import bytes_text, print_colours, print_json, print_line, voxels_text, wants_json
from volprep_cli.outputs import Force, require_new

if TYPE_CHECKING:
    from volprep.pipeline.look import ScanPreview

Scan = Annotated[Path, typer.Argument(help="A scan, or a scene file that names one.", metavar="SCAN|SCENE")]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", help="PNG file to write: three slices and the histogram.", metavar="PICTURE"),
]
_BARS = " ▁▂▃▄▅▆▇█"
_CELLS = 76


@takes_choices
def look(scan: Scan, output: Output = None, *, force: Force = False, choices: Choices) -> None:
    """Show a scan before a build: size, values, three slices, and the recognised kind of scan.

    A terminal shows the slices; -o writes them, with the histogram, as a PNG file. At most 128 slices of a large scan
    are read.
    """
    from volprep.pipeline.look import look_at, picture
    from volprep.scene.request import request_of
    from volprep_formats.output import write_file
    from volprep_formats.png import png_bytes, require_png_place

    if output is not None:
        require_new(output, force=force)
        require_png_place(output)
    looked = look_at(choices.of(request_of(scan)))
    if output is not None:
        write_file(output, png_bytes(picture(looked)), "VP5021")
    if wants_json():
        print_json(facts(looked) | {"picture": None if output is None else str(output)})
        return
    _print(looked)
    if sys.stdout.isatty():
        _draw(looked)


def facts(looked: "ScanPreview") -> dict[str, object]:
    """Return the findings for JSON."""
    info = looked.info
    return {
        "format": info.format,
        "shape_zyx": list(info.grid.shape_zyx),
        "spacing_mm_zyx": list(info.grid.spacing_mm_zyx),
        "extent_mm_zyx": list(info.grid.extent_mm_zyx),
        "stored_type": info.stored_type,
        "unit": info.unit,
        "modality": info.modality,
        "values": list(looked.ends),
        "all_slices_read": looked.is_whole,
        "not_numbers": looked.not_numbers,
        "histogram": list(looked.counts),
        "recognised": looked.recognised,
        "notes": list(info.remarks),
    }


def _print(looked: "ScanPreview") -> None:
    from volprep.pipeline.look import size_bytes

    info = looked.info
    kind = " ".join(value for value in (info.format, info.modality) if value)
    size = f"{voxels_text(info.grid.shape_zyx)} voxels of {info.stored_type}, {bytes_text(size_bytes(info))}"
    print_line(f"{kind}: {size}")
    spacing, extent = (
        " × ".join(f"{length:.4g}" for length in reversed(lengths))
        for lengths in (info.grid.spacing_mm_zyx, info.grid.extent_mm_zyx)
    )
    print_line(f"voxels of {spacing} mm, {extent} mm in all")
    of_what = "" if looked.is_whole else " in the slices that were read"
    low, high = looked.ends
    what = "shares of the largest extinction" if looked.slices[0].ndim == 3 else "values"
    print_line(f"{what} {low:g} to {high:g}{f' {info.unit}' if info.unit else ''}{of_what}")
    if looked.not_numbers:
        print_line(f"{looked.not_numbers} values are NaN or infinite")
    print_line(_histogram(looked))
    if looked.recognised:
        print_line(looked.recognised)
    for remark in info.remarks:
        print_line(f"note: {remark}")


def _histogram(looked: "ScanPreview") -> str:
    """Return the histogram in one line, heights by the logarithm of the counts."""
    import math

    heights = [math.log1p(count) for count in looked.counts]
    most = max(*heights, 1e-9)
    return "".join(_BARS[round(height / most * (len(_BARS) - 1))] for height in heights)


def _draw(looked: "ScanPreview") -> None:
    """Draw the slices in the terminal: each character holds two pixels, one above the other."""
    from volprep.pipeline.look import picture

    drawn = picture(looked)
    rows = 2 * round(_CELLS * 256 / drawn.shape[1] / 2)
    y = [int((row + 0.5) * 256 / rows) for row in range(rows)]
    x = [int((column + 0.5) * drawn.shape[1] / _CELLS) for column in range(_CELLS)]
    for upper, lower in zip(y[::2], y[1::2], strict=True):
        cells = ([";".join(map(str, drawn[row, column].tolist())) for row in (upper, lower)] for column in x)
        line = "".join(f"\033[38;2;{above}m\033[48;2;{below}m▀" for above, below in cells)
        print_colours(f"{line}\033[0m")
