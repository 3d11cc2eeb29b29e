"""The packages in formats/samples are those that volprep builds of their scenes today, and they are small."""

import importlib.util
import json
import os
import platform
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from format_samples import FOLDER, LARGEST, SAMPLES, differing, read_pixels

TOOL = Path(__file__).parents[2] / "tools" / "make_samples.py"
NAMES = sorted(scene.stem for scene in (FOLDER / "scenes").glob("*.toml"))


@pytest.fixture(scope="module")
def tool() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_samples", TOOL)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", NAMES)
def test_a_sample_has_the_bytes_and_the_pictures_of_a_build(name: str, tool: ModuleType, tmp_path: Path) -> None:
    written = json.loads((FOLDER / "samples.json").read_text(encoding="utf-8"))
    file = f"{name}.volpkg.zip"
    entries = tool.write_samples(tmp_path, [name])
    assert entries == [entry for entry in written if entry["package"] == file], "run python tools/make_samples.py"
    assert (tmp_path / file).read_bytes() == (FOLDER / file).read_bytes(), "run python tools/make_samples.py"
    for entry in entries:
        sample = SAMPLES[entry["picture"].removesuffix(".png")]
        assert differing(read_pixels(tmp_path / entry["picture"]), sample) <= LARGEST


@pytest.mark.long
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the variables choose code of x86-64")
def test_a_processor_without_avx2_builds_the_same_bytes(tmp_path: Path) -> None:
    names = ["baked-light", "oblique", "segments", "two-grids"]
    old = {
        "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable",
        "OPENBLAS_CORETYPE": "Prescott",
        "NPY_DISABLE_CPU_FEATURES": "X86_V3",
    }
    program = "import sys, pathlib, make_samples as m; m.write_samples(pathlib.Path(sys.argv[1]), sys.argv[2:])"
    paths = os.pathsep.join([str(TOOL.parent), os.environ.get("PYTHONPATH", "")])
    words = [sys.executable, "-c", program, tmp_path, *names]
    subprocess.run(words, check=True, env={**os.environ, **old, "PYTHONPATH": paths}, timeout=250)
    for name in names:
        file = f"{name}.volpkg.zip"
        assert (tmp_path / file).read_bytes() == (FOLDER / file).read_bytes()


def test_each_sample_is_small_and_has_its_row_in_the_readme() -> None:
    readme = (FOLDER / "README.md").read_text(encoding="utf-8")
    packages = sorted(FOLDER.glob("*.zip"))
    assert [package.name.removesuffix(".volpkg.zip") for package in packages] == NAMES
    for package in packages:
        assert package.stat().st_size < 100_000
        assert f"| `{package.name.removesuffix('.volpkg.zip')}` |" in readme
    assert {sample.picture for sample in SAMPLES.values()} == set(FOLDER.glob("*.png"))
