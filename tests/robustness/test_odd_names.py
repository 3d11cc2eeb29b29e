"""Scans whose names are no UTF-8 or hold control characters, and a current folder that is gone."""

import json
import os
import subprocess
import sys
from pathlib import Path

import nibabel
import numpy as np
import pytest

from volprep_formats.diagnostics import VolprepError
from volprep_formats.isolation import workers
from volprep_formats.path_text import path_of_text, path_text

from .subjects import SUBJECTS, read_volume, sound_file

NAMES = (b"sc\xffan.nii", b"sc\x1b[31man.nii", "Schädel.nii".encode(), b"a\nvolprep: b.nii", b"100%FF.nii")


def volprep(*arguments: object, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the command line in `folder`; what it prints must be UTF-8."""
    program = "import sys; from volprep_cli.main import main; sys.exit(main())"
    given = [os.fsencode(str(argument)) for argument in arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONIOENCODING": "utf-8:strict"}
    ended = subprocess.run(
        [sys.executable, "-c", program, *given], cwd=folder, env=environment, capture_output=True, check=False
    )
    return subprocess.CompletedProcess(ended.args, ended.returncode, ended.stdout.decode(), ended.stderr.decode())


@pytest.mark.parametrize("name", NAMES)
def test_any_name_of_a_file_goes_through_text_and_back(name) -> None:
    path = Path("/scans") / os.fsdecode(name)
    assert path_of_text(path_text(path)) == path
    path_text(path).encode()


@pytest.mark.long
@pytest.mark.parametrize("name", NAMES)
def test_a_scan_of_any_name_is_built_and_its_package_validated(tmp_path, name) -> None:
    folder = tmp_path / os.fsdecode(b"fold\xfeer")
    folder.mkdir()
    scan = folder / os.fsdecode(name)
    values = np.random.default_rng(2).integers(0, 200, (9, 8, 7)).astype(np.int16)
    nibabel.save(nibabel.Nifti1Image(values, np.eye(4)), tmp_path / "scan.nii")
    (tmp_path / "scan.nii").rename(scan)
    package = folder / "a.volpkg"
    built = volprep("build", scan, "-o", package, folder=tmp_path)
    assert built.returncode == 0, built.stderr
    assert "\x1b" not in built.stderr
    origin = json.loads((folder / "a.volpkg.origin.json").read_text())
    assert path_of_text(origin["scene"]["source"]["path"]) == scan
    seen = volprep("validate", package, "--quick", "--json", folder=tmp_path)
    assert seen.returncode in {0, 1}, seen.stderr
    json.loads(seen.stdout)


@pytest.mark.parametrize("ending", [".nii", ".nrrd", ".mha"])
def test_a_scan_with_the_longest_name_is_built(tmp_path, ending) -> None:
    subject = next(each for each in SUBJECTS if each.suffix == ending)
    scan = tmp_path / f"{'x' * (255 - len(ending))}{ending}"
    scan.write_bytes(sound_file(subject))
    done = volprep("build", scan, "-o", tmp_path / "a.volpkg", folder=tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_name_in_a_message_can_neither_steer_the_terminal_nor_add_a_line(tmp_path) -> None:
    name = os.fsdecode(b"no\x1b[2J\nvolprep: all is well\xff.nii")
    refused = volprep("build", tmp_path / name, "-o", "a.volpkg", "--json", folder=tmp_path)
    assert refused.returncode == 3
    assert json.loads(refused.stdout)["error"]["code"] == "VP1001"
    assert refused.stderr.rstrip("\n").isprintable()


@pytest.mark.parametrize(
    ("arguments", "code", "status"),
    [
        (("build", "a.nii", "-o", "a.volpkg"), "VP7002", 8),
        (("build", "a.toml", "-o", "a.volpkg"), "VP3001", 4),
        (("inspect", "a.volpkg"), "VP4001", 5),
    ],
)
def test_a_current_folder_that_is_gone_has_a_code(tmp_path, arguments, code, status) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    program = "import os, sys; os.rmdir(os.getcwd()); from volprep_cli.main import main; sys.exit(main())"
    ended = subprocess.run(
        [sys.executable, "-c", program, *arguments], cwd=gone, capture_output=True, check=False, text=True
    )
    assert ended.stderr.startswith(f"volprep: {code} ")
    assert ended.returncode == status, ended.stderr


@pytest.mark.long(keep=5)
@pytest.mark.parametrize("subject", [each for each in SUBJECTS if each.read is read_volume], ids=lambda each: each.name)
def test_every_format_is_read_under_a_name_that_is_no_utf_8_or_says_why_not(tmp_path, subject) -> None:
    path = tmp_path / os.fsdecode(b"sc\xffan" + subject.suffix.encode())
    path.write_bytes(subject.pack(sound_file(subject)))
    with workers():
        if subject.suffix in {".png", ".tif", ".exr"}:  # their library takes Unicode only
            with pytest.raises(VolprepError, match="VP1071"):
                subject.read(path)
        else:
            subject.read(path)
