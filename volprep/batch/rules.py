"""A rule file: which scans of a tree get which scene. A scan must match one rule, or the batch does not begin."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Self

from pydantic import Field, ValidationError, field_validator, model_validator

from volprep.batch.facts import Facts
from volprep.batch.jobs import FoundScan
from volprep_formats.diagnostics import Lines, VolprepError
from volprep_formats.path_text import path_of_text
from volprep_formats.record import Record, problems
from volprep_formats.source import SourceFormat
from volprep_formats.toml_file import read_toml_file

_LONGEST_DESCRIPTION = 256
"""Letters that a pattern sees: DICOM allows 64, and a pattern's time may grow fast with the text."""
_SHOWN = 20
"""Scans that a message names."""

Range = tuple[float, float]


class RuleChoice(Record):
    """Settings for a scan."""

    scene: str = ""
    """Scene file; a relative path starts at the folder of the rule file. Empty: that of the command line."""
    profiles: tuple[str, ...] = ()
    """Classes of devices. Empty: the command line's."""
    skip: bool = False
    """Whether these scans are left out."""

    @model_validator(mode="after")
    def _skips_or_chooses(self) -> Self:
        if self.skip and (self.scene or self.profiles):
            msg = "skip leaves the scans out, so scene and profiles say nothing"
            raise ValueError(msg)
        return self


class Rule(RuleChoice):
    """A table [[rule]]. A scan matches it if all conditions hold that are given."""

    name: Annotated[str, Field(min_length=1, max_length=60)]
    """Name of the rule, for messages and --dry-run."""
    modality: tuple[str, ...] = ()
    """DICOM modalities; the scan must have one of them."""
    description: str | None = None
    """Regular expression that is found in the description of the DICOM series, whatever the case of its letters."""
    spacing_mm: Range | None = None
    """Range of the largest of the three voxel spacings (slices, rows, columns)."""
    format: tuple[SourceFormat, ...] = ()
    """Source formats; the scan must have one of them."""
    slices: tuple[int, int] | None = None
    """Smallest and largest number of slices."""

    @field_validator("modality", "format", mode="before")
    @classmethod
    def _one_or_several(cls, value: object) -> object:
        return (value,) if isinstance(value, str) else value

    @field_validator("description")
    @classmethod
    def _is_a_pattern(cls, value: str | None) -> str | None:
        try:
            re.compile(value or "")
        except (re.error, RecursionError, OverflowError) as error:
            msg = f"no regular expression: {error}"
            raise ValueError(msg) from error
        return value

    @field_validator("spacing_mm", "slices")
    @classmethod
    def _ascends(cls, value: Range | None) -> Range | None:
        if value is not None and value[0] > value[1]:
            msg = f"{value[0]:g} is larger than {value[1]:g}"
            raise ValueError(msg)
        return value

    @model_validator(mode="after")
    def _has_a_condition(self) -> Self:
        if not any((self.modality, self.description, self.spacing_mm, self.format, self.slices)):
            msg = "a rule without a condition matches every scan: write [otherwise] for the scans that match no rule"
            raise ValueError(msg)
        return self

    def matches(self, facts: Facts) -> bool:
        """Whether all conditions hold; a condition on a missing header fact does not hold."""
        largest = None if None in facts.spacing_mm_zyx else max(length or 0.0 for length in facts.spacing_mm_zyx)
        slices = None if facts.shape_zyx is None else facts.shape_zyx[0]
        return (
            (not self.modality or facts.modality in self.modality)
            and (not self.format or facts.format in self.format)
            and _lies_in(largest, self.spacing_mm)
            and _lies_in(slices, self.slices)
            and self._describes(facts.description)
        )

    def _describes(self, text: str) -> bool:
        pattern = self.description
        return pattern is None or re.search(pattern, text[:_LONGEST_DESCRIPTION], re.IGNORECASE) is not None


