"""The licences of everything that comes with volprep where a user installs it."""

import importlib.util
import re
from pathlib import Path

import pytest
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
BINDING = re.compile(r"\b[AL]?GPL|GNU|General Public|SSPL|Commons Clause|non-?commercial", re.IGNORECASE)


@pytest.fixture(scope="module")
def tool():
    spec = importlib.util.spec_from_file_location("make_notice", ROOT / "tools" / "make_notice.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_nothing_that_users_get_binds_what_they_build_on_it(tool) -> None:
    licences = tool.licences_of(tool.user_requirements())
    assert {name: licence for name, licence in licences.items() if BINDING.search(licence)} == {}
    assert [name for name, licence in licences.items() if licence == "unknown"] == []


def test_everything_that_users_get_is_pinned(tool) -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {canonicalize_name(line.split("==")[0]) for line in lines if not line.startswith("#")}
    assert tool.licences_of(tool.user_requirements()).keys() - pinned == set()


def test_notice_lists_what_users_get_with_its_licence(tool) -> None:
    assert tool.NOTICE.read_text(encoding="utf-8") == tool.notice(), "run tools/make_notice.py"


@pytest.mark.parametrize("licence", ["GPL V3.0", "GNU General Public License v3 (GPLv3)", "LGPL-2.1", "AGPL-3.0-only"])
def test_licences_that_bind_are_known(licence) -> None:
    assert BINDING.search(licence)
