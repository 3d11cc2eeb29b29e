"""Lines of the pages that install volprep: it is on no index, so they name the wheel that `make wheel` writes."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


def test_pip_takes_the_wheel_of_make_with_extras_that_exist() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md"), *(ROOT / "formats").rglob("README.md")]
    text = "\n".join(page.read_text() for page in pages)
    installed = re.findall(r"pip install\s([^`#]*volprep[^`#]*)", text)
    assert len(installed) >= 3
    for line in installed:
        wheel, extras = re.fullmatch(r'"\$\(ls\s(\S+)\)\[([\w,]+)\]"\s*', line).groups()
        assert wheel == "dist/volprep-*.whl"
        assert EXTRAS.keys() >= set(extras.split(","))
    assert "dist/volprep-*.whl" in (ROOT / "tools" / "wheel.sh").read_text()
