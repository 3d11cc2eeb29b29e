"""The example in C draws the packages in formats/samples as their pictures say."""

import os
import subprocess
from pathlib import Path

import pytest
from format_samples import LARGEST, SAMPLES, SIDE, differing, read_pixels
from slice_packages import missing_es11


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("name", SAMPLES)
def test_the_example_draws_the_picture_of_a_sample(example_program: Path, name: str, tmp_path: Path) -> None:
    if name == "slices" and missing_es11() is not None:
        pytest.skip(f"no OpenGL ES 1.1: {missing_es11()}")
    sample = SAMPLES[name]
    environment = os.environ | {"EGL_PLATFORM": "surfaceless", "GALLIVM_PERF": "no_aos_sampling"}
    command = [example_program, sample.package, tmp_path / "p.png", "--view", "anterior-left", "--size", str(SIDE)]
    command += ["--frame", str(sample.frame)] if sample.point is None else ["--point", str(sample.point)]
    subprocess.run(command, check=True, env=environment)
    assert differing(read_pixels(tmp_path / "p.png"), sample) <= LARGEST
