"""The readers agree on packages that contradict themselves about light that was computed once."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from every_kind import single_file
from readers_compare import disagreement
from three_readers import READ, Readers
from web_scenes import build_scene


def lights(manifest: dict[str, Any]) -> list[dict[str, Any]]:
    """Textures of light, those of a cut last."""
    found = [each for each in manifest["textures"] if each["role"] == "light"]
    return sorted(found, key=lambda each: len(each["light"]["planes"]))


def both(manifest: dict[str, Any], key: str, value: object) -> None:
    for each in lights(manifest):
        each["light"]["model"][key] = value


def without(manifest: dict[str, Any], key: str, name: str) -> None:
    program = manifest["programs"][0]
    program[key] = [each for each in program[key] if each["name"] != name]


LIES: dict[str, Callable[[dict[str, Any]], object]] = {
    "one part twice": lambda m: lights(m)[1].update(part=0),
    "a third part": lambda m: lights(m)[1].update(part=2),
    "parts of two scales": lambda m: lights(m)[1]["light"].update(largest=7.0),
    "light that is fixed": lambda m: both(m, "turnable", False),
    "light in colour": lambda m: (both(m, "turnable", False), both(m, "channels", "rgb")),
    "values that do not ascend": lambda m: [each["light"].update(stored_values=[0.5, 0.5]) for each in lights(m)],
    "a gutter": lambda m: [each["mosaic"].update(gutter=1) for each in lights(m)],
    "no filter": lambda m: lights(m)[0].update(filter="nearest"),
    "a level": lambda m: lights(m)[0].update(level=0),
    "no record of the light": lambda m: lights(m)[0].pop("light"),
    "a program without its light": lambda m: m["programs"][0].update(baked=False),
    "a texture that is not sampled": lambda m: without(m, "samplers", "u_light_1"),
    "no environment": lambda m: without(m, "uniforms", "u_environment"),
    "light of another function": lambda m: [each.update(transfer="other") for each in lights(m)],
}


LIES_OF_A_CUT: dict[str, Callable[[dict[str, Any]], object]] = {
    "a normal of another length": lambda m: lights(m)[1]["light"]["planes"][0].update(normal=[2.0, 0.0, 0.0]),
    "no direction": lambda m: lights(m)[1]["light"]["planes"][0].update(normal=[0.0, 0.0, 0.0]),
    "another scale": lambda m: lights(m)[1]["light"].update(largest=7.0),
    "two lights of the whole": lambda m: lights(m)[1]["light"].update(planes=[]),
    "two lights of the cut": lambda m: lights(m)[0]["light"].update(planes=lights(m)[1]["light"]["planes"]),
    "no light of the whole": lambda m: m["textures"].remove(lights(m)[0]),
}


@pytest.mark.parametrize(
    ("scene", "lies"),
    [("light that turns, in a mosaic", LIES), ("light of a cut", LIES_OF_A_CUT)],
    ids=["light that turns", "light of a cut"],
)
def test_readers_agree_on_lies_about_light(scene, lies, readers: Readers, tmp_path: Path) -> None:
    package = build_scene(scene, tmp_path).path
    manifest = json.loads((package / "manifest.json").read_text())
    paths = []
    for number, lie in enumerate((lambda _: None, *lies.values())):
        told = json.loads(json.dumps(manifest))
        lie(told)
        folder = tmp_path / str(number) / "p.volpkg"
        shutil.copytree(package, folder)
        (folder / "manifest.json").write_text(json.dumps(told))
        paths.append(single_file(folder))
    found = readers.all(paths)
    assert found[0] == ({READ}, READ, READ)
    for name, said in zip(lies, found[1:], strict=True):
        assert disagreement(*said) is None, (name, said)
        assert said[1] == "VP4011", (name, said)
