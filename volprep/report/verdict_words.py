"""The last lines of a verdict: levels within, losses of each coarse level, and parts that no witness has read."""

from collections.abc import Iterator, Sequence

from volprep.validation.verdicts.outcomes import FinestOutcome, LevelOutcome
from volprep.validation.verdicts.verdict import Verdict

SEEN_FROM = {
    "anterior": "seen from the front",
    "posterior": "seen from behind",
    "left": "seen from the patient's left",
    "right": "seen from the patient's right",
    "superior": "seen from above",
    "inferior": "seen from below",
    "anterior-left": "oblique, from the front left above",
    "anterior-right": "oblique, from the front right above",
    "posterior-left": "oblique, from behind left below",
}
"""Words for the standard views."""
_MOST_NAMES = 5


def verdict_lines(verdict: Verdict) -> list[str]:
    """Return what a person would say of the package: a line for each picture, and one about witnesses."""
    return [*_of_levels(verdict), _of_witnesses(verdict)]


def unsound_levels(verdict: Verdict) -> str:
    """Return the coarse levels that are beyond their tolerance or have lost something; empty without any."""
    return "; ".join(_of_level(level) for level in verdict.levels if not level.is_sound)


def _of_levels(verdict: Verdict) -> Iterator[str]:
    named = len({level.transfer for level in verdict.finest}) > 1
    for finest in verdict.finest:
        told = [_of_finest(finest)]
        told += [_of_level(level) for level in verdict.levels if level.transfer == finest.transfer]
        yield (f"{finest.transfer}: " if named else "") + "; ".join(told)


def _of_finest(finest: FinestOutcome) -> str:
    drawn = f"level {finest.level}" if finest.bound is None else "level 0 from bricks"
    told = f"beyond in {finest.beyond} of {finest.views} views" if finest.beyond else "within"
    missing = f", {finest.bound:.2g} stated for bricks that the device has no room for" if finest.bound else ""
    return f"{drawn} {told}{missing}"


def _seen_from(view: str) -> str:
    """Return words for a view; its name if it is none of the standard views."""
    return SEEN_FROM.get(view, view)


def _of_level(level: LevelOutcome) -> str:
    losses = [*_losses(level)]
    told = f"loses {' and '.join(losses)}" if losses else "within" if level.within else "beyond"
    usable = f"usable to {level.right_up_to_pixels} pixels" if level.right_up_to_pixels else "right at no measured size"
    return f"level {level.level} {told}; {usable}"


def _losses(level: LevelOutcome) -> Iterator[str]:
    if level.structures is not None:
        lost = level.structures
        counts = [
            _count(number, kind)
            for number, kind in ((lost.thin, "thin structure"), (lost.small, "small thing"))
            if number
        ]
        kept = f"{lost.kept_light:.2f}" if lost.kept_light >= 0.005 else "none"
        which = "its" if lost.thin + lost.small == 1 else "the light of one"
        of = f"{kept} of {which} light" if which == "its" else f"{kept} of {which} is left"
        yield f"{' and '.join(counts)} ({of}, {_seen_from(lost.view)})"
    if level.contrast is not None:
        yield f"up to {level.contrast.loss:.2f} of local contrast ({_seen_from(level.contrast.view)})"
    if level.segments:
        yield f"{len(level.segments)} of {level.visible_segments} segments ({_some(level.segments)})"
    if level.parts:
        yield f"parts of {_some(level.parts)}"


def _of_witnesses(verdict: Verdict) -> str:
    if verdict.unwitnessed is None:
        return "no witness was asked: `volprep validate --witness` lets VTK and independent readers judge"
    if not verdict.unwitnessed:
        return "all of it was witnessed"
    return f"not witnessed: {'; '.join(verdict.unwitnessed)}"


def _count(number: int, kind: str) -> str:
    return f"{number} {kind}" if number == 1 else f"{number} {kind}s"


def _some(names: Sequence[str]) -> str:
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
