"""Tables of volprep plan about measured devices: the choice for one, and the cheapest package for each of a folder."""

from typing import TYPE_CHECKING

from volprep_cli.console import bytes_text, print_line, print_table

if TYPE_CHECKING:
    from volprep.plan.device_cheapest import CheapestFrame, DeviceAnswer
    from volprep.plan.device_choice import DeviceChoice, Frame
    from volprep.plan.device_scaling import Canvas, Interval


def print_frame(frame: "Frame") -> None:
    """Print level and step for each transfer function on one device."""
    print_line("")
    measured = f"{frame.picture_size}×{frame.picture_size}"
    size = _size(frame.canvas, measured)
    print_line(f"{frame.gpu}: the least error in {frame.frame_ms:g} ms, for pictures of {size} pixels")
    rows = [
        (
            choice.transfer,
            str(choice.chosen.level),
            f"{choice.chosen.step_mm:.3g} mm",
            _range(choice.chosen_ms),
            f"{choice.chosen.rmse:.3g}",
            _range(choice.growth.ns_per_pixel),
            _given_up(choice),
        )
        for choice in frame.choices
    ]
    print_table(("transfer function", "level", "step", "ms", "RMSE", "ns per pixel", "gives up"), rows)
    if frame.canvas is not None:
        print_line(f"Times are scaled from pictures of {measured} pixels, that the volume fills to the same share.")
        if any(alternative.growth.proportional for alternative in frame.choices):
            print_line(_ONE_SIZE)
    if frame.throttled:
        print_line(_THROTTLED)


def print_cheapest(frame: "CheapestFrame") -> None:
    """Print the cheapest package for each device, or why none fits."""
    size = _size(frame.canvas, "the measured number of")
    print_line(f"cheapest packages within RMSE {frame.seen_rmse:g} in {frame.frame_ms:g} ms, for {size} pixels")
    rows = [row for device in frame.devices for row in _rows(device)]
    titles = ("device", "profile", "transfer function", "level", "step", "form", "ms", "RMSE", "upload")
    print_table(titles, rows)
    draws = [draw for device in frame.devices if device.package for draw in device.package.draws]
    if frame.canvas is not None and any(draw.proportional for draw in draws):
        print_line(_ONE_SIZE)
    for device in frame.devices:
        if device.reason:
            print_line(f"{device.gpu}: no package fits: {device.reason}.")
        if device.throttled:
            print_line(f"{device.gpu}: {_THROTTLED}")


def require_all(frame: "CheapestFrame") -> None:
    """Raise VP7046 unless there is a package for every device."""
    from volprep_formats.diagnostics import VolprepError

    missed = sum(device.package is None for device in frame.devices)
    if missed:
        fields = {"missed": missed, "count": len(frame.devices), "rmse": frame.seen_rmse, "frame_ms": frame.frame_ms}
        raise VolprepError("VP7046", **fields)


_ONE_SIZE = "Only one size of picture was measured: times are in proportion to the pixels, and may be too long."
_FOUR_DIGITS = 1000.0
_THROTTLED = "The device became slower while it was measured: a cool one is faster than this."


def _rows(device: "DeviceAnswer") -> list[tuple[str, ...]]:
    name = f"{device.gpu}, {device.browser}, {device.platform}"
    if device.package is None:
        return [(name, "none", *[""] * 7)]
    return [
        (
            name,
            device.package.profile,
            draw.transfer,
            str(draw.level),
            f"{draw.step_mm:.3g} mm",
            draw.form,
            _range(draw.time_ms),
            f"{draw.seen_rmse:.3g}",
            bytes_text(draw.upload_bytes),
        )
        for draw in device.package.draws
    ]


def _size(canvas: "Canvas | None", measured: str) -> str:
    return measured if canvas is None else f"{canvas.width}×{canvas.height}"


def _range(value: "Interval") -> str:
    expected, least, most = (
        f"{value:.3g}" if value < _FOUR_DIGITS else f"{value:.0f}"
        for value in (value.expected, value.least, value.most)
    )
    return f"{expected} ({least} to {most})"


def _given_up(choice: "DeviceChoice") -> str:
    best = choice.best
    if best == choice.chosen:
        return "nothing: no measured picture is better"
    return (
        f"RMSE {choice.given_up_rmse:.2g}: level {best.level} with {best.step_mm:.3g} mm has {best.rmse:.3g}, in up to "
        f"{choice.best_ms.most:.5g} ms"
    )
