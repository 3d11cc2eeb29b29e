"""volprep import: begin a draft, or list the DICOM series that could become one."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from volprep_cli.build import Profile, Source
from volprep_cli.choices import Choices, takes_choices
from volprep_cli.console import print_json, print_line, print_remarks, print_table, progress, voxels_text, wants_json

if TYPE_CHECKING:
    from volprep_formats.readers.dicom.listing import ListedSeries, Listing

Output = Annotated[
    Path | None, typer.Option("-o", "--output", help="Draft to write. An older draft is replaced.", metavar="PACKAGE")
]
List = Annotated[
    bool,
    typer.Option(
        "--list",
        help="Only list the DICOM series of a folder, with the problems of each, or the channels of an OME file.",
    ),
]

Descriptions = Annotated[
    bool,
    typer.Option(
        "--descriptions/--no-descriptions",
        help="Whether --list shows the description, kernel, echo and time of each series on a terminal. JSON and "
        "packages never contain them.",
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
    descriptions: Descriptions = True,
) -> None:
    """Begin a draft: read the scan at full precision and measure it.

    The look of a scan without a scene is chosen by its values, and its package is named "scan", because a file name may
    contain that of a patient. PACKAGE.origin.json, beside the draft, has the path of the scan; the draft has not.
    """
    if only_list:
        _list(scene, described=descriptions and sys.stdout.isatty())
        return
    if output is None:
        msg = "Missing option '-o' / '--output'."
        raise typer.BadParameter(msg)
    from volprep.pipeline.import_draft import begin_draft
    from volprep.scene.request import request_of

    request = choices.of(request_of(scene, profile, source))
    with progress() as watcher:
        draft = begin_draft(request, output, watcher)
    shape = voxels_text(draft.manifest.source.info.grid.shape_zyx)
    values = draft.manifest.statistics
    print_remarks(draft.manifest)
    low, high = values.minimum, values.maximum
    if wants_json():
        print_json(
            {"draft": str(output), "source": draft.manifest.source.model_dump(mode="json"), "values": [low, high]}
        )
    else:
        print_line(f"{output}: draft of {shape} voxels, values {low:g} to {high:g}")


def _list(path: Path, *, described: bool) -> None:
    from volprep_formats.readers import format_of

    if format_of(path) == "dicom":
        _list_series(path, described=described)
    else:
        _list_channels(path)


def _list_channels(path: Path) -> None:
    from volprep_formats.readers import channels_of

    names = channels_of(path)
    found = _first(path)
    if wants_json():
        print_json({"channels": names} | found)
    else:
        print_line(_said(found))
        print_table(("channel", "name"), [(str(number), name or "-") for number, name in enumerate(names, 1)])


def _first(path: Path) -> dict[str, Any]:
    """Return what `volprep look` finds of the first volume of a file, or why it cannot be opened."""
    from volprep.pipeline.look import look_at
    from volprep.scene.request import request_of
    from volprep_cli.look import facts
    from volprep_formats.diagnostics import VolprepError
    from volprep_formats.path_text import path_text
    from volprep_formats.readers import channels_of, list_channels
    from volprep_formats.source import SourceSpec

    request = request_of(path)
    try:
        if len(channels_of(path)) > 1:
            key, _ = list_channels(SourceSpec(path=path_text(path)), Path())
            request = request.with_source(**{key: 1})
        return facts(look_at(request))
    except VolprepError as error:
        return {"problem": {"code": error.code, "summary": error.summary, "remedy": error.remedy}}


def _said(found: dict[str, Any]) -> str:
    if "problem" in found:
        return f"{found['problem']['code']} {found['problem']['summary']}"
    spacing = " × ".join(f"{value:.4g}" for value in reversed(found["spacing_mm_zyx"]))
    low, high = found["values"]
    size = f"{voxels_text(found['shape_zyx'])} voxels of {found['stored_type']}, {spacing} mm"
    return f"{found['format']}: {size}, values {low:g} to {high:g} {found['unit']}".rstrip()


def _list_series(path: Path, *, described: bool) -> None:
    from volprep_formats.readers.dicom.listing import list_series

    with progress() as watcher:
        listing = list_series(path, watcher, described=described)
    if wants_json():
        print_json(listing.model_dump(mode="json"))
    else:
        _print(listing, described=described)


def _what(series: "ListedSeries") -> str:
    kind = f"a localiser of {series.shape_zyx[0]} slices" if series.is_localiser else "a volume"
    faults = "; ".join(f"{problem.code} {problem.summary}" for problem in series.problems)
    return f"{kind}: {faults}" if series.is_localiser and faults else faults or kind


def _print(listing: "Listing", *, described: bool) -> None:
    rows = [
        (
            "-" if series.number is None else str(series.number),
            series.ending,
            series.modality or "-",
            str(series.files),
            voxels_text(series.shape_zyx),
            " × ".join("?" if h is None else f"{h:.4g}" for h in reversed(series.spacing_mm_zyx)),
            _what(series),
            *([series.description or "-", series.details or "-"] if described else []),
        )
        for series in listing.series
    ]
    headings = ("number", "series", "modality", "files", "voxels", "spacing mm", "what it is")
    # The description of a series may name a patient: it is shown on the screen, and not written into files.
    print_table((*headings, "description", "details") if described else headings, rows)
    for problem in listing.damaged:
        print_line(f"{problem.code} {problem.summary}")
    if listing.other_files:
        print_line(f"files that are no DICOM images: {listing.other_files}")
