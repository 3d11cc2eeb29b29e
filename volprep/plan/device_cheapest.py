"""Choose for each device the cheapest measured package that is near enough to the scan and drawn in time.

This inverts the plan: an error and a frame time give profile, level, step and form. Only packages that were measured
on the device are candidates.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from volprep.plan.device_records import DevicePoint, DeviceProgram, DeviceRecord, NonNegative
from volprep.plan.device_scaling import Canvas, Interval, growth_of
from volprep_formats.package.values import ByteCount
from volprep_formats.record import Record


class CheapestDraw(Record):
    """Level and step for one transfer function."""

    transfer: str
    """Name of the transfer function, or of the picture of several channels."""
    level: int
    """Level to draw."""
    step_mm: float
    """Distance of the samples."""
    form: str
    """Technique, and format of the textures with the voxels."""
    upload_bytes: ByteCount
    """Bytes that an app uploads to draw the level."""
    gpu_bytes: ByteCount
    """Memory that they take on the GPU."""
    seen_rmse: NonNegative
    """Measured error over seen pixels."""
    time_ms: Interval
    """Time of a draw on the canvas."""
    proportional: bool
    """Whether only one size of picture was measured, so that the time is an upper estimate."""


class CheapestPackage(Record):
    """A package that was measured on a device, and how it is drawn."""

    name: str
    """Name of the scene."""
    profile: str
    """Class of devices that it was built for."""
    manifest_sha256: str
    """Digest of its manifest."""
    draws: tuple[CheapestDraw, ...]
    """For each transfer function."""

    @property
    def cost(self) -> tuple[int, float, float]:
        """Bytes of the largest picture, then its error, then its time: of two packages the lesser one is cheaper."""
        draws = self.draws
        time = max(draw.time_ms.expected for draw in draws)
        return max(draw.upload_bytes for draw in draws), max(draw.seen_rmse for draw in draws), time


class DeviceAnswer(Record):
    """The cheapest package for one device."""

    gpu: str
    """Name of the GPU."""
    browser: str
    """Name and version of the browser."""
    platform: str
    """Operating system."""
    measured: int
    """Number of packages that were measured on it."""
    package: CheapestPackage | None
    """The cheapest package; None if none fits."""
    reason: str
    """Why none fits; empty if one does."""
    throttled: bool
    """Whether the device became slower while it was measured."""


class CheapestFrame(Record):
    """The wishes, and the answer for each device."""

    frame_ms: NonNegative
    """Time that a frame may take, in milliseconds."""
    canvas: Canvas | None
    """Size of the app's picture; None for pictures of the size that was measured."""
    seen_rmse: NonNegative
    """Largest error over seen pixels."""
    devices: tuple[DeviceAnswer, ...]
    """One for each device, in order of their names."""


@dataclass(frozen=True)
class DeviceLimits:
    """The limits that a package must keep."""

    frame_ms: float
    """Time that a frame may take, in milliseconds; the slowest of the times counts."""
    seen_rmse: float
    """Largest error over seen pixels."""
    canvas: Canvas | None = None
    """Size of the app's picture; None for pictures of the size that was measured."""


@dataclass(frozen=True)
class _Candidate:
    record: DeviceRecord
    program: DeviceProgram
    point: DevicePoint
    time_ms: Interval
    proportional: bool

    def fits(self, wish: DeviceLimits) -> bool:
        return self.point.seen_rmse <= wish.seen_rmse and self.time_ms.most <= wish.frame_ms

    @property
    def draw(self) -> CheapestDraw:
        level = {level.level: level for level in self.program.levels}[self.point.level]
        return CheapestDraw(
            transfer=self.program.transfer,
            level=level.level,
            step_mm=self.point.step_mm,
            form=level.form,
            upload_bytes=level.upload_bytes,
            gpu_bytes=level.gpu_bytes,
            seen_rmse=self.point.seen_rmse,
            time_ms=self.time_ms,
            proportional=self.proportional,
        )


def cheapest(records: Iterable[DeviceRecord], wish: DeviceLimits) -> CheapestFrame:
    """Choose the cheapest package for each device of `records`, which are measurements of packages of one scan."""
    devices: dict[tuple[str, ...], list[DeviceRecord]] = {}
    for record in records:
        # Not by the API: one device draws packages of OpenGL ES 2 with WebGL 1, and others with WebGL 2.
        names = (record.device.gpu, record.device.vendor, record.device.browser, record.device.platform)
        devices.setdefault(names, []).append(record)
    answers = tuple(_answer(devices[names], wish) for names in sorted(devices))
    return CheapestFrame(frame_ms=wish.frame_ms, canvas=wish.canvas, seen_rmse=wish.seen_rmse, devices=answers)


