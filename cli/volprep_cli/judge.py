"""volprep judge: measure the levels of any OME-Zarr pyramid, or of a package, and write fidelity.json."""

from pathlib import Path
from typing import Annotated

import typer

from volprep_cli.console import print_json, print_line, progress, wants_json
from volprep_cli.outputs import Force, require_new

Store = Annotated[Path, typer.Argument(help="OME-Zarr image or package with several levels.", metavar="STORE")]
LookFile = Annotated[
    Path,
    typer.Option(
        "--look",
        help="Scene (.toml), or record of looks (JSON, package, OME-Zarr, .glb), whose transfer functions and "
        "tolerance are taken.",
        metavar="FILE",
    ),
]
Target = Annotated[Path, typer.Option("-o", "--output", help="File to write.", metavar="FILE")]
Channel = Annotated[str | None, typer.Option(help="Name or number of the channel.", metavar="NAME")]


def judge(
    store: Store,
    look: LookFile,
    output: Target = Path("fidelity.json"),
    channel: Channel = None,
    *,
    force: Force = False,
) -> None:
    """Measure what the coarse levels of a pyramid lose: look by look, at each size of a voxel on the screen.

    The finest level is the truth. Each picture is the exact integral of an unlit volume, in three views. `formats/js/
    store_fidelity.js` reads the file: it says what a screen shows, and which level is enough.
    """
    from volprep.judge.measure import judge as measured_levels
    from volprep_formats.output import new_file, require_place

    require_new(output, force=force)
    require_place(output)
    with progress() as watcher:
        found = measured_levels(store, look, watcher, channel=channel)
    with new_file(output) as file:
        file.write(found.model_dump_json(indent=1).encode() + b"\n")
    if wants_json():
        print_json(found.model_dump(mode="json"))
        return
    print_line(f"{output}: {len(found.measured)} measurements; allowed are RMSE {found.tolerance_rmse:g}")
    for measurement in found.measured:
        share = measurement.kept_contrast
        kept = "" if share is None else f", thin things keep {100 * share:.0f} % of their contrast"
        size = f"{measurement.pixels_per_voxel:g} pixels a voxel"
        print_line(f"  {measurement.look}, level {measurement.level}, {size}: RMSE {measurement.rmse:.3g}{kept}")
