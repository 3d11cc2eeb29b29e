"""A planted bug: one text of one file replaced by another."""

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Mutant:
    """A bug, its place, and the scene and tests to try it on."""

    name: str
    says: str
    """The fault, for people."""
    file: str
    """Path from the root of the checkout."""
    anchor: str
    """Text that occurs once in the file."""
    instead: str
    scene: str
    """A scene of tests/support/foreign_scans.py, which is built and validated."""
    tests: tuple[str, ...]
    """Tests that should fail, FILE, FILE::TEST or FILE::TEST[CASE]; short ones, since each runs twice."""
    anchors: int = 1
    """How often the anchor occurs; all are replaced."""

    @property
    def is_native(self) -> bool:
        """Whether it takes a build."""
        return self.file.startswith("volprep/native")

    def missing_tests(self) -> list[str]:
        """Return the tests that do not exist."""
        return [test for test in self.tests if not _exists(test)]

    def text(self) -> str:
        """Return the file with the bug. Raises ValueError if the anchor does not occur as often as it should."""
        before = (ROOT / self.file).read_text(encoding="utf-8")
        if (found := before.count(self.anchor)) != self.anchors:
            msg = f"{self.name}: the anchor occurs {found} times in {self.file}, not {self.anchors}"
            raise ValueError(msg)
        return before.replace(self.anchor, self.instead)


def _exists(test: str) -> bool:
    file, _, name = test.partition("::")
    path = ROOT / file
    *classes, function = name.partition("[")[0].split("::")
    said = f"\n{'    ' * len(classes)}def {function}("
    return path.is_file() and (not name or said in path.read_text(encoding="utf-8"))
