"""Shaders of packages as HLSL, which glslang's front end compiles."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from volprep_formats.package.reader import Package

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import hlsl  # noqa: E402

pytestmark = pytest.mark.skipif(
    not (shutil.which("spirv-cross") and shutil.which("glslangValidator")),
    reason="no spirv-cross: tools/system_packages.sh says how to get it",
)
SAMPLES = ROOT / "formats" / "samples"


@pytest.mark.parametrize("sample", ["scan", "segments", "bricks", "two-grids", "baked-light"])
def test_shaders_become_hlsl_with_all_their_uniforms(sample: str, tmp_path: Path) -> None:
    path = SAMPLES / f"{sample}.volpkg.zip"
    hlsl.main(path, tmp_path)
    for program in Package.open(path).manifest.programs:
        made = (tmp_path / f"{Path(program.fragment).name}.hlsl").read_text()
        assert "SV_Target0" in made
        assert all(f" {name} : register" in made for name in program.samplers)


def test_a_shader_that_does_not_compile_is_refused(tmp_path: Path) -> None:
    with pytest.raises(subprocess.CalledProcessError):
        hlsl.converted("a.frag", "#version 300 es\nvoid main() { nothing(); }\n", tmp_path)
