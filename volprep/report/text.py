"""Number formatting in reports: three significant digits, units, no exponents that a reader has to decode."""

from math import floor, log10

from volprep.validation.results.seen import SeenNumbers

_CERTAIN = 0.05
"""Uncertainty of kept light up to which only its value is printed."""


def number(value: float, digits: int = 3) -> str:
    """Write `value` with `digits` significant digits; below 0.0001 as a power of ten."""
    if value == 0:
        return "0"
    magnitude = floor(log10(abs(value)))
    if magnitude < -4:
        mantissa = f"{value / 10.0**magnitude:.{digits - 1}f}"
        return f"{mantissa}·10{_superscript(magnitude)}"
    return f"{value:,.{max(0, digits - 1 - magnitude)}f}".replace(",", " ")


def error(value: float, bound: float) -> str:
    """Write an error that is known up to `bound`: below it, only that it is below."""
    return number(value) if value >= bound or value == 0 else f"< {plain(bound)}"


def plain(value: float) -> str:
    """Write a number that the user chose, such as a tolerance, with no more digits than the user typed."""
    digits = f"{value:g}"
    if "e" not in digits:
        return digits
    mantissa, exponent = digits.split("e")
    power = f"10{_superscript(int(exponent))}"
    return power if mantissa == "1" else f"{mantissa}·{power}"


def kept_light(seen: SeenNumbers) -> str:
    """Write the least kept light of a view, and how much it may be where it is uncertain; a dash without things."""
    if seen.kept_light is None or seen.kept_light_at_most is None:
        return "–"
    at_most = f" to {seen.kept_light_at_most:.2f}" if seen.kept_light_at_most - seen.kept_light >= _CERTAIN else ""
    return f"{seen.kept_light:.2f}{at_most}"


def size(count: int) -> str:
    """Write a number of bytes in B, kB, MB or GB (powers of 1000)."""
    if count < 1000:
        return f"{count} B"
    value, unit = count / 1000, "kB"
    for larger in ("MB", "GB"):
        if value >= 999.5:
            value, unit = value / 1000, larger
    return f"{number(value)} {unit}"


def ratio(value: float) -> str:
    """Write a factor as 4×, 1× or 1⁄8×."""
    if value >= 1:
        return f"{value:g}×"
    return f"1⁄{1 / value:g}×"


def decibel(value: float | None) -> str:
    """Write a peak signal to noise ratio; ∞ where the pictures are the same."""
    return "∞" if value is None else f"{value:.1f}"


def seconds(value: float) -> str:
    """Write a time in seconds, or in minutes and seconds."""
    if value < 60:
        return f"{number(value)} s"
    minutes, rest = divmod(round(value), 60)
    return f"{minutes} min {rest} s"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
