"""Measurements of a package on devices, for the report: one curve for each device, and a table."""

from collections.abc import Sequence
from dataclasses import dataclass

from volprep.plan.device_records import DevicePoint, DeviceProgram, DeviceRecord
from volprep.report.canvas import Plot
from volprep.report.plots import DeviceCurve, curves_against_time
from volprep.validation.results.report import Report
from volprep_formats.shown import shown

_LONGEST_LABEL = 30
"""Letters of a name in a legend, which has three in a row."""


@dataclass(frozen=True)
class DeviceRow:
    """One device with one transfer function."""

    record: DeviceRecord
    """Measured value."""
    nominal: DevicePoint | None
    """The finest level with the step that is nearest to the nominal one; None if nothing was timed."""
    worst_view: str
    """Standard view with the largest error."""
    worst_rmse: float | None
    """Its error; None if no view was drawn."""
    unsteady: int
    """Number of points whose times vary too much to be shown without a mark."""


@dataclass(frozen=True)
class DevicePart:
    """Measurements of one program on devices."""

    transfer: str
    """Name of the transfer function."""
    plot: Plot
    """Error against time, a curve for each device."""
    rows: tuple[DeviceRow, ...]
    """One for each device."""


def device_parts(report: Report) -> tuple[DevicePart, ...]:
    """Return the report's section for each program that a device has measured."""
    parts = []
    for program in report.programs:
        found = [
            (record, each) for record in report.devices for each in record.programs if each.transfer == program.transfer
        ]
        if found:
            curves = [_curve(_label(record), measured.points) for record, measured in found]
            plot = curves_against_time(curves, report.tolerance.rmse)
            parts.append(
                DevicePart(program.transfer, plot, tuple(_row(record, measured) for record, measured in found))
            )
    return tuple(parts)


def _label(record: DeviceRecord) -> str:
    """Return the names of a device as a legend takes them."""
    return ", ".join(shown(text, _LONGEST_LABEL) for text in (record.device.gpu, record.device.browser))


def _curve(label: str, points: Sequence[DevicePoint]) -> DeviceCurve:
    """Return the points that no other beats in time and in error, as a curve, and the other points."""
    front: list[DevicePoint] = []
    for point in sorted(points, key=lambda point: (point.draw_ms, point.rmse)):
        if not front or point.rmse < front[-1].rmse:
            front.append(point)
    beaten = [point for point in points if point not in front]
    return DeviceCurve(label, _places(front), _places(beaten))


def _places(points: Sequence[DevicePoint]) -> tuple[tuple[float, float], ...]:
    """Return time and error of points that have a place on logarithmic axes."""
    return tuple((point.draw_ms, point.rmse) for point in points if point.draw_ms > 0 and point.rmse > 0)


def _row(record: DeviceRecord, program: DeviceProgram) -> DeviceRow:
    worst = max(program.views, key=lambda view: view.rmse, default=None)
    return DeviceRow(
        record=record,
        nominal=min(program.finest, key=lambda point: abs(point.step_mm - record.package.step_mm), default=None),
        worst_view="" if worst is None else worst.view,
        worst_rmse=None if worst is None else worst.rmse,
        unsteady=sum(not point.steady for point in program.points),
    )
