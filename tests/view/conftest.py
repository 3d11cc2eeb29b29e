"""A small phantom that is built, validated, and ready to be looked at."""

from dataclasses import dataclass
from pathlib import Path

import pytest
from judged import validate
from phantom_scene import write_phantom_scene
from scene_builds import built

from volprep.validation.folder import default_report_path
from volprep.validation.results.report import Report

SIZE = 48


@dataclass(frozen=True)
class Validated:
    """A package, and its report beside it."""

    package: Path
    report_folder: Path
    report: Report


@pytest.fixture(scope="session")
def phantom(tmp_path_factory) -> Validated:
    folder = tmp_path_factory.mktemp("viewed")
    package = folder / "phantom.volpkg"
    built(write_phantom_scene(folder), package)
    place = default_report_path(package)
    return Validated(package, place, validate(package, place, picture_size=SIZE))
