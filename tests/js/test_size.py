"""What a page loads is small, and loads more only for packages that have more."""

import gzip
import json
import subprocess
from pathlib import Path

import pytest
from npm_package import npm_package

JS = Path(__file__).parents[2] / "formats" / "js"
MOST_BYTES = 20_000


@pytest.fixture(scope="module")
def bundle(tmp_path_factory) -> dict:
    """What esbuild makes of the module: its files, and which of them import which."""
    folder = tmp_path_factory.mktemp("bundle")
    esbuild = npm_package("esbuild", "0.25.0") / "node_modules" / "esbuild" / "bin" / "esbuild"
    options = ("--bundle", "--minify", "--splitting", "--format=esm", "--target=es2022")
    command = [esbuild, JS / "volpkg.js", *options, f"--outdir={folder}", f"--metafile={folder}/meta.json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder, timeout=60)
    assert done.returncode == 0, done.stderr
    outputs = json.loads((folder / "meta.json").read_text())["outputs"]
    return {name: (each, (folder / name).read_bytes()) for name, each in outputs.items()}


def closure(bundle: dict, first: str) -> set[str]:
    found = {first}
    for name in (each["path"] for each in bundle[first][0]["imports"] if each["kind"] == "import-statement"):
        found |= closure(bundle, name)
    return found


def test_what_every_package_needs_is_less_than_20_kilobytes(bundle) -> None:
    needed = closure(bundle, "volpkg.js")
    assert sum(len(gzip.compress(bundle[name][1], 9)) for name in needed) < MOST_BYTES


def test_rarer_parts_are_loaded_only_when_a_package_has_them(bundle) -> None:
    needed = {path for name in closure(bundle, "volpkg.js") for path in bundle[name][0]["inputs"]}
    later = {path for each, _ in bundle.values() for path in each["inputs"]} - needed
    names = {Path(path).name for path in later}
    assert names == {
        "zip.js",
        "ranges.js",
        "pace.js",
        "fallbacks.js",
        "mesh.js",
        "rarer.js",
        "techniques.js",
        "layers.js",
        "camera.js",
        "subvolumes.js",
        "clip.js",
        "edit.js",
        "skip.js",
    }


def test_nothing_is_imported_from_elsewhere() -> None:
    for file in JS.glob("*.js"):
        for line in file.read_text().splitlines():
            if line.startswith(("import ", "export ")) and " from " in line:
                assert '"./' in line or 'from "three"' in line, line
