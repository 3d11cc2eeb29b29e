"""What tests of formats/js share: one server for all of them."""

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from web_scenes import build_scene
from web_server import WebServer

from volprep_formats.package.reader import Package

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def server() -> Iterator[WebServer]:
    """Server of formats/js and of what tests add to its folders."""
    folders = {"js": ROOT / "formats" / "js", "support": ROOT / "tests" / "js"}
    with WebServer(folders) as serving:
        yield serving


@pytest.fixture(scope="session")
def scene_package(tmp_path_factory) -> Callable[[str], Package]:
    """Package of the scene of a name, built once."""
    built: dict[str, Package] = {}

    def package(name: str) -> Package:
        if name not in built:
            built[name] = build_scene(name, tmp_path_factory.mktemp("web"))
        return built[name]

    return package
