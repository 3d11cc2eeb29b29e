"""Frames of a time series: volumes on one grid; the first represents the channel."""

from pathlib import Path

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.picture import MOST_FRAMES, SeriesFrame
from volprep_formats.readers import time_axis_of
from volprep_formats.source import SourceInfo, SourceSpec

UNTIMED = "the file does not say when its frames were taken; they have numbers only"
"""Remark about a series without times."""


def frames_of(spec: SourceSpec) -> tuple[tuple[SourceSpec, SeriesFrame], ...]:
    """Return the source and the time of each frame of a series; nothing for one volume.

    Raises the errors of `time_axis_of`, and VP1341 if no frame is chosen, or too many.
    """
    if spec.frames is None:
        return ()
    axis = time_axis_of(spec, Path("/"))
    numbers = spec.frame_numbers(axis.count)
    if not 1 <= len(numbers) <= MOST_FRAMES:
        told = {"wanted": spec.frames, "chosen": len(numbers), "count": axis.count, "most": MOST_FRAMES}
        raise VolprepError("VP1341", path=spec.path, **told)
    times = axis.times_s
    return tuple(
        (spec.at_frame(number), SeriesFrame(time_s=None if times is None else times[number - 1])) for number in numbers
    )


def require_same_voxels(path: str, number: int, frame: SourceInfo, first: SourceInfo) -> None:
    """Raise VP1342 if a frame has another grid, type or scale than the first one."""
    for field in ("grid", "stored_type", "slope", "intercept"):
        one, other = getattr(frame, field), getattr(first, field)
        if one != other:
            raise VolprepError("VP1342", path=path, number=number, difference=f"{field} is {one} instead of {other}")