class RuleFile(Record):
    """A rule file."""

    rule: Annotated[tuple[Rule, ...], Field(min_length=1)]
    """Rules. Their order says nothing."""
    otherwise: RuleChoice | None = None
    """Settings for scans that match no rule; if absent, they are refused."""

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        names = [rule.name for rule in self.rule]
        if len(set(names)) < len(names):
            msg = "two rules have the same name"
            raise ValueError(msg)
        return self


@dataclass(frozen=True)
class Rules:
    """A rule file that has been read."""

    path: Path
    content: RuleFile

    def chosen(self, scan: FoundScan) -> "Matched":
        """Return the rules that a scan matches, and the scan with the settings of the only one."""
        facts = scan.facts or Facts("")
        names = tuple(rule.name for rule in self.content.rule if rule.matches(facts))
        choice: RuleChoice | None = next((rule for rule in self.content.rule if rule.name in names), None)
        if not names and self.content.otherwise is not None:
            names, choice = ("otherwise",), self.content.otherwise
        if choice is None or len(names) > 1:
            return Matched(scan, names, skip=False)
        base = self.path.absolute().parent
        scene = base / path_of_text(choice.scene) if choice.scene else None
        profiles = tuple(str(base / profile) if profile.endswith(".toml") else profile for profile in choice.profiles)
        changed = replace(scan, scene=scene, profiles=profiles, rule=names[0])
        return Matched(changed, names, skip=choice.skip)


@dataclass(frozen=True)
class Matched:
    """A scan, and the rules that it matches."""

    scan: FoundScan
    rules: tuple[str, ...]
    """Names of the rules; one, or the batch does not begin."""
    skip: bool
    """Whether its rule leaves it out."""

    @property
    def said(self) -> str:
        """The matched rule in words, for a table."""
        if len(self.rules) == 1:
            return f"{self.rules[0]} (left out)" if self.skip else self.rules[0]
        return f"several: {', '.join(self.rules)}" if self.rules else "none"


def read_rules(path: Path) -> Rules:
    """Read a rule file. Raises VP8040 for an invalid file, VP8042 for a missing scene."""
    try:
        content = RuleFile.model_validate(read_toml_file(path))
    except ValidationError as error:
        raise VolprepError("VP8040", path=path, problem=problems(error)) from error
    except (OSError, ValueError) as error:
        raise VolprepError("VP8040", path=path, problem=getattr(error, "strerror", None) or error) from error
    for choice in (*content.rule, content.otherwise):
        if choice is not None and choice.scene:
            scene = path.absolute().parent / path_of_text(choice.scene)
            if not scene.exists():
                raise VolprepError("VP8042", path=path, file=scene)
    return Rules(path, content)


def require_one_each(matched: Sequence[Matched], rules: Path) -> list[FoundScan]:
    """Return the scans that are not left out. Raises VP8041 if one matches no rule, or several."""
    wrong = [matched for matched in matched if len(matched.rules) != 1]
    if wrong:
        lines = [f"{matched.scan.where}: {matched.said}; {_said(matched.scan.facts)}" for matched in wrong[:_SHOWN]]
        more = [f"and {len(wrong) - _SHOWN} more"] if len(wrong) > _SHOWN else []
        none = sum(not matched.rules for matched in wrong)
        fields = {"none": none, "several": len(wrong) - none, "scans": len(matched)}
        raise VolprepError("VP8041", path=rules, found=Lines([*lines, *more]), **fields)
    return [match.scan for match in matched if not match.skip]


def _said(facts: Facts | None) -> str:
    if facts is None or facts.shape_zyx is None:
        return "its headers say nothing"
    spacing = "×".join("?" if length is None else f"{length:.3g}" for length in facts.spacing_mm_zyx[::-1])
    parts = [facts.format, facts.modality, f"{facts.shape_zyx[0]} slices", f"{spacing} mm"]
    return ", ".join(part for part in parts if part)


def _lies_in(value: float | None, between: Range | None) -> bool:
    return between is None or (value is not None and between[0] <= value <= between[1])
