"""A disk that is full ends each verb with exit status 6: what was there before stays, and nothing else does.

The limit on the size of a file stops a write in its middle as a full disk does; both are tried.
"""

import os
import resource
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import nibabel
import numpy as np
import pytest
from command_line import COMMAND, ended, volprep
from phantom_scene import write_phantom_scene

from volprep.scan.slabs import temporary_codes
from volprep_formats.diagnostics import ExitStatus, VolprepError

LIMIT_BYTES = 3000
DISK_BYTES = 8192
OLDER = b"older"

FILES = {
    "export good.volpkg {}/a.nii": "a.nii",
    "export good.volpkg {}/a.nii.gz": "a.nii.gz",
    "export good.volpkg {}/a.nrrd": "a.nrrd",
    "export good.volpkg {}/a.raw": "a.raw",
    "export good.volpkg {}/a.vdb": "a.vdb",
    "zip good.volpkg -o {}/a.zip": "a.zip",
    "render good.volpkg -o {}/a.png --size 600": "a.png",
    "inspect good.volpkg --picture {}/a.png": "a.png",
    "cut good.volpkg --center 20,15,10 --size 20 -o {}": "cut.ktx2",
}
"""Verbs that write one file, and its name; a cut begins with this one."""
FOLDERS = {
    "export good.volpkg {}/series": "series",
    "validate good.volpkg --report {}/a.report --size 32": "a.report",
    "build phantom.toml -o {}/a.volpkg": "a.volpkg",
    "import phantom.toml -o {}/a.volpkg": "a.volpkg",
}
"""Verbs that write a folder, and its name."""


