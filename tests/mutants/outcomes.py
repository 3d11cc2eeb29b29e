"""What a run of planted bugs found, as JSON and as a table. All of it belongs to one commit."""

import json
import subprocess
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from .catalogue import MUTANTS
from .mutant import ROOT


@dataclass(frozen=True)
class Outcome:
    """Who found a bug."""

    name: str
    says: str
    file: str
    validate: bool
    witness: bool
    """`validate --witness`: the verdict or the witness."""
    tests: bool
    said: str
    """What verdict or witness named."""
    failed: str
    """The test that failed first."""
    seconds: float

    @property
    def row(self) -> str:
        """Its row of the table."""
        marks = ("found" if each else "–" for each in (self.validate, self.witness, self.tests))
        return f"| {self.name} | {self.says} | {' | '.join(marks)} |"


@dataclass
class Run:
    """Results so far. Scenes and tests without a bug have an empty text if nothing was found there."""

    commit: str
    scenes: dict[str, str] = field(default_factory=dict)
    tests: dict[str, str] = field(default_factory=dict)
    outcomes: dict[str, Outcome] = field(default_factory=dict)

    @classmethod
    def read(cls, file: Path) -> "Run":
        """Read what `write` has written."""
        record = json.loads(file.read_text(encoding="utf-8"))
        outcomes = {each["name"]: Outcome(**each) for each in record["outcomes"]}
        return cls(record["commit"], record["scenes"], record["tests"], outcomes)

    @classmethod
    def merged(cls, runs: Sequence["Run"]) -> "Run":
        """Put runs together, later ones replacing earlier ones. Raises ValueError if they are of several commits."""
        commits = {each.commit for each in runs}
        if len(commits) > 1:
            msg = f"the runs are of several commits: {', '.join(sorted(commits))}"
            raise ValueError(msg)
        found = cls(commits.pop())
        for each in runs:
            found.scenes |= each.scenes
            found.tests |= each.tests
            found.outcomes |= each.outcomes
        return found

    @property
    def without_bugs(self) -> tuple[str, ...]:
        """A line for each scene and test that finds something although there is no bug."""
        scenes = (f"the scene {scene} is not proved: {why}" for scene, why in self.scenes.items() if why)
        return (*scenes, *(f"a test fails: {why}" for why in self.tests.values() if why))

    @property
    def is_good(self) -> bool:
        """Whether tests find each bug that was tried, and nothing without a bug."""
        return all(each.tests for each in self.outcomes.values()) and not self.without_bugs

    def write(self, folder: Path, suffix: str = "") -> None:
        """Write JSON and table into `folder`."""
        folder.mkdir(parents=True, exist_ok=True)
        outcomes = self.in_order()
        record = {
            "commit": self.commit,
            "count": len(outcomes),
            "found": dict(zip(_COLUMNS, _counts(outcomes), strict=True)),
            "without_bugs": self.without_bugs,
            "scenes": self.scenes,
            "tests": self.tests,
            "outcomes": [asdict(each) for each in outcomes],
        }
        (folder / f"mutants{suffix}.json").write_text(json.dumps(record, indent=2) + "\n", encoding="utf-8")
        (folder / f"mutants{suffix}.md").write_text(table_of(outcomes), encoding="utf-8")

    def in_order(self) -> list[Outcome]:
        """Return the outcomes in the order of the catalogue."""
        return [self.outcomes[each.name] for each in MUTANTS if each.name in self.outcomes]


_COLUMNS = ("validate", "witness", "tests")


def _counts(outcomes: Iterable[Outcome]) -> tuple[int, ...]:
    listed = [*outcomes]
    return tuple(sum(getattr(each, name) for each in listed) for name in _COLUMNS)


def table_of(outcomes: Sequence[Outcome]) -> str:
    """Return the table, with the counts below."""
    head = ["| bug | the fault | validate | validate --witness | tests |", "|---|---|---|---|---|"]
    last = f"| **{len(outcomes)}** | | {' | '.join(f'**{count}**' for count in _counts(outcomes))} |"
    return "\n".join([*head, *(each.row for each in outcomes), last]) + "\n"


def commit_of_checkout() -> str:
    """Return the commit of the checkout, with "-changed" if a file differs from it; "unknown" without git."""
    try:
        commit, changed = (_git("rev-parse", "HEAD"), _git("status", "--porcelain", "--untracked-files=no"))
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return commit[:12] + ("-changed" if changed else "")


def _git(*arguments: str) -> str:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return done.stdout.strip()
