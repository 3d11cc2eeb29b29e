"""A package of npm for tests that let other readers read our files: installed once, into build/node."""

import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest
from command_line import ended

_FOLDER = Path(__file__).parents[2] / "build" / "node"


def npm_package(name: str, version: str) -> Path:
    """Give the folder where node finds the package. Skips where there is no node, or npm cannot reach its registry."""
    npm = shutil.which("npm")
    if shutil.which("node") is None or npm is None:
        pytest.skip(f"{name}: node and npm are not installed")
    cache = _FOLDER / f"{name}-{version}".replace("/", "-")
    if not cache.exists():
        cache.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=cache.parent) as partial:
            folder = Path(partial) / "made"
            folder.mkdir()
            (folder / "package.json").write_text('{"private": true}')
            command = [npm, "install", "--no-audit", "--no-fund", "--ignore-scripts", f"{name}@{version}"]
            try:
                done = ended(command, cwd=folder)
            except subprocess.TimeoutExpired:
                pytest.skip(f"{name}: npm has not installed it in two minutes")
            if done.returncode != 0:
                pytest.skip(f"{name}: npm cannot install it: {done.stderr.strip().splitlines()[-1]}")
            if not cache.exists():  # another worker may have been faster
                folder.rename(cache)
    return cache
