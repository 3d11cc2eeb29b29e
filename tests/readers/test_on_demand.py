"""The readers agree on bricks on demand that contradict the volume, their index, or the pictures."""

from pathlib import Path
from typing import Any

from reader_lies import codes_of_lies
from scene_builds import built
from three_readers import Readers

SCENE = Path(__file__).parents[2] / "formats" / "samples" / "scenes" / "on-demand.toml"


def as_textures(manifest: Any) -> None:
    for record in manifest["files"]:
        if record["role"] == "bricks":
            record["role"] = "texture"


LIES = {
    "larger bricks than the index has": lambda m: m["on_demand"].update(size=12),
    "a level more": lambda m: m["on_demand"]["levels"].append({"factors_zyx": [4, 8, 8]}),
    "levels that begin at two": lambda m: m["on_demand"]["levels"].pop(0),
    "a factor of three": lambda m: m["on_demand"]["levels"][1].update(factors_zyx=[1, 3, 2]),
    "no room for the coarsest level": lambda m: m["on_demand"].update(places_zyx=[1, 1, 1]),
    "an index that is not there": lambda m: m["on_demand"].update(index="bricks/gone.bin"),
    "bricks as a texture": as_textures,
    "a picture from bricks that are not there": lambda m: m.pop("on_demand"),
}
SHAPES = {
    "a format of two components": lambda m: m["on_demand"].update(format="rg8unorm"),
    "no level": lambda m: m["on_demand"].update(levels=[]),
    "three ghost layers": lambda m: m["on_demand"].update(ghost=3),
    "a place too many": lambda m: m["on_demand"].update(places_zyx=[256, 1, 1]),
}


def test_readers_agree_on_lies(readers: Readers, tmp_path: Path) -> None:
    (tmp_path / "body.raw").write_bytes(bytes(range(256)) * 30)
    scene = tmp_path / "on-demand.toml"
    scene.write_bytes(SCENE.read_bytes())
    package = built(scene).path
    found = codes_of_lies(readers, package, LIES | SHAPES, tmp_path)
    assert found == dict.fromkeys(LIES, ("VP4011", "VP4011")) | dict.fromkeys(SHAPES, ("VP4004", "VP4004"))
