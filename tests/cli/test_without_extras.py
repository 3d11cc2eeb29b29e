"""volprep where only the packages are installed that a wheel needs, and no extra."""

import importlib.util
import json
import os
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import numpy as np
import pytest
from command_line import ended
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from phantom_scene import write_phantom_scene

from volprep_formats.installation import EXTRAS

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
BLOCK = """\
import os
import sys

sys.modules.update(dict.fromkeys(os.environ["BLOCKED_MODULES"].split(",")))
"""
"""`sitecustomize` of the process and of its workers: importing one of these modules fails as if it were missing."""
RUN = """
import contextlib, io, json, sys, traceback
from volprep_cli.main import command_line

def run(arguments):
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said):
            command_line(arguments)(arguments, standalone_mode=False)
    except BaseException as error:
        return f"{error}" if hasattr(error, "code") else traceback.format_exc()
    return ""

print(json.dumps([run(arguments) for arguments in json.load(sys.stdin)]))
"""
WORKS = [
    ["doctor"],
    ["plan", "phantom.toml"],
    ["build", "phantom.toml", "-o", "phantom.volpkg"],
    ["validate", "phantom.volpkg", "--quick"],
    ["inspect", "phantom.volpkg"],
    ["render", "phantom.volpkg", "-o", "picture.png", "--size", "16"],
    ["view", "phantom.volpkg", "-o", "page.html"],
    ["export", "phantom.volpkg", "level.nii"],
    ["zip", "phantom.volpkg", "-o", "phantom.volpkg.zip"],
    ["build", "phantom.nii", "-o", "nifti.volpkg"],
]
NEEDS = [
    (["validate", "phantom.volpkg", "--size", "16"], "validate"),
    (["study", "stress", "--case", "one-voxel"], "validate"),
    (["study", "progressive", "phantom.volpkg", "-o", "frames", "--size", "16"], "validate"),
    (["batch", "scans", "-o", "out"], "batch"),
    (["export", "phantom.volpkg", "level.ome.zarr"], "zarr"),
    (["build", "scan.zarr", "-o", "zarr.volpkg"], "zarr"),
    (["build", "convex.toml", "-o", "convex.volpkg"], "convex"),
]


def names_with_their_needs(requirements: list[str]) -> set[str]:
    """Names of all distributions that these requirements bring here."""
    spec = importlib.util.spec_from_file_location("make_notice", ROOT / "tools" / "make_notice.py")
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return set(tool.licences_of(requirements))


@pytest.fixture(scope="module")
def blocked() -> list[str]:
    """Every installed module that a wheel without extras does not bring."""
    plain = names_with_their_needs(PROJECT["dependencies"]) | {"volprep"}
    owners = packages_distributions().items()
    return sorted(name for name, given in owners if plain.isdisjoint(map(canonicalize_name, given)))


def test_the_modules_of_each_extra_are_those_of_its_requirements() -> None:
    owners = packages_distributions()
    for extra, needed in EXTRAS.items():
        required = {canonicalize_name(Requirement(line).name) for line in PROJECT["optional-dependencies"][extra]}
        assert {canonicalize_name(owners[module][0]) for module in needed.modules} == required


def test_all_is_every_extra_that_users_need() -> None:
    extras = PROJECT["optional-dependencies"]
    (line,) = extras["all"]
    assert Requirement(line).extras == extras.keys() - {"all", "build", "test", "lint", "docs", "wheel", "bench"}


@pytest.mark.long
def test_a_scan_becomes_a_package_and_each_missing_extra_is_named(tmp_path: Path, blocked: list[str]) -> None:
    scene = write_phantom_scene(tmp_path)
    (tmp_path / "convex.toml").write_text(f'{scene.read_text()}\n[proxy]\nform = "convex"\n')
    _write_zarr(tmp_path / "scan.zarr")
    _write_nifti(tmp_path / "phantom.nii")
    (tmp_path / "scans").mkdir()
    (tmp_path / "without").mkdir()
    (tmp_path / "without" / "sitecustomize.py").write_text(BLOCK)
    done = ended(
        [sys.executable, "-c", RUN],
        input=json.dumps([*WORKS, *(arguments for arguments, _ in NEEDS)]),
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path / "without"), "BLOCKED_MODULES": ",".join(blocked)},
    )
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert said[: len(WORKS)] == [""] * len(WORKS)
    for (arguments, extra), error in zip(NEEDS, said[len(WORKS) :], strict=True):
        assert error.startswith("VP7005 "), (arguments, error)
        assert f"[{extra}]'" in error


def _write_zarr(path: Path) -> None:
    import zarr

    group = zarr.open_group(store=str(path), mode="w", zarr_format=3)
    array = group.create_array("0", shape=(4, 5, 6), dtype="uint8")
    array[:] = np.arange(120, dtype=np.uint8).reshape(4, 5, 6)
    axes = [{"name": name, "type": "space", "unit": "millimeter"} for name in "zyx"]
    levels = [{"path": "0", "coordinateTransformations": [{"type": "scale", "scale": [1.0, 1.0, 1.0]}]}]
    group.attrs["ome"] = {"version": "0.5", "multiscales": [{"axes": axes, "datasets": levels}]}


def _write_nifti(path: Path) -> None:
    import nibabel

    values = np.random.default_rng(1).integers(0, 200, (12, 11, 10)).astype(np.uint8)
    nibabel.save(nibabel.Nifti1Image(values, np.eye(4)), path)