@pytest.fixture(scope="module")
def place(tmp_path_factory) -> Path:
    """A folder with a scene and a package with sub-volumes; small files of it take more than the limit."""
    folder = tmp_path_factory.mktemp("place")
    scene = write_phantom_scene(folder)
    scene.write_text(
        scene.read_text(encoding="utf-8") + "\n[quantize]\nbits = 16\n[grid]\nsize = 24\n", encoding="utf-8"
    )
    done = volprep("build", scene, "-o", "good.volpkg", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def disk(tmp_path) -> Iterator[Path]:
    """A file system with room for two pages."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = shutil.which("mount")
    options = ("-t", "tmpfs", "-o", f"size={DISK_BYTES}", "tmpfs", folder)
    if mount is None or subprocess.run([mount, *options], capture_output=True, check=False).returncode != 0:
        pytest.skip("a file system of 8 kB cannot be mounted here")
    yield folder
    subprocess.run(["umount", folder], check=True)


def limited(command: str, place: Path) -> subprocess.CompletedProcess[str]:
    return ended(
        [*COMMAND, *command.split()],
        cwd=place,
        # Python 3.11 would leave truncated bytecode of modules that it compiles, and later commands would load it.
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (LIMIT_BYTES, LIMIT_BYTES)),
    )


def require_one_message(done: subprocess.CompletedProcess[str]) -> None:
    assert done.returncode == ExitStatus.OUTPUT, done.stdout + done.stderr
    assert done.stderr.count("volprep: VP") == 1
    assert done.stderr.splitlines()[-1].startswith("volprep: VP")
    assert "Traceback" not in done.stderr


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("command", "name"), FILES.items(), ids=FILES)
def test_a_file_that_finds_no_room_leaves_the_older_one_and_nothing_else(place, tmp_path, command, name) -> None:
    (tmp_path / name).write_bytes(OLDER)
    done = limited(f"{command.format(tmp_path)} --force", place)
    require_one_message(done)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == {name: OLDER}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("command", FOLDERS)
def test_a_folder_that_finds_no_room_leaves_nothing(place, tmp_path, command) -> None:
    require_one_message(limited(command.format(tmp_path), place))
    assert not list(tmp_path.iterdir())


@pytest.mark.long(keep=4)
@pytest.mark.parametrize("command", {**FILES, **FOLDERS})
def test_a_disk_without_room_stays_empty(place, disk, command) -> None:
    require_one_message(volprep(*command.format(disk).split(), cwd=place))
    assert not list(disk.iterdir())


@pytest.mark.parametrize(
    ("room", "file", "size_bytes"),
    [("96k", "work/stored0-scan.raw", 35340), ("132k", ".stage/scratch/2-box.raw", 2400)],
)
def test_a_build_that_finds_no_room_names_the_file_and_its_size_and_leaves_nothing(
    tmp_path, disk, room, file, size_bytes
) -> None:
    # The scan fits, and its codes do not: the traceback holds results of kernels, which nanobind reports if they leak.
    subprocess.run(["mount", "-o", f"remount,size={room}", disk], check=True)
    scene = write_phantom_scene(tmp_path, level_filter="box")
    done = subprocess.run(
        [*COMMAND, "build", scene, "-q", "-o", disk / "x.volpkg"], capture_output=True, text=True, check=False
    )
    require_one_message(done)
    assert (
        f"{file}: cannot write: No space left on device; it takes {size_bytes} bytes, 0 bytes are free" in done.stderr
    )
    assert not list(disk.iterdir())


def test_a_mapped_file_that_finds_no_room_is_refused_before_it_is_used(disk) -> None:
    with pytest.raises(VolprepError, match=f"{disk}: cannot write: .*; it takes 524288 bytes"):
        temporary_codes(disk, (64, 64, 64)).__enter__()
    with temporary_codes(disk, (10, 10, 10)) as codes:
        codes[...] = 7


def test_a_full_disk_of_a_file_without_a_name_does_not_blame_standard_output(tmp_path) -> None:
    code = "import volprep_cli.doctor\ndef full():\n    'Fail.'\n    raise OSError(28, 'No space left')\n"
    code += f"volprep_cli.doctor.doctor = full\n{COMMAND[2]}"
    done = subprocess.run(
        [*COMMAND[:2], code, "doctor"],
        env={**os.environ, "TMPDIR": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert f"a temporary file, perhaps in {tmp_path}: cannot write" in done.stderr


@pytest.mark.long(keep=3)
@pytest.mark.parametrize(("command", "name"), {**FILES, **FOLDERS}.items(), ids={**FILES, **FOLDERS})
def test_with_room_each_of_these_commands_writes_more_than_there_was_room_for(place, tmp_path, command, name) -> None:
    done = volprep(*command.format(tmp_path).split(), cwd=place)
    assert done.returncode == 0, done.stderr
    made = tmp_path / name
    files = [each for each in made.rglob("*") if each.is_file()] if made.is_dir() else [made]
    assert sum(each.stat().st_size for each in files) > DISK_BYTES
    assert not list(tmp_path.rglob(".*"))


FULL_SHM = """
mount -t tmpfs -o size=4k tmpfs /dev/shm || exit 77
head -c 4096 /dev/zero > /dev/shm/full
exec "$0" "$@"
"""


@pytest.mark.long
def test_a_batch_without_room_for_semaphores_names_their_folder() -> None:
    words = ["unshare", "--mount", "sh", "-c", FULL_SHM, *COMMAND, "batch", "scan.nii", "-o", "out", "--workers", "2"]
    if shutil.which("unshare") is None:
        pytest.skip("file systems cannot be mounted here")
    # Folders of tests are below /dev/shm.
    with TemporaryDirectory(dir="/var/tmp") as folder:
        nibabel.save(nibabel.Nifti1Image(np.ones((4, 5, 6), np.int16), np.eye(4)), Path(folder) / "scan.nii")
        done = ended(words, cwd=folder)
    if done.returncode in {1, 77}:
        pytest.skip("file systems cannot be mounted here")
    assert (done.returncode, done.stderr.count("VP4020 /dev/shm")) == (ExitStatus.OUTPUT, 1), done.stderr
