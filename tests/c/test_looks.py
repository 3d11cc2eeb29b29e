"""Segments that an app hides: the header computes looks and skip tables, bit by bit."""

from pathlib import Path

import pytest
from every_kind import single_file
from looked import look_table, texels_with_hidden
from segment_scan import DENSE_INSIDE, FAINT_STYLES, built, write_segments

from .conftest import SANITIZERS, compiled, output, told


@pytest.fixture(scope="module")
def look_program(tmp_path_factory) -> Path:
    source = Path(__file__).with_name("look_texels.c")
    return compiled(tmp_path_factory.mktemp("looks") / "looks", source, *SANITIZERS)


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("profile", "texel"), [("gles3", "rgba16float"), ("gles3", "rgba8unorm"), ("gles2-2048", "rgba8unorm")]
)
def test_rays_skip_the_blocks_of_hidden_segments(profile, texel, look_program, tmp_path: Path):
    change = {"skip": {"kind": "distance", "block": 2}}
    faint = {"style": FAINT_STYLES} if texel == "rgba16float" else {}
    change |= {"transfer": DENSE_INSIDE} if faint else {}
    package = built(write_segments(tmp_path), "p", profile, change, outside_opacity=0.0, **faint)
    assert look_table(package).format == texel
    file = single_file(package.path)
    names = [each.name for each in package.manifest.segments.segments]
    for hidden in (names[:1], names[1:], names):
        lines = output(look_program, file, "0", *hidden).splitlines()
        found = {name: bytes.fromhex(digits) for name, digits in map(str.split, lines)}
        assert found == texels_with_hidden(package, 0, *hidden)
    # Nothing is shown: no block is visited.
    assert all(found["skip-segments-0"])


def test_a_package_without_segments_has_no_looks(look_program, packages):
    bad_argument = 3
    assert told(look_program, packages["house"], "-1")[0] == bad_argument
