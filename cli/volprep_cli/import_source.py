"""volprep import: begin a draft, or list the DICOM series that could become one."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.build import Profile, Source
from volprep_cli.console import Json, print_json, print_remarks, print_table, progress, voxels_text

if TYPE_CHECKING:
    from volprep_formats.readers.dicom.listing import Listing

Output = Annotated[Path | None, typer.Option("-o", "--output", help="Where the draft goes.", metavar="PACKAGE")]
Series = Annotated[
    str | None,
    typer.Option(
        help="SeriesInstanceUID, or an ending of it, where there are several. Replaces the scene's.", metavar="UID"
    ),
]
Volume = Annotated[
    int | None,
    typer.Option(min=1, help="Which volume of a series that holds several. Replaces the scene's.", metavar="NUMBER"),
]
Channel = Annotated[
    str | None,
    typer.Option(
        help="Which channel of an OME file that holds several, by name or number. Replaces the scene's.", metavar="NAME"
    ),
]
Level = Annotated[
    int | None,
    typer.Option(
        min=0,
        help="Which resolution of a package or an OME-Zarr store; 0 is the finest. Replaces the scene's.",
        metavar="NUMBER",
    ),
]
Grid = Annotated[
    str | None,
    typer.Option(help="Name of the grid in an OpenVDB file that holds several. Replaces the scene's.", metavar="NAME"),
]
Rgb = Annotated[
    Literal["luminance"] | None,
    typer.Option(
        help="What to do with pictures in colour: luminance makes them grey. Without it they are refused. Replaces the "
        "scene's."
    ),
]
Repair = Annotated[
    list[str],
    typer.Option(
        help="Allow a repair by interpolation: gaps (missing slices, uneven distances) or tilt (of the gantry). "
        "Can be given twice. Replaces the scene's.",
        metavar="KIND",
    ),
]
List = Annotated[
    bool,
    typer.Option(
        "--list",
        help="Only list the DICOM series of a folder tree, and what is wrong with each; of an OME file, its channels.",
    ),
]


def import_source(
    scene: Annotated[Path, typer.Argument(help="Scene file (.toml), or a scan without a scene.", metavar="SCENE|SCAN")],
    output: Output = None,
    profile: Profile = None,
    source: Source = None,
    *,
    series: Series = None,
    volume: Volume = None,
    channel: Channel = None,
    level: Level = None,
    grid: Grid = None,
    rgb: Rgb = None,
    repair: Repair = [],  # noqa: B006 - typer asks for a list, and nothing changes it
    only_list: List = False,
    as_json: Json = False,
) -> None:
    """Begin a draft: read the scan at full precision, and measure it.

    A scan without a scene is drawn with a grey ramp over all its values.
    """
    if only_list:
        _list(scene, as_json=as_json)
        return
    if output is None:
        msg = "Missing option '-o' / '--output'."
        raise typer.BadParameter(msg)
    from volprep.pipeline.import_draft import import_draft  # noqa: PLC0415 - keeps volprep --help fast
    from volprep.pipeline.origin import Origin, write_origin  # noqa: PLC0415
    from volprep.pipeline.prepare import prepare  # noqa: PLC0415
    from volprep.scene.request import request_of  # noqa: PLC0415

    request = request_of(scene, profile, source)
    if unknown := set(repair) - {"gaps", "tilt"}:
        msg = f"--repair is {min(unknown)}, and can be gaps or tilt"
        raise typer.BadParameter(msg)
    told = {"series": series, "volume": volume, "channel": channel, "level": level, "grid": grid, "rgb": rgb}
    choices: dict[str, object] = {key: value for key, value in told.items() if value is not None}
    if repair:
        choices["repair"] = tuple(repair)
    if choices:
        request = request.with_source(**choices)
    with progress() as watcher:
        imported = import_draft(prepare(request), output, watcher)
    draft = imported.draft
    scene_path = str(request.scene_path) if request.scene_path else None
    origin = Origin(scene_path=scene_path, scene=imported.scene, profile=request.profile)
    write_origin(output, origin)
    shape = voxels_text(draft.manifest.source.info.grid.shape_zyx)
    values = draft.manifest.statistics
    print_remarks(draft.manifest)
    low, high = values.minimum, values.maximum
    if as_json:
        print_json(
            {"draft": str(output), "source": draft.manifest.source.model_dump(mode="json"), "values": [low, high]}
        )
    else:
        print(f"{output}: draft of {shape} voxels, values {low:g} to {high:g}")


def _list(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers import format_of  # noqa: PLC0415 - keeps volprep --help fast

    if format_of(path) == "dicom":
        _list_series(path, as_json=as_json)
    else:
        _list_channels(path, as_json=as_json)


def _list_channels(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers import channels_of  # noqa: PLC0415 - keeps volprep --help fast

    names = channels_of(path)
    if as_json:
        print_json({"channels": names})
    else:
        print_table(("channel", "name"), [(str(number), name or "-") for number, name in enumerate(names, 1)])


def _list_series(path: Path, *, as_json: bool) -> None:
    from volprep_formats.readers.dicom.listing import list_series  # noqa: PLC0415 - keeps volprep --help fast

    with progress() as watcher:
        listing = list_series(path, watcher)
    if as_json:
        print_json(listing.model_dump(mode="json"))
    else:
        _print(listing)


def _print(listing: "Listing") -> None:
    rows = [
        (
            series.ending,
            series.modality or "-",
            str(series.files),
            voxels_text(series.shape_zyx),
            " × ".join("?" if h is None else f"{h:.4g}" for h in reversed(series.spacing_mm_zyx)),
            "a volume" if series.problem is None else f"{series.problem.code} {series.problem.summary}",
        )
        for series in listing.series
    ]
    print_table(("series", "modality", "files", "voxels", "spacing mm", "what it is"), rows)
    for problem in listing.damaged:
        print(f"{problem.code} {problem.summary}")
    if listing.other_files:
        print(f"files that are no DICOM images: {listing.other_files}")
