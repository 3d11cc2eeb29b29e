"""What all tests share: the folder of real scans, and hypothesis without chance."""

import gc
import os
import resource
import signal
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import patch

import pytest
from browser import Browser
from firefox import Firefox
from hypothesis import settings
from long_runs import LONG, MARKERS, split
from one_after_another import OneAfterAnother
from phantom_scene import write_phantom_scene
from remembered_stages import in_full, kept_in, remember
from small_previews import small_previews
from temporary_folder import use_memory

settings.register_profile("deterministic", derandomize=True, deadline=None)
settings.load_profile("deterministic")


def pytest_configure(config) -> None:
    """Let processes find compiled modules, and give each worker one thread."""
    for marker in MARKERS:
        config.addinivalue_line("markers", marker)
    # A shell starts background jobs with SIGINT ignored, and processes inherit that: Ctrl-C would end none of them.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # Tests start hundreds of processes. Without byte code each compiles volprep anew, which takes a third of a second.
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False
    use_memory()
    # Where there are more threads than cores they spin, a quarter of all the time.
    if "PYTEST_XDIST_WORKER" in os.environ:
        os.environ.setdefault("OMP_NUM_THREADS", "1")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Leave what collection makes out of garbage collection: ten thousand tests, and every module."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_unconfigure() -> None:
    """Let all be collected: native modules print what is left when the process ends."""
    gc.unfreeze()


def pytest_collection_modifyitems(config, items) -> None:
    """Leave tests to `make test-long`, unless it runs or a test is named."""
    if LONG or any("::" in argument for argument in config.args):
        return
    items[:], left = split(items)
    if left:
        config.hook.pytest_deselected(items=left)


def pytest_terminal_summary(terminalreporter) -> None:
    """Print the processor time of the run: wall time depends on what else the machine does."""
    used = [resource.getrusage(which) for which in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    seconds = sum(each.ru_utime + each.ru_stime for each in used)
    terminalreporter.write_line(f"processor time: {seconds:.0f} s, browsers not counted")


@pytest.fixture(scope="session", autouse=True)
def nothing_waits_for_the_disk() -> Iterator[None]:
    """Sync no file: nine tenths of the time of a small build. What would be lost without power, no test can see.

    The order in which files are synced is tested with a watcher in place of this (tests/package/test_durable.py), and
    processes that tests start do sync.
    """
    # A mock would keep each of its calls.
    nothing = patch("os.fsync", lambda _descriptor: None)
    with nothing, patch("volprep_formats.output.ThreadPoolExecutor", OneAfterAnother):
        yield


@pytest.fixture(scope="session", autouse=True)
def previews_are_small() -> Iterator[None]:
    """Draw small previews (tests/support/small_previews.py)."""
    with small_previews():
        yield


@pytest.fixture(scope="session")
def stage_cache(pytestconfig, tmp_path_factory) -> Path:
    """Folder of the output of slow stages (tests/support/remembered_stages.py)."""
    # Without pytest's cache (-p no:cacheprovider) it lasts as long as the run.
    cache = getattr(pytestconfig, "cache", None)
    return kept_in(tmp_path_factory.mktemp("stages") if cache is None else cache.mkdir("volprep-stages"))


@pytest.fixture(scope="session", autouse=True)
def slow_stages_run_once(stage_cache) -> Iterator[None]:
    """Run a slow stage once for the same settings and inputs."""
    with remember(stage_cache):
        yield


@pytest.fixture
def stages_run_again() -> Iterator[None]:
    """Run every stage: for tests of whether the same inputs give the same bytes."""
    with in_full():
        yield


@pytest.fixture(autouse=True)
def patched_stages_run_again(request) -> Iterator[None]:
    """Run every stage in tests that may replace a part of the product: its digest does not change."""
    with in_full() if "monkeypatch" in request.fixturenames else nullcontext():
        yield


@pytest.fixture
def stages_run_for_each_plan(stage_cache) -> Iterator[None]:
    """Run every stage unless nothing in the plan differs: for tests of what makes a stage run again."""
    with remember(stage_cache, whole_plan=True):
        yield


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
    from scene_builds import built

    # Codes of 8 bits, which is all that OpenGL ES 2.0 has, show the noise of 12: RMSE 0.021, FLIP 0.06.
    more = "[tolerance]\nrmse = 0.025\nflip = 0.08\n" if request.param == "gles2-2048" else ""
    folder = tmp_path_factory.mktemp(request.param)
    return built(write_phantom_scene(folder, request.param, level_filter="auto", more=more)).path


@pytest.fixture(scope="session")
def browser(tmp_path_factory) -> Iterator[Browser]:
    """Chromium, one for all tests. Skips where there is none."""
    with Browser(tmp_path_factory.mktemp("browser")) as opened:
        yield opened


@pytest.fixture(scope="session")
def firefox(tmp_path_factory) -> Iterator[Firefox]:
    """Firefox, one for all tests. Skips where there is none."""
    with Firefox(tmp_path_factory.mktemp("firefox")) as opened:
        yield opened


@pytest.fixture
def opened(request) -> Browser | Firefox:
    """The browser that a parameter names."""
    found: Browser | Firefox = request.getfixturevalue(request.param)
    return found
