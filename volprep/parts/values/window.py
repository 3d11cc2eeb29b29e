"""Windows that are worth trying: the physical values of the smallest and the largest code."""

import math

from volprep.transfer.integral import varied_range
from volprep_formats.package.channel import Statistics
from volprep_formats.package.function_table import Table
from volprep_formats.package.transfer_function import TransferFunction
from volprep_formats.source import SourceInfo

Window = tuple[float, float]

_LARGEST_8_BIT = 255


def visible_range(functions: tuple[TransferFunction, ...]) -> Window | None:
    """Range of the values that at least one function tells apart; None if none tells any."""
    return varied_range([Table.exact(function) for function in functions])


def windows(
    bits: int, info: SourceInfo, statistics: Statistics, functions: tuple[TransferFunction, ...]
) -> list[Window]:
    """List windows, the widest first: all values; the distinguishable ones with a margin; the same without.

    A narrow window has finer codes, but moves surfaces: a voxel that it clips is wrong in every cell that it touches.
    """
    low, high = statistics.minimum, statistics.maximum
    ranges = [(low, high)]
    visible = visible_range(functions)
    if visible is not None:
        width = visible[1] - visible[0]
        inside = [(max(low, visible[0] - margin), min(high, visible[1] + margin)) for margin in (width, 0.0)]
        ranges += [window for window in inside if window[0] < window[1]]
    return list(dict.fromkeys(_coded(window, bits, info, statistics) for window in ranges))


def is_exact(bits: int, window: Window, info: SourceInfo, statistics: Statistics) -> bool:
    """Return whether the window gives every stored value of the source a code of its own, without rounding."""
    whole = statistics.minimum, statistics.maximum
    return _on_steps(whole, bits, info, statistics) is not None and window == _coded(whole, bits, info, statistics)


def _coded(window: Window, bits: int, info: SourceInfo, statistics: Statistics) -> Window:
    """Widen a range of values to a window: each stored value gets a code without rounding, where codes suffice."""
    on_steps = _on_steps(window, bits, info, statistics)
    if on_steps is not None:
        return on_steps
    low, high = window
    # Any width will do for a constant volume, so long as it is not lost in the digits of the value.
    return (low, high) if low < high else (low, low + max(1.0, abs(low) * 1e-3))


def _on_steps(window: Window, bits: int, info: SourceInfo, statistics: Statistics) -> Window | None:
    """Widen a range so that each stored value becomes the same whole number of codes more than the one before."""
    if bits != 8 or info.stored_type == "float32":
        return None
    step = abs(info.slope)
    low = statistics.minimum + math.floor((window[0] - statistics.minimum) / step) * step
    steps = max(1, math.ceil((window[1] - low) / step))
    if steps > _LARGEST_8_BIT:
        return None
    return low, low + _LARGEST_8_BIT / (_LARGEST_8_BIT // steps) * step
