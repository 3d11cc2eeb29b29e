"""Choose the level and step that a device draws in time with the least error, from measurements on it."""

from volprep.plan.device_records import DevicePoint, DeviceProgram, DeviceRecord, NonNegative
from volprep.plan.device_scaling import Canvas, Growth, Interval, growth_of
from volprep_formats.diagnostics import VolprepError
from volprep_formats.record import Record


class DeviceChoice(Record):
    """Level and step for a device, and the error that the time limit adds."""

    transfer: str
    """Name of the transfer function, or of the picture of several channels."""
    chosen: DevicePoint
    """The least error within the time; of equal errors the fastest."""
    chosen_ms: Interval
    """Its time on the canvas."""
    best: DevicePoint
    """The least error of all that was measured."""
    best_ms: Interval
    """Its time on the canvas."""
    growth: Growth
    """How times grow from the measured pictures to the canvas."""

    given_up_rmse: NonNegative
    """Error that the time costs: 0 where nothing is given up."""


class Frame(Record):
    """The requested frame time, and the choices for a device."""

    frame_ms: NonNegative
    """Time that a frame may take, in milliseconds."""
    canvas: Canvas | None
    """Size of the app's picture; None for pictures of the size that was measured."""
    gpu: str
    """Name of the device's GPU."""
    picture_size: int
    """Width and height of the pictures that were measured, in pixels."""
    throttled: bool
    """Whether the device became slower while it was measured."""
    choices: tuple[DeviceChoice, ...]
    """For each transfer function."""


def choose_for_frame(record: DeviceRecord, frame_ms: float, canvas: Canvas | None = None) -> Frame:
    """Choose level and step for each transfer function so that a draw on `canvas` takes at most `frame_ms`.

    The slowest of the times counts. Raises VP7038 where none is so fast.
    """
    return Frame(
        frame_ms=frame_ms,
        canvas=canvas,
        gpu=record.device.gpu,
        picture_size=record.picture_size,
        throttled=record.throttling.throttled,
        choices=tuple(_choice(record, program, frame_ms, canvas) for program in record.programs if program.points),
    )


def _choice(record: DeviceRecord, program: DeviceProgram, frame_ms: float, canvas: Canvas | None) -> DeviceChoice:
    growth = growth_of(program, record.picture_size, canvas)
    in_time = [point for point in program.points if growth.time_ms(point).most <= frame_ms]
    if not in_time:
        fastest = min(program.points, key=lambda point: point.slowest_ms)
        raise VolprepError(
            "VP7038",
            gpu=record.device.gpu,
            transfer=program.transfer,
            frame_ms=frame_ms,
            fastest=growth.time_ms(fastest).most,
            level=fastest.level,
            step_mm=fastest.step_mm,
        )
    chosen, best = min(in_time, key=_error_then_time), min(program.points, key=_error_then_time)
    return DeviceChoice(
        transfer=program.transfer,
        chosen=chosen,
        chosen_ms=growth.time_ms(chosen),
        best=best,
        best_ms=growth.time_ms(best),
        growth=growth,
        given_up_rmse=chosen.rmse - best.rmse,
    )


def _error_then_time(point: DevicePoint) -> tuple[float, float]:
    return point.rmse, point.draw_ms