def _answer(records: Sequence[DeviceRecord], wish: DeviceLimits) -> DeviceAnswer:
    packages: dict[str, list[CheapestPackage | None]] = {}
    for record in records:
        packages.setdefault(record.package.manifest_sha256, []).append(_package(record, wish))
    # A package that was measured several times must fit each time: the luckiest measurement proves nothing.
    fitting = [max(found, key=_cost) for package in packages.values() if (found := _all_of(package))]
    package = min(fitting, key=_cost, default=None)
    device = records[0].device
    return DeviceAnswer(
        gpu=device.gpu,
        browser=device.browser,
        platform=device.platform,
        measured=len(packages),
        package=package,
        reason="" if package else _why_none(records, wish),
        throttled=any(record.throttling.throttled for record in records),
    )


def _all_of(found: Sequence[CheapestPackage | None]) -> list[CheapestPackage]:
    """Return the choices of all measurements of a package; none if one of them has no choice."""
    there = [package for package in found if package is not None]
    return there if len(there) == len(found) else []


def _cost(package: CheapestPackage) -> tuple[int, float, float]:
    return package.cost


def _package(record: DeviceRecord, wish: DeviceLimits) -> CheapestPackage | None:
    """Return the cheapest draws of a measured package; None if one of its transfer functions has none that fits."""
    draws = [
        min(
            (candidate.draw for candidate in _candidates(record, program, wish) if candidate.fits(wish)),
            key=lambda draw: (draw.upload_bytes, draw.seen_rmse, draw.time_ms.expected),
            default=None,
        )
        for program in record.programs
    ]
    found = tuple(draw for draw in draws if draw is not None)
    if len(found) < len(draws):
        return None
    measured = record.package
    return CheapestPackage(
        name=measured.name, profile=measured.profile, manifest_sha256=measured.manifest_sha256, draws=found
    )


def _candidates(record: DeviceRecord, program: DeviceProgram, wish: DeviceLimits) -> Iterator[_Candidate]:
    growth = growth_of(program, record.picture_size, wish.canvas)
    for point in program.points:
        yield _Candidate(record, program, point, growth.time_ms(point), growth.proportional)


def _why_none(records: Sequence[DeviceRecord], wish: DeviceLimits) -> str:
    """Say which draw comes nearest to the wish; of each package the transfer function that binds counts."""
    binding = [found for record in records if (found := _binding(record, wish)) is not None]
    late = [program for program in binding if program.point.seen_rmse <= wish.seen_rmse]
    if late:
        fastest = min(late, key=lambda candidate: candidate.time_ms.most)
        return f"the fastest with this error takes up to {fastest.time_ms.most:.5g} ms ({_told(fastest)})"
    if binding:
        best = min(binding, key=lambda candidate: candidate.point.seen_rmse)
        return f"the least error is {best.point.seen_rmse:.3g} ({_told(best)})"
    return "nothing was timed: " + (
        next((told for record in records for told in record.left_out), "no reason is given")
    )


def _binding(record: DeviceRecord, wish: DeviceLimits) -> _Candidate | None:
    """Return the least error that is too large, else the fastest draw that is too slow; None if nothing misses."""
    programs = [[*_candidates(record, program, wish)] for program in record.programs if program.points]
    missed = [candidates for candidates in programs if not any(candidate.fits(wish) for candidate in candidates)]
    near = [
        [candidate for candidate in candidates if candidate.point.seen_rmse <= wish.seen_rmse] for candidates in missed
    ]
    if not all(near):
        wrong = [
            min(program, key=lambda one: one.point.seen_rmse)
            for program, some in zip(missed, near, strict=True)
            if not some
        ]
        return max(wrong, key=lambda candidate: candidate.point.seen_rmse)
    slow = [min(candidates, key=lambda one: one.time_ms.most) for candidates in near]
    return max(slow, key=lambda candidate: candidate.time_ms.most, default=None)


def _told(candidate: _Candidate) -> str:
    point = candidate.point
    profile, transfer = candidate.record.package.profile, candidate.program.transfer
    return f"{profile}, {transfer}, level {point.level}, step {point.step_mm:.3g} mm"
