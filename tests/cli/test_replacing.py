"""A build replaces a package of its own, and says so; one of another scan only with --force."""

from pathlib import Path

import numpy as np
import pytest
from command_line import volprep

from volprep_cli.outputs import default_package


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


def test_a_build_without_a_name_takes_that_of_the_scan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "scans" / "ct.1").mkdir(parents=True)
    (tmp_path / "out").mkdir()
    np.save(tmp_path / "scans" / "head.npy", np.arange(60, dtype=np.uint8).reshape(3, 4, 5))
    built = volprep("build", "../scans/head.npy", cwd=tmp_path / "out")
    assert (built.returncode, "writing head.volpkg; -o PACKAGE names another" in built.stderr) == (0, True)
    assert (tmp_path / "out" / "head.volpkg" / "manifest.json").exists()
    assert not [*(tmp_path / "scans").glob("*.volpkg")]
    np.save(tmp_path / "head.npy", np.arange(60, dtype=np.uint8).reshape(5, 4, 3))
    assert "VP1303" in volprep("build", "../head.npy", cwd=tmp_path / "out").stderr
    monkeypatch.chdir(tmp_path / "out")
    names = {each: str(default_package(Path(each))) for each in ("a/head.nii.gz", "head.toml", "../scans/ct.1", "..")}
    assert names == {
        "a/head.nii.gz": "head.volpkg",
        "head.toml": "head.volpkg",
        "../scans/ct.1": "ct.1.volpkg",
        "..": f"{tmp_path.name}.volpkg",
    }
