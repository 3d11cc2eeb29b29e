"""Windows that are worth trying: which physical values the smallest and the largest code may stand for."""

from itertools import pairwise

from volprep_formats.package.manifest import Statistics
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.source import SourceInfo

Window = tuple[float, float]

_LARGEST_8_BIT = 255


def visible_range(functions: tuple[TransferFunction, ...]) -> Window | None:
    """Range of the values that at least one function tells apart; None if none tells any."""
    ends = [
        (lower.value, upper.value)
        for function in functions
        for lower, upper in pairwise(function.points)
        if not _same_picture(lower, upper)
    ]
    if not ends:
        return None
    return min(low for low, _ in ends), max(high for _, high in ends)


def windows(
    bits: int, info: SourceInfo, statistics: Statistics, functions: tuple[TransferFunction, ...]
) -> list[Window]:
    """List windows, the widest first: all values; those that are told apart, with a margin; those without.

    A narrow window has finer codes, but moves surfaces: a voxel that it clips is wrong in every cell that it
    touches. All windows lie inside the range of the data.
    """
    low, high = statistics.minimum, statistics.maximum
    found = [_whole_range(bits, info, statistics)]
    visible = visible_range(functions)
    if visible is not None:
        width = visible[1] - visible[0]
        inside = [(max(low, visible[0] - margin), min(high, visible[1] + margin)) for margin in (width, 0.0)]
        found += [window for window in inside if window[0] < window[1] and window not in found]
    return found


def is_exact(bits: int, window: Window, info: SourceInfo, statistics: Statistics) -> bool:
    """Say whether the window gives every stored value of the source a code of its own, without rounding."""
    return bits == 8 and _steps(info, statistics) is not None and window == _whole_range(bits, info, statistics)


def _whole_range(bits: int, info: SourceInfo, statistics: Statistics) -> Window:
    low, high = statistics.minimum, statistics.maximum
    steps = _steps(info, statistics)
    if bits == 8 and steps is not None:
        # Each stored value becomes the same whole number of codes more than the one before.
        codes_per_step = _LARGEST_8_BIT // max(1, steps)
        return low, low + _LARGEST_8_BIT / codes_per_step * abs(info.slope)
    if low == high:
        # Any width will do for a constant volume, so long as it is not lost in the digits of the value.
        return low, low + max(1.0, abs(low) * 1e-3)
    return low, high


def _steps(info: SourceInfo, statistics: Statistics) -> int | None:
    """Stored values above the smallest, where each of them can have an 8-bit code of its own."""
    if info.stored_type == "float32":
        return None
    steps = round((statistics.maximum - statistics.minimum) / abs(info.slope))
    return steps if steps <= _LARGEST_8_BIT else None


def _same_picture(lower: TransferPoint, upper: TransferPoint) -> bool:
    invisible = lower.extinction_per_mm == upper.extinction_per_mm == 0.0
    return invisible or (lower.colour == upper.colour and lower.extinction_per_mm == upper.extinction_per_mm)
