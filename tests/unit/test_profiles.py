from pathlib import Path
from typing import get_args

import pytest

from volprep.scene.profiles import class_names, device_names, load_profile, load_sheet, profile_names
from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.api import Api, graphics_api
from volprep_formats.package.profile import DeviceProfile

MINE = """
name = "mine"
api = "es3.0"
max_texture_size = 512
max_3d_texture_size = 128
texture_units = 4
texture_formats = ["r8unorm", "rgba8unorm"]
index_bits = 16
max_texture_bytes = 1000000
"""


@pytest.mark.parametrize("name", profile_names())
def test_a_built_in_profile_has_the_name_of_its_file(name) -> None:
    assert load_profile(name, Path("/nowhere")).name == name


@pytest.mark.parametrize("name", profile_names())
def test_every_number_of_a_built_in_profile_has_a_source(name) -> None:
    sheet = load_sheet(name, Path("/nowhere"))
    said = {field for field in DeviceProfile.model_fields if field in sheet.model_fields_set} - {"name"}
    assert sheet.sources.keys() == said
    assert all(len(source) >= 10 for source in sheet.sources.values())


def test_the_devices_of_the_papers_and_two_classes_of_phones_are_there() -> None:
    assert device_names() == (
        *("adreno-420", "adreno-430", "axim-x51v", "ipad-2", "ipod-touch-4"),
        *("phone-android", "phone-apple", "shield-tablet-k1"),
    )
    assert not set(device_names()) & set(class_names())


def test_a_profile_of_a_user_may_have_sources_and_they_are_no_part_of_a_package(tmp_path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f'{MINE}[sources]\nmax_texture_size = "measured"\n', encoding="utf-8")
    assert load_sheet("mine.toml", tmp_path).sources == {"max_texture_size": "measured"}
    assert "sources" not in load_profile("mine.toml", tmp_path).model_dump()
    path.write_text(f'{MINE}[sources]\nmax_texture = "measured"\n', encoding="utf-8")
    with pytest.raises(VolprepError, match=r"VP3012 .*mine.toml: sources.max_texture: there is no such key"):
        load_profile("mine.toml", tmp_path)


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


def test_a_texture_format_that_does_not_exist_is_refused(tmp_path) -> None:
    (tmp_path / "mine.toml").write_text(MINE.replace('"rgba8unorm"', '"RGBA9"'), encoding="utf-8")
    with pytest.raises(VolprepError, match=r"VP3012 .*mine.toml: texture_formats.1: Input should be 'r8unorm'"):
        load_profile("mine.toml", tmp_path)


@pytest.mark.parametrize("question", ["has_shaders", "dialect", "graphics"])
def test_an_api_that_nobody_has_described_is_a_coded_error(question) -> None:
    profile = DeviceProfile.model_construct(**load_profile("gles3", Path()).model_dump() | {"api": "webgpu"})
    with pytest.raises(VolprepError, match=r"VP4073 .*webgpu; it knows es1.1, es2.0, es3.0"):
        getattr(profile, question)


def test_every_api_of_a_profile_has_a_record() -> None:
    records = {api: graphics_api(api) for api in get_args(Api)}
    assert {api: (record.number, record.dialect) for api, record in records.items()} == {
        "es1.1": ("1.1", None),
        "es2.0": ("2.0", "es100"),
        "es3.0": ("3.0", "es300"),
    }
