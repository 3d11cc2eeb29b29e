"""A build replaces a package of its own, and says so; one of another scan only with --force."""

from pathlib import Path

import numpy as np
import pytest
from command_line import volprep


@pytest.mark.long
def test_a_build_replaces_its_own_package_and_no_other(tmp_path: Path) -> None:
    for name in ("a", "b"):
        np.save(tmp_path / f"{name}.npy", np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
    package = tmp_path / "x.volpkg"
    first = volprep("build", tmp_path / "a.npy", "-o", package)
    assert "replaced" not in first.stderr
    again = volprep("build", tmp_path / "a.npy", "-o", package)
    assert (again.returncode, "replaced the package" in again.stderr) == (0, True)
    other = volprep("build", tmp_path / "b.npy", "-o", package)
    assert other.returncode == 6
    assert "VP1303" in other.stderr
    forced = volprep("build", tmp_path / "b.npy", "-o", package, "--force", "-q")
    assert (forced.returncode, forced.stderr) == (0, "")
