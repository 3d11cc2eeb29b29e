"""volprep build: the main job, from a scene to a sealed package."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from volprep_cli.choices import Choices, complete_profiles, takes_choices
from volprep_cli.console import (
    bytes_text,
    print_json,
    print_line,
    print_note,
    print_remarks,
    progress,
    voxels_text,
    wants_json,
)
from volprep_cli.outputs import default_package

if TYPE_CHECKING:
    from volprep_formats.package.manifest import Manifest

Scene = Annotated[
    Path,
    typer.Argument(
        help="Scene file, TOML: a source and transfer functions. Or a scan alone, whose look is chosen by its "
        "values: a colour for each label, the bones of a CT, two colours for values below and above 0, other "
        'objects lit in grey. The name in the package is then "scan", never that of the file.',
        metavar="SCENE|SCAN",
    ),
]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        help="Package to write; if not given, NAME.volpkg in the current folder, for a scan or scene NAME.",
        metavar="PACKAGE",
    ),
]
Profile = Annotated[
    str | None,
    typer.Option(
        help="Class of devices: gles1, gles2-2048, gles2-4096, gles3, gles3-astc, gles3-norm16, a device that "
        "volprep doctor lists, or a TOML file. Replaces the scene's.",
        metavar="PROFILE",
        autocompletion=complete_profiles,
    ),
]
Source = Annotated[Path | None, typer.Option(help="The scan. Replaces the path in the scene.", metavar="PATH")]

Grid = Annotated[
    Literal["auto"] | None,
    typer.Option(
        help="auto: if the profile cannot hold the whole scan, cut level 0 into sub-volumes of the size that volprep "
        "plan proposes. Replaces the scene's grid.size."
    ),
]

OnDemand = Annotated[
    bool | None,
    typer.Option(
        help="Whether also to write all levels in bricks that an app fetches as its view needs them. If not given, the "
        "scene decides, or else the plan: if the profile cannot hold the whole scan.",
        show_default=False,
    ),
]

Force = Annotated[bool, typer.Option("--force", help="Also replace a package of another scan or scene.")]
Times = Annotated[bool, typer.Option("--timing", help="Also print the time that each task of the build took.")]


@takes_choices
def build(
    scene: Scene,
    output: Output = None,
    profile: Profile = None,
    source: Source = None,
    *,
    grid: Grid = None,
    on_demand: OnDemand = None,
    force: Force = False,
    timing: Times = False,
    choices: Choices,
) -> None:
    """Build the package of a scene: run all stages that it needs.

    An older PACKAGE of the same scene or scan is replaced when the new one is complete. Another package needs --force.
    Anything else is never replaced.
    If a build is interrupted, run the same command again to resume it.
    """
    from volprep.pipeline.build import build as build_package
    from volprep.pipeline.build import check_replaced
    from volprep.scene.request import request_of
    from volprep_cli.timing import Timing, print_times

    if output is None:
        output = default_package(scene)
        print_note(f"writing {output}; -o PACKAGE names another")
    request = choices.of(request_of(scene, profile, source))
    if grid is not None:
        request = request.with_grid(grid)
    if on_demand is not None:
        request = request.with_on_demand(wanted=on_demand)
    replaced = check_replaced(request, output, force=force)
    with progress() as watcher:
        timed = Timing(watcher)
        manifest = build_package(request, output, timed)
        tasks = timed.tasks() if timing else []
    print_remarks(manifest)
    if replaced:
        print_note(f"{output} replaced the package that was there")
    size = sum(record.size_bytes for record in manifest.files)
    if wants_json():
        times = {"timing": [asdict(task) for task in tasks]} if timing else {}
        print_json({"package": str(output), "files": len(manifest.files), "size_bytes": size} | _told(manifest) | times)
    else:
        levels = ", ".join(
            voxels_text(level.grid.shape_zyx) + (" (for previews)" if level.index in manifest.previews else "")
            for level in manifest.levels
        )
        print_line(
            f"{output}: {manifest.profile.name}, {len(manifest.files)} files, {bytes_text(size)}; levels {levels}"
        )
        if timing:
            print_times(tasks)


def _told(manifest: "Manifest") -> dict[str, object]:
    """Return a build's measurements, other than the size, for JSON."""
    from volprep.pipeline.remarks import remarks, warnings

    levels = [
        {
            "index": level.index,
            "shape_zyx": list(level.grid.shape_zyx),
            "spacing_mm_zyx": list(level.grid.spacing_mm_zyx),
            "preview_only": level.index in manifest.previews,
        }
        for level in manifest.levels
    ]
    return {
        "profile": manifest.profile.name,
        "levels": levels,
        "notes": [*remarks(manifest)],
        "warnings": [*warnings(manifest)],
    }
