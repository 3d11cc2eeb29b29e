"""Whether an item is worth what it costs: from bytes, times, errors and changes, and from nothing else."""

from collections.abc import Sequence

from volprep.parts.values.decision import SHARE
from volprep.validation.ablation.items import Gain
from volprep.validation.ablation.records import AblationRow, Measurement, Outcome, Ratio
from volprep_formats.package.manifest import Tolerance

MOST_CHANGE = 0.5 / 255
"""Half a step of 8 bits: what nobody sees."""
_CLEARLY_FASTER = 0.9
"""What was left out because it does not pay must not make pictures faster by a tenth."""
_LEAST_SAVING = 0.5
"""Part of the next finer level that a level must save an app to upload, if it is not drawn faster."""


def judged_added(
    row: AblationRow, gain: Gain, planned: Measurement, tolerance: Tolerance, *, lossy: bool
) -> AblationRow:
    """Judge what was put in: it must change no view, and, where the plan decides, gain nothing.

    What trades accuracy may change single pixels: of it the root mean square of a view counts. Where that is more than
    anybody sees, but within the part of the tolerance that one decision may take, the scene has allowed the trade.
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
    smaller = gain == "memory" and other.gpu_bytes < planned.gpu_bytes and other.ratio.low <= 1.0
    if row.chosen_by == "plan" and (faster or smaller):
        return _with(row, "wrongly left out", f"{told}, so it would pay")
    return _with(row, "rightly left out", told)


def judged_without(
    row: AblationRow, gain: Gain, planned: Measurement, tolerance: Tolerance, differing: Sequence[str]
) -> AblationRow:
    """Judge what was taken out: validation must fail without it, or what it gains be lost.

    `differing` is what the manifest then says otherwise than the scene.
    """
    other = row.other
    if other is None or other.ratio is None or row.change_rmse is None:
        return row
    if other.rmse > tolerance.rmse or other.maximum > tolerance.maximum:
        return _with(row, "earns its place", f"without it RMSE is {other.rmse:.3g}, which is beyond the tolerance")
    if gain == "time":
        return _with(row, _kept_for_time(other.ratio), f"without it {_time(other)}")
    earns, told = {
        "wish": (
            bool(differing),
            f"the scene asks for it; without it {differing[0]} (VP6031)" if differing else "the package is the same",
        ),
        "memory": (
            other.gpu_bytes > planned.gpu_bytes,
            f"without it GPU memory is {other.gpu_bytes / max(planned.gpu_bytes, 1):.2f} × as much; {_time(other)}",
        ),
        "truth": (
            row.change_rmse > MOST_CHANGE and other.rmse > planned.rmse,
            f"without it a view changes by RMSE {row.change_rmse:.2g}, and RMSE is {other.rmse:.3g}",
        ),
    }[gain]
    return _with(row, _kept_if(earns), told)


def _kept_for_time(without: Ratio) -> Outcome:
    if without.low > 1.0:
        return "earns its place"
    return "does not earn its place" if without.high < 1.0 else "not told apart"


def level_outcome(row: AblationRow, finer: int, upload_bytes: int) -> AblationRow:
    """Judge a coarse level: it must be drawn faster than the next finer one, or save half of what is uploaded."""
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
