from pathlib import Path

import pytest

from volprep.scene.profiles import load_profile, profile_names
from volprep_formats.diagnostics import VolprepError

MINE = """
name = "mine"
api = "es3.0"
max_texture_size = 512
max_3d_texture_size = 128
texture_units = 4
texture_formats = ["R8", "RGBA8"]
index_bits = 16
max_texture_bytes = 1000000
"""


@pytest.mark.parametrize("name", profile_names())
def test_a_built_in_profile_has_the_name_of_its_file(name) -> None:
    assert load_profile(name, Path("/nowhere")).name == name


def test_an_unknown_name_is_told_with_the_known_ones() -> None:
    with pytest.raises(VolprepError, match=r"VP3010 there is no profile gles9.*gles2-2048, gles2-4096, gles3"):
        load_profile("gles9", Path())


def test_a_path_starts_at_the_folder_of_the_scene(tmp_path) -> None:
    (tmp_path / "mine.toml").write_text(MINE, encoding="utf-8")
    assert load_profile("mine.toml", tmp_path).max_3d_texture_size == 128


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"VP3011 .*mine.toml: cannot read the profile: No such file"),
        ("name = ", r"VP3011 .*mine.toml: cannot read the profile: Invalid value"),
        (MINE.replace("api", "apy"), r"VP3012 .*mine.toml: apy: unknown key, api is missing\."),
        (MINE.replace("es3.0", "es9.0"), r"VP3012 .*mine.toml: api: Input should be"),
    ],
)
def test_a_wrong_profile_file_is_told_with_what_is_wrong(tmp_path, text, message) -> None:
    if text is not None:
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    with pytest.raises(VolprepError, match=message):
        load_profile("mine.toml", tmp_path)
