"""Which level and which step a device draws in time, with the least error, from what was measured on it."""

from volprep.plan.device_records import DevicePoint, DeviceProgram, DeviceRecord, NonNegative
from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import Record


class DeviceChoice(Record):
    """What to draw on a device, and what that gives up."""

    transfer: str
    """Name of the transfer function, or of the picture of several channels."""
    chosen: DevicePoint
    """The least error within the time; of equal errors the fastest."""
    best: DevicePoint
    """The least error of all that was measured."""

    given_up_rmse: NonNegative
    """Error that the time costs: 0 where nothing is given up."""


class Frame(Record):
    """What was asked for, and what a device can do of it."""

    frame_ms: NonNegative
    """Time that a frame may take, in milliseconds."""
    gpu: str
    """Name of the device's GPU."""
    picture_size: int
    """Width and height of the pictures that were measured, in pixels."""
    throttled: bool
    """Whether the device became slower while it was measured."""
    choices: tuple[DeviceChoice, ...]
    """For each transfer function."""


def choose_for_frame(record: DeviceRecord, frame_ms: float) -> Frame:
    """Choose level and step for each transfer function so that a draw takes at most `frame_ms`.

    The slowest of the measured times counts. Raises VP7038 where none is so fast.
    """
    return Frame(
        frame_ms=frame_ms,
        gpu=record.device.gpu,
        picture_size=record.picture_size,
        throttled=record.throttling.throttled,
        choices=tuple(_choice(record, program, frame_ms) for program in record.programs if program.points),
    )


def _choice(record: DeviceRecord, program: DeviceProgram, frame_ms: float) -> DeviceChoice:
    in_time = [point for point in program.points if point.slowest_ms <= frame_ms]
    if not in_time:
        fastest = min(program.points, key=lambda point: point.slowest_ms)
        raise VolprepError(
            "VP7038",
            gpu=record.device.gpu,
            transfer=program.transfer,
            frame_ms=frame_ms,
            fastest=fastest.slowest_ms,
            level=fastest.level,
            step_mm=fastest.step_mm,
        )
    chosen, best = min(in_time, key=_error_then_time), min(program.points, key=_error_then_time)
    return DeviceChoice(transfer=program.transfer, chosen=chosen, best=best, given_up_rmse=chosen.rmse - best.rmse)


def _error_then_time(point: DevicePoint) -> tuple[float, float]:
    return point.rmse, point.draw_ms
