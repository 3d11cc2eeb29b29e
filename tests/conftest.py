"""What all tests share: the folder of real scans, and hypothesis without chance."""

import os
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import Browser
from hypothesis import settings
from phantom_scene import write_phantom_scene

settings.register_profile("deterministic", derandomize=True, deadline=None)
settings.load_profile("deterministic")


def pytest_configure() -> None:
    """Let processes find compiled modules, and give each worker one thread."""
    # Tests start hundreds of processes. Without byte code each compiles volprep anew, which takes a third of a second.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    # Where there are more threads than cores they spin, a quarter of all the time.
    if "PYTEST_XDIST_WORKER" in os.environ:
        os.environ.setdefault("OMP_NUM_THREADS", "1")


@pytest.fixture(scope="session")
def scans() -> Path:
    """Folder of real scans, which the environment variable VOLPREP_TEST_DATA names. Skips where it names none."""
    folder = os.environ.get("VOLPREP_TEST_DATA", "")
    if not folder:
        pytest.skip("real scans: VOLPREP_TEST_DATA is not set")
    path = Path(folder)
    # A wrong path must not pass for a machine without scans: every test on real input would be skipped unseen.
    assert path.is_dir(), f"VOLPREP_TEST_DATA names {folder}, which is no folder"
    return path


@pytest.fixture(scope="module")
def kept_workers() -> Iterator[None]:
    """Workers for compressed DICOM that live as long as a module, not as long as one file is open."""
    from volprep_formats.isolation import workers

    with workers():
        yield


@pytest.fixture(scope="session", params=["gles3", "gles2-2048"])
def built_package(request, tmp_path_factory) -> Path:
    """A sealed package of a small phantom with two transfer functions, built by the main job, for each profile."""
    from volprep.pipeline.build import build
    from volprep.scene.request import load_request
    from volprep_formats.progress import Silent

    folder = tmp_path_factory.mktemp(request.param)
    target = folder / "phantom.volpkg"
    build(load_request(write_phantom_scene(folder, request.param)), target, Silent())
    return target


@pytest.fixture(scope="session")
def browser(tmp_path_factory) -> Iterator[Browser]:
    """Chromium, one for all tests. Skips where there is none."""
    with Browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened
