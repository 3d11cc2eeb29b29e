from pathlib import Path

import pytest
from phantom_scene import SCENE

from volprep.scene.lab import KEYS
from volprep.scene.profiles import load_profile
from volprep.scene.scene import load_scene, table_of
from volprep_formats.diagnostics import VolprepError

SAMPLES = sorted((Path(__file__).parents[2] / "sample_specs").glob("*.toml"))
GOOD = SCENE.format(profile="gles3")


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_a_sample_is_a_scene_that_says_what_it_shows(path) -> None:
    scene = load_scene(path)
    assert scene.name == path.stem
    assert path.read_text(encoding="utf-8").startswith("# ")
    load_profile(scene.profile, path.parent)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, r"VP3001 .*: cannot read the file: No such file"),
        ("name = ", r"VP3002 .*: not a TOML file: Invalid value"),
        (GOOD.replace("coarsest_longest_axis", "coarsest_axis"), r"VP3003 .*: pyramid.coarsest_axis: unknown key"),
        (f"{GOOD}[skip]\nepsilon = 0.1\n", r"VP3003 .*: skip.epsilon: this key is now in the table \[lab.skip\]"),
        (f'{GOOD}[lab.skip]\nkind = "none"\n', r"VP3003 .*: lab.skip.kind: \[lab\] has no such key; see skip.kind"),
        (f"{GOOD}[lab]\nskip = 3\n", r"VP3003 .*: lab.skip: \[lab\] has no such key; see skip"),
        (GOOD.replace("[pyramid]", "[pyramyd]"), r"VP3003 .*: pyramyd: unknown key"),
        (GOOD.replace('"#804020"', '"red"'), r"VP3003 .*: transfer.0.points.0.colour"),
        (GOOD.replace("0.2 }", "-0.2 }"), r"VP3003 .*: transfer.0.points.1.extinction_per_mm: .*greater than or equal"),
        (GOOD.replace("value = 900.0", "value = 500.0"), r"VP3003 .*: transfer.0: .*600.0 stands before 500.0"),
        (GOOD.replace('"core"', '"shell"'), r"VP3003 .*: file: 2 transfer functions have the name shell"),
        (GOOD.replace('"phantom"', '"../phantom"'), r"VP3003 .*: name: .*lower-case letters"),
    ],
)
def test_a_wrong_scene_is_told_with_key_and_problem(tmp_path, text, message) -> None:
    path = tmp_path / "scene.toml"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    with pytest.raises(VolprepError, match=message):
        load_scene(path)


def test_a_byte_order_mark_of_an_editor_is_no_part_of_the_scene(tmp_path) -> None:
    for name, encoding in (("plain", "utf-8"), ("marked", "utf-8-sig")):
        (tmp_path / f"{name}.toml").write_text(GOOD, encoding=encoding)
    assert load_scene(tmp_path / "marked.toml") == load_scene(tmp_path / "plain.toml")


def test_keys_of_the_laboratory_are_those_of_their_tables(tmp_path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(
        f'{GOOD}[skip]\nkind = "none"\n[lab.skip]\nepsilon = 0.1\n[lab.mosaic]\ngutter = 2\n', encoding="utf-8"
    )
    scene = load_scene(path)
    assert (scene.skip.kind, scene.skip.epsilon, scene.mosaic.gutter) == ("none", 0.1, 2)
    assert all(keys <= table_of(name).model_fields.keys() for name, keys in KEYS.items())
