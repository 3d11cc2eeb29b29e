"""volprep import: begin a draft, or list the DICOM series that could become one."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.build import Profile, Source
from volprep_cli.choices import Choices, takes_choices
from volprep_cli.console import Json, print_json, print_line, print_remarks, print_table, progress, voxels_text

if TYPE_CHECKING:
    from volprep_formats.readers.dicom.listing import ListedSeries, Listing

Output = Annotated[Path | None, typer.Option("-o", "--output", help="Where the draft goes.", metavar="PACKAGE")]
List = Annotated[
    bool,
    typer.Option(
        "--list",
        help="Only list the DICOM series of a folder, with what is wrong with each; or the channels of an OME file.",
    ),
]


@takes_choices
def import_source(
    scene: Annotated[Path, typer.Argument(help="Scene file (.toml), or a scan without a scene.", metavar="SCENE|SCAN")],
    output: Output = None,
    profile: Profile = None,
    source: Source = None,
    *,
    choices: Choices,
    only_list: List = False,
    as_json: Json = False,
) -> None:
    """Begin a draft: read the scan at full precision and measure it.

    A scan without a scene is drawn as its values suggest, and the package's name is "scan": the file's
    own may be that of a patient. Where the scan is stands in PACKAGE.origin.json beside the draft, and not in it.
    """
    if only_list:
        _list(scene, as_json=as_json)
        return
    if output is None:
        msg = "Missing option '-o' / '--output'."
        raise typer.BadParameter(msg)
    from volprep.pipeline.begin import begin_draft
    from volprep.scene.request import request_of

    request = choices.of(request_of(scene, profile, source))
    with progress() as watcher:
        draft = begin_draft(request, output, watcher)
    shape = voxels_text(draft.manifest.source.info.grid.shape_zyx)
    values = draft.manifest.statistics
    print_remarks(draft.manifest)
    low, high = values.minimum, values.maximum
    if as_json:
        print_json(
            {"draft": str(output), "source": draft.manifest.source.model_dump(mode="json"), "values": [low, high]}
        )
    else:
        print_line(f"{output}: draft of {shape} voxels, values {low:g} to {high:g}")


def _list(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers import format_of

    if format_of(path) == "dicom":
        _list_series(path, as_json=as_json)
    else:
        _list_channels(path, as_json=as_json)


def _list_channels(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers import channels_of

    names = channels_of(path)
    if as_json:
        print_json({"channels": names})
    else:
        print_table(("channel", "name"), [(str(number), name or "-") for number, name in enumerate(names, 1)])


def _list_series(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers.dicom.listing import list_series

    with progress() as watcher:
        listing = list_series(path, watcher, described=sys.stdout.isatty())
    if as_json:
        print_json(listing.model_dump(mode="json"))
    else:
        _print(listing)


def _what(series: "ListedSeries") -> str:
    kind = f"a localiser of {series.shape_zyx[0]} slices" if series.is_localiser else "a volume"
    faults = "; ".join(f"{problem.code} {problem.summary}" for problem in series.problems)
    return f"{kind}: {faults}" if series.is_localiser and faults else faults or kind


def _print(listing: "Listing") -> None:
    rows = [
        (
            series.ending,
            series.modality or "-",
            str(series.files),
            voxels_text(series.shape_zyx),
            " × ".join("?" if h is None else f"{h:.4g}" for h in reversed(series.spacing_mm_zyx)),
            _what(series),
            *([series.description or "-"] if sys.stdout.isatty() else []),
        )
        for series in listing.series
    ]
    headings = ("series", "modality", "files", "voxels", "spacing mm", "what it is")
    # What people called a series may name a patient: it is shown to who looks, and not written into files.
    print_table((*headings, "description") if sys.stdout.isatty() else headings, rows)
    for problem in listing.damaged:
        print_line(f"{problem.code} {problem.summary}")
    if listing.other_files:
        print_line(f"files that are no DICOM images: {listing.other_files}")
