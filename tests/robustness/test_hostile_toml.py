"""Scenes and profiles that were written to hang, to fill the memory, or to overflow: refused at once, with a code."""

import time
from pathlib import Path

import pytest

from volprep.scene.profiles import load_profile
from volprep.scene.request import load_edit
from volprep.scene.scene import load_scene
from volprep_formats.diagnostics import VolprepError
from volprep_formats.grid import Grid

LONGEST_S = 10.0  # what is read again for each of its characters takes minutes; this machine may be a slow one
POINT = '{value=0, colour="#ffffff", extinction_per_mm=0.1}'
SOURCE = 'name = "a"\n[source]\npath = "x"\n'
SCENE = f'{SOURCE}[[transfer]]\nname = "t"\n'
TEXTS = {
    "100,000 brackets": "a = " + "[" * 100_000,
    "tables in tables": "a = " + "{a=" * 100_000,
    "a deep table": "[" + "a." * 100_000 + "a]",
    "a deep key": "a." * 100_000 + "a = 1",
    "a deep quoted key": '"a".' * 100_000 + "a = 1",
    "a number of 10,000 digits": "a = " + "1" * 10_000,
    "a megabyte and more": "#" * (2**20 + 1),
    "no UTF-8": "a = '\udcff'",
}
SCENES = {
    "window": f"{SCENE}points = [{POINT}]\n[quantize]\nwindow = [-1e308, 1e308]\n",
    "step": f"{SCENE}points = [{POINT}]\n[render]\nstep_voxels = 1e-300\n",
    "value of many digits": f"{SCENE}points = [{POINT.replace('value=0', 'value=' + '1' * 4000)}]\n",
    "header of many digits": f"{SOURCE}raw = {{shape_zyx=[1,1,1], dtype='uint8', header_bytes={'1' * 4000}}}\n"
    f"[[transfer]]\nname = 't'\npoints = [{POINT}]\n",
    "level in hexadecimal": f"{SOURCE}level = 0x{'f' * 100_000}\n[[transfer]]\nname = 't'\npoints = [{POINT}]\n",
    "points": f"{SCENE}points = [{','.join([POINT.replace(' ', '')] * 15_000)}]\n",
    "transfer functions": SOURCE + "".join(f"[[transfer]]\nname = 't{n}'\npoints = [{POINT}]\n" for n in range(9000)),
}


def refusal(read, path: Path) -> str:
    began = time.process_time()
    with pytest.raises(VolprepError) as caught:
        read(path)
    assert time.process_time() - began < LONGEST_S
    assert len(str(caught.value)) < 2000
    return caught.value.code


def edit(path: Path) -> None:
    load_edit(path, Grid.of((2, 2, 2), (1.0, 1.0, 1.0)))


@pytest.mark.parametrize("text", TEXTS.values(), ids=TEXTS)
def test_a_text_that_no_parser_should_meet_is_refused_at_once(tmp_path, text) -> None:
    path = tmp_path / "hostile.toml"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert refusal(load_scene, path) in {"VP3001", "VP3002"}
    assert refusal(edit, path) in {"VP3001", "VP3002"}
    assert refusal(lambda each: load_profile(str(each), Path()), path) == "VP3011"


@pytest.mark.parametrize("text", SCENES.values(), ids=SCENES)
def test_a_scene_of_numbers_that_nothing_can_hold_is_refused_at_once(tmp_path, text) -> None:
    path = tmp_path / "hostile.toml"
    path.write_text(text)
    assert refusal(load_scene, path) in {"VP3001", "VP3003"}


def test_a_comment_with_many_dots_is_a_comment(tmp_path) -> None:
    (tmp_path / "scene.toml").write_text(f"# {'a sentence. ' * 40}\n# {'.' * 200}\n{SCENE}points = [{POINT}]\n")
    assert load_scene(tmp_path / "scene.toml").name == "a"
