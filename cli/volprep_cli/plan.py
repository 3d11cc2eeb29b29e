"""volprep plan: the contents of a scene's package, and the reasons."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.build import Grid, OnDemand, Profile, Scene, Source
from volprep_cli.choices import Choices, takes_choices
from volprep_cli.console import bytes_text, print_json, print_line, print_note, print_table, progress, wants_json

if TYPE_CHECKING:
    from collections.abc import Sequence

    from volprep.plan.device_scaling import Canvas
    from volprep.scene.request import Request
    from volprep_formats.package.parts.costs.record import LevelCost

_FRAME_MS = 33.0

Device = Annotated[
    Path | None,
    typer.Option(
        help="Measurements of a package of this scene on a device, as the page of volprep view saves or sends "
        "them: choose level and step for this device.",
        metavar="FILE",
    ),
]
Devices = Annotated[
    Path | None,
    typer.Option(
        help="Folder of such files: instead of the plan, print for each device the cheapest measured package of "
        "this scan, with profile, level, step and form.",
        metavar="FOLDER",
    ),
]
FrameMs = Annotated[
    float | None,
    typer.Option(
        min=0.1,
        help=f"Longest time of a picture on the device, in milliseconds. If not given, {_FRAME_MS:g}.",
        metavar="MS",
    ),
]
CanvasSize = Annotated[
    str | None,
    typer.Option(
        help="Size of the app's picture on the device, to which the measured times are scaled. If not given, the "
        "measured size.",
        metavar="WIDTHxHEIGHT",
    ),
]
Error = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        max=1.0,
        help="Largest RMSE over seen pixels that --devices allows. If not given, the tolerance of the scene.",
        metavar="RMSE",
    ),
]


@takes_choices
def plan(
    scene: Scene,
    profile: Profile = None,
    source: Source = None,
    *,
    grid: Grid = None,
    on_demand: OnDemand = None,
    device: Device = None,
    devices: Devices = None,
    frame_ms: FrameMs = None,
    canvas: CanvasSize = None,
    error: Error = None,
    choices: Choices,
) -> None:
    """Print the planned contents of a package, with reasons and costs.

    The whole source is read, and nothing is written. With --device, the level and step with the least error that this
    device draws in time are printed as well. With --devices, the cheapest measured package for each device of a folder
    is chosen.
    """
    from volprep.pipeline.build import plan_build
    from volprep.plan.device_choice import choose_for_frame
    from volprep.plan.device_files import read_device
    from volprep.plan.device_scaling import canvas_of
    from volprep.scene.request import request_of

    if devices is None and error is not None:
        raise typer.BadParameter("it is for --devices", param_hint="--error")
    if devices is not None and device is not None:
        raise typer.BadParameter("give a file, or a folder of files", param_hint="--device, --devices")
    if devices is None and device is None and canvas is not None:
        raise typer.BadParameter("it is for --device and --devices", param_hint="--canvas")
    if devices is None and device is None and frame_ms is not None:
        raise typer.BadParameter("it is for --device and --devices", param_hint="--frame-ms")
    frame_ms = _FRAME_MS if frame_ms is None else frame_ms
    size = None if canvas is None else canvas_of(canvas)
    record = None if device is None else read_device(device)
    request = choices.of(request_of(scene, profile, source))
    if devices is not None:
        _plan_devices(request, devices, size, frame_ms, error)
        return
    if grid is not None:
        request = request.with_grid(grid)
    if on_demand is not None:
        request = request.with_on_demand(wanted=on_demand)
    with progress() as watcher:
        decided = plan_build(request, watcher, None if device is None or record is None else (device, record))
    frame = None if record is None else choose_for_frame(record, frame_ms, size)
    if wants_json():
        chosen = {} if frame is None else {"device": frame.model_dump(mode="json")}
        print_json({**decided.model_dump(mode="json", exclude_none=True), **chosen})
        return
    rows = [
        (
            item.name,
            item.channel or "",
            "kept" if item.kept else "left out",
            bytes_text(item.size_bytes),
            item.reason,
            " ".join(item.files),
        )
        for item in decided.items
    ]
    print_table(("item", "channel", "", "cost", "reason", "files"), rows)
    total = bytes_text(sum(item.size_bytes for item in decided.items if item.kept))
    print_line(f"stages: {', '.join(decided.stages)}; {total} of textures for profile {decided.shared.profile.name}")
    _print_costs(decided.costs)
    if frame is not None:
        from volprep_cli.plan_devices import print_frame

        print_frame(frame)


def _plan_devices(
    request: "Request", folder: Path, canvas: "Canvas | None", frame_ms: float, error: float | None
) -> None:
    from volprep.pipeline.build import scan_digests
    from volprep.plan.device_cheapest import DeviceLimits, cheapest
    from volprep.plan.device_files import read_devices_of_scan
    from volprep_cli.plan_devices import print_cheapest, require_all

    with progress() as watcher:
        records, others = read_devices_of_scan(folder, scan_digests(request, watcher))
    wish = DeviceLimits(frame_ms, request.scene.tolerance.rmse if error is None else error, canvas)
    found = cheapest(records, wish)
    if others:
        print_note(f"{folder}: {others} measurements of other scans are left out")
    if wants_json():
        print_json(found.model_dump(mode="json"))
    else:
        print_cheapest(found)
    require_all(found)


def _print_costs(costs: "Sequence[LevelCost]") -> None:
    print_line("")
    print_line("memory for drawing on a device, without pictures and meshes")
    rows = [
        (cost.picture, str(cost.level), bytes_text(cost.upload_bytes), bytes_text(cost.gpu_bytes)) for cost in costs
    ]
    print_table(("transfer function", "level", "upload", "GPU memory"), rows)
