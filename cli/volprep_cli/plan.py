"""volprep plan: what a package of a scene would hold, and why."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.build import Grid, Profile, Scene, Source
from volprep_cli.choices import Choices, takes_choices
from volprep_cli.console import Json, bytes_text, print_json, print_line, print_table, progress

if TYPE_CHECKING:
    from collections.abc import Sequence

    from volprep.plan.device_choice import DeviceChoice, Frame
    from volprep_formats.package.parts.costs.record import DrawCost

Device = Annotated[
    Path | None,
    typer.Option(
        help="What a device has measured of a package of this scene, as the page of volprep view saves or sends it: "
        "choose level and step for it.",
        metavar="FILE",
    ),
]
FrameMs = Annotated[
    float, typer.Option(min=0.1, help="Milliseconds that a picture may take on the device.", metavar="MS")
]


@takes_choices
def plan(
    scene: Scene,
    profile: Profile = None,
    source: Source = None,
    *,
    grid: Grid = None,
    device: Device = None,
    frame_ms: FrameMs = 33.0,
    choices: Choices,
    as_json: Json = False,
) -> None:
    """Print what a package would hold, why, and what it costs.

    It reads the whole source and writes nothing. With --device it also says which level and step that device draws in
    time, with the least error, and what that gives up.
    """
    from volprep.pipeline.build import plan_build
    from volprep.plan.device_choice import choose_for_frame
    from volprep.plan.device_files import read_device
    from volprep.scene.request import request_of

    record = None if device is None else read_device(device)
    request = choices.of(request_of(scene, profile, source))
    if grid is not None:
        request = request.with_grid(grid)
    with progress() as watcher:
        decided = plan_build(request, watcher, None if device is None or record is None else (device, record))
    frame = None if record is None else choose_for_frame(record, frame_ms)
    if as_json:
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
        _print_frame(frame)


def _print_costs(costs: "Sequence[DrawCost]") -> None:
    print_line("")
    print_line("what drawing takes on a device, without pictures and meshes")
    rows = [
        (each.transfer, str(each.level), bytes_text(each.upload_bytes), bytes_text(each.gpu_bytes)) for each in costs
    ]
    print_table(("transfer function", "level", "upload", "GPU memory"), rows)


def _print_frame(frame: "Frame") -> None:
    size = f"{frame.picture_size}×{frame.picture_size}"
    print_line("")
    print_line(f"{frame.gpu}: the least error in {frame.frame_ms:g} ms, for pictures of {size} pixels")
    rows = [
        (
            each.transfer,
            str(each.chosen.level),
            f"{each.chosen.step_mm:.3g} mm",
            f"{each.chosen.slowest_ms:.3g}",
            f"{each.chosen.rmse:.3g}",
            _given_up(each),
        )
        for each in frame.choices
    ]
    print_table(("transfer function", "level", "step", "ms", "RMSE", "gives up"), rows)
    if frame.throttled:
        print_line("The device became slower while it was measured: a cool one is faster than this.")


def _given_up(choice: "DeviceChoice") -> str:
    best = choice.best
    if best == choice.chosen:
        return "nothing: no measured picture is better"
    return (
        f"RMSE {choice.given_up_rmse:.2g}: level {best.level} with {best.step_mm:.3g} mm has {best.rmse:.3g}, in "
        f"{best.slowest_ms:.3g} ms"
    )
