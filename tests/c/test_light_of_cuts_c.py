"""Light of a volume that planes cut: the C reader takes it exactly for its planes."""

from pathlib import Path

import pytest
from compiled_c import SANITIZERS, compiled
from every_kind import single_file
from web_scenes import build_scene

from .conftest import output


@pytest.mark.long
def test_light_of_a_cut_is_taken_exactly_for_its_planes(tmp_path: Path) -> None:
    program = compiled(tmp_path / "cut_light", Path(__file__).with_name("cut_light.c"), *SANITIZERS)
    package = single_file(build_scene("light of a cut", tmp_path).path)
    cut, whole = ["1 cut-light-shell"], ["0 light-shell"]
    assert output(program, package).splitlines() == [*cut, *cut, *whole, *cut, *whole]
