"""volprep import: begin a draft."""

from pathlib import Path
from typing import Annotated

import typer

from volprep_cli.build import Output, Profile, Source
from volprep_cli.console import progress


def import_source(
    scene: Annotated[Path, typer.Argument(help="Scene file (.toml), or a scan without a scene.", metavar="SCENE|SCAN")],
    output: Output,
    profile: Profile = None,
    source: Source = None,
) -> None:
    """Begin a draft: read the scan at full precision, and measure it.

    A scan without a scene is drawn with a grey ramp over all its values.
    """
    from volprep.drafts import import_draft, scene_of  # noqa: PLC0415 - keeps volprep --help fast
    from volprep.origin import Origin, write_origin  # noqa: PLC0415
    from volprep.request import load_request, request_for_source  # noqa: PLC0415

    if scene.suffix == ".toml":
        request = load_request(scene, profile, source)
    elif source is None:
        request = request_for_source(scene, profile)
    else:
        msg = "--source replaces the scan of a scene; there is none here"
        raise typer.BadParameter(msg)
    with progress() as watcher:
        draft = import_draft(request, output, watcher)
    origin = Origin(scene_path=str(request.scene_path) if request.scene_path else None, scene=scene_of(draft))
    write_origin(output, origin)
    shape = "×".join(str(n) for n in draft.manifest.source.info.grid.shape_zyx)
    values = draft.manifest.statistics
    print(f"{output}: draft of {shape} voxels, values {values.minimum:g} to {values.maximum:g}")
