"""The main job on real scans, as a user runs it."""

import gzip
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from command_line import COMMAND, volprep

from volprep.scene.channels import ONLY_CHANNEL
from volprep_formats.package.reader import Package
from volprep_formats.textures import ktx2

SAMPLES = Path(__file__).parents[2] / "sample_specs"
ALLOWED_MEMORY_BYTES = 1_500_000_000


def codes(package: Package, level: int) -> np.ndarray:
    image = ktx2.decode(package.read_bytes(f"textures/volume-{ONLY_CHANNEL}-{level}.ktx2"), "level")
    return np.frombuffer(image.data, np.uint8).reshape(image.shape_zyx)


@pytest.mark.long
def test_a_head_as_dicom_series_within_its_memory(scans, tmp_path) -> None:
    series = scans / "mr_t1_studyforrest" / "dicoms"
    command = [*COMMAND, "build", SAMPLES / "mr-head.toml", "--source", series, "-o", tmp_path / "head.volpkg"]
    with (tmp_path / "told").open("wb") as told:
        process = subprocess.Popen(command, stderr=told)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, (tmp_path / "told").read_text(encoding="utf-8")
    assert usage.ru_maxrss * 1024 < ALLOWED_MEMORY_BYTES

    package = Package.open(tmp_path / "head.volpkg")
    manifest = package.manifest
    assert (manifest.statistics.minimum, manifest.statistics.maximum) == (0.0, 278.0)
    assert [level.grid.shape_zyx for level in manifest.levels] == [
        (369, 330, 274),
        (185, 165, 137),
        (93, 83, 69),
        (47, 42, 35),
    ]
    # The transfer function tells nothing apart above 120: a step of one code keeps what is below exactly.
    assert manifest.quantization is not None
    assert (manifest.quantization.window, manifest.quantization.rmse) == ((0.0, 255.0), 0.0)
    # A package of a patient names nobody.
    text = (tmp_path / "head.volpkg" / "manifest.json").read_text(encoding="utf-8")
    assert not re.search("patient|study|series|birth|sex|accession|institution", text, re.IGNORECASE)


@pytest.fixture(scope="module", params=["gles3", "gles2-2048"])
def engine(request, scans, tmp_path_factory) -> dict:
    """An engine as a packed raw file, built for a profile, and what `build --json` said of it."""
    (source,) = (scans / "engine_pair" / "data").glob("*.raw.gz")
    target = tmp_path_factory.mktemp("engine") / "engine.volpkg"
    options = ("--source", source, "--profile", request.param, "-o", target, "--json")
    run = volprep("build", SAMPLES / "engine-raw.toml", *options)
    assert run.returncode == 0, run.stderr
    return {"source": source, "profile": request.param, "package": target, "built": json.loads(run.stdout)}


@pytest.mark.long
def test_an_engine_as_a_packed_raw_file_keeps_every_voxel(engine) -> None:
    package = Package.open(engine["package"])
    assert package.manifest.levels[0].factors_zyx == (1, 1, 1)
    assert package.manifest.quantization is not None
    assert package.manifest.quantization.max_error == 0.0
    if engine["profile"] == "gles3":
        with gzip.open(engine["source"]) as file:
            voxels = np.frombuffer(file.read(), np.uint8).reshape(128, 256, 256)
        # What no transfer function shows is not in the package; the engine's axes are those of the patient's space.
        z, y, x = package.manifest.grid.shape_zyx
        x0, y0, z0 = (int(mm) for mm in package.manifest.grid.origin_mm_xyz)
        assert np.array_equal(codes(package, 0), voxels[z0 : z0 + z, y0 : y0 + y, x0 : x0 + x])
        hidden = np.ones(voxels.shape, bool)
        hidden[z0 : z0 + z, y0 : y0 + y, x0 : x0 + x] = False
        assert voxels[hidden].max() <= package.manifest.transfer_functions[0].points[0].value


@pytest.mark.long
def test_validate_quick_and_inspect_agree_with_what_build_says(engine) -> None:
    assert volprep("validate", engine["package"], "--quick").returncode == 0
    inspected = json.loads(volprep("inspect", engine["package"], "--json").stdout)
    assert inspected["size_bytes"] == engine["built"]["size_bytes"]
    assert len(inspected["manifest"]["files"]) == engine["built"]["files"]
