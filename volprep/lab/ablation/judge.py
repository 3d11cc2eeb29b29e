"""Judge whether an item is worth its cost, only from bytes, times, errors and changes."""

from collections.abc import Sequence

from volprep.lab.ablation.records import AblationRow, Measurement, Outcome, Ratio
from volprep.parts.ablation import Gain
from volprep.plan.probe import SHARE
from volprep_formats.package.manifest import Tolerance

MOST_CHANGE = 0.5 / 255
"""Half a step of 8 bits: an invisible difference."""
_CLEARLY_FASTER = 0.9
"""Items left out as not worth their cost must not make pictures faster by a tenth."""
_LEAST_TRANSPORT = 0.95
"""Items left out as not worth their cost must not save a twentieth of the bytes on the network."""
_LEAST_SAVING = 0.5
"""Part of the next finer level that a level must save an app to upload, if it is not drawn faster."""


def judged_added(
    row: AblationRow, gain: Gain, planned: Measurement, tolerance: Tolerance, *, lossy: bool
) -> AblationRow:
    """Judge an item that was put in: it must change no view and, where the plan decides, gain nothing.

    An item that trades accuracy may change single pixels: the root mean square of a view counts. If that is visible,
    but within the part of the tolerance that one decision may take, the scene has allowed the trade.
    """
    change, other = row.change_rmse if lossy else row.change_maximum, row.other
    if change is None or other is None or other.ratio is None:
        return row
    told = f"with it a view changes by {'RMSE' if lossy else 'at most'} {change:.2g}; {_time(other)}"
    if change > MOST_CHANGE:
        allowed = SHARE * tolerance.rmse
        if lossy and change <= allowed:
            return _with(row, "traded for bytes", f"{told}; the scene allows RMSE {allowed:.2g} for one decision")
        return _with(row, "wrongly left out", f"{told}; {MOST_CHANGE:.2g} is allowed")
    faster = other.ratio.high < _CLEARLY_FASTER
    saved = {
        "memory": other.gpu_bytes < planned.gpu_bytes,
        "transport": other.transport_bytes < _LEAST_TRANSPORT * planned.transport_bytes,
    }
    smaller = saved.get(gain, False) and other.ratio.low <= 1.0
    if row.chosen_by == "plan" and (faster or smaller):
        return _with(row, "wrongly left out", f"{told}, so it would pay")
    return _with(row, "rightly left out", told)


def judged_without(
    row: AblationRow, gain: Gain, planned: Measurement, tolerance: Tolerance, differing: Sequence[str]
) -> AblationRow:
    """Judge an item that was taken out: without it, validation must fail or its gain must be lost.

    `differing` lists how the variant's manifest differs from the scene.
    """
    other = row.other
    if other is None or other.ratio is None or row.change_rmse is None:
        return row
    beyond = _newly_beyond(other, planned, tolerance)
    if beyond:
        return _with(row, "earns its place", f"without it {beyond}; with it, it is within the tolerance")
    if gain == "time":
        return _with(row, _kept_for_time(other.ratio), f"without it {_time(other)}")
    earns, told = {
        "wish": (
            bool(differing),
            f"the scene asks for it; without it {differing[0]} (VP6031)" if differing else "the package is the same",
        ),
        "memory": (
            other.gpu_bytes > planned.gpu_bytes,
            f"without it, {other.gpu_bytes / max(planned.gpu_bytes, 1):.2f} times the GPU memory; {_time(other)}",
        ),
        "transport": (
            other.transport_bytes > planned.transport_bytes,
            (
                "without it the bytes sent over the network are "
                f"{other.transport_bytes / max(planned.transport_bytes, 1):.2f} times as large"
            ),
        ),
        "truth": (
            row.change_rmse > MOST_CHANGE and other.rmse > planned.rmse,
            f"without it a view changes by RMSE {row.change_rmse:.2g}, and RMSE is {other.rmse:.3g}",
        ),
    }[gain]
    return _with(row, _kept_if(earns), told)


def _newly_beyond(other: Measurement, planned: Measurement, tolerance: Tolerance) -> str:
    """Name the errors that are beyond the tolerance without an item, and within it with the item; empty if none is."""
    errors = (
        ("RMSE over seen pixels", other.rmse, planned.rmse, tolerance.rmse),
        ("the largest error", other.maximum, planned.maximum, tolerance.maximum),
    )
    return " and ".join(
        f"{name} is {without:.3g}, {allowed:g} is allowed"
        for name, without, with_it, allowed in errors
        if without > allowed >= with_it
    )


def _kept_for_time(without: Ratio) -> Outcome:
    if without.low > 1.0:
        return "earns its place"
    return "does not earn its place" if without.high < 1.0 else "not distinguishable"


def level_outcome(row: AblationRow, finer: int, upload_bytes: int) -> AblationRow:
    """Judge a coarse level: it must be drawn faster than the next finer one, or save half of the uploaded bytes."""
    other = row.other
    if other is None or other.ratio is None:
        return row
    saved = 1 - upload_bytes / max(other.upload_bytes, 1)
    more = other.upload_bytes / max(upload_bytes, 1)
    told = f"without it an app draws level {finer}: {_time(other)}, and the upload is {more:.1f} × as large"
    return _with(row, "earns its place" if saved >= _LEAST_SAVING else _kept_for_time(other.ratio), told)


def table_outcome(row: AblationRow, own: float, common: float) -> AblationRow:
    """Judge a level's own table: with the common one pictures must be further from the scan."""
    told = f"with the common table the level has RMSE {common:.3g} over all views in place of {own:.3g}"
    return _with(row, _kept_if(common > own), told)


def _kept_if(earns: bool) -> Outcome:
    return "earns its place" if earns else "does not earn its place"


def _with(row: AblationRow, outcome: Outcome, finding: str) -> AblationRow:
    return row.model_copy(update={"outcome": outcome, "finding": finding})


def _time(other: Measurement) -> str:
    ratio = other.ratio
    if ratio is None:
        return "the time is not known"
    return f"a picture takes {ratio.median:.2f} × the time (quartiles {ratio.low:.2f} to {ratio.high:.2f})"
