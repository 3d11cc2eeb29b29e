"""The readers agree on packages that contradict themselves about light that was computed once."""

from pathlib import Path

import pytest
from reader_lies import Lies, Manifest, codes_of_lies
from three_readers import Readers
from web_scenes import build_scene


def lights(manifest: Manifest) -> list[Manifest]:
    """Textures of light, those of a cut last."""
    found = [each for each in manifest["textures"] if each["role"] == "light"]
    return sorted(found, key=lambda each: len(each["light"]["planes"]))


def both(manifest: Manifest, key: str, value: object) -> None:
    for each in lights(manifest):
        each["light"]["model"][key] = value


def without(manifest: Manifest, key: str, name: str) -> None:
    program = manifest["programs"][0]
    program[key] = [each for each in program[key] if each["name"] != name]


def with_first_colour(manifest: Manifest, colour: object) -> None:
    for each in lights(manifest):
        each["light"]["first_colour"] = colour


def with_reach(manifest: Manifest, axis: int, factor: float) -> None:
    for each in lights(manifest):
        each["light"]["texture_from_box_per_mm_xyz"][axis] *= factor


LIES: Lies = {
    "half of the texture in the box": lambda m: with_reach(m, 0, 0.5),
    "a texture of the whole depth": lambda m: with_reach(m, 2, 2.0),
    "a texture that runs backwards": lambda m: with_reach(m, 1, -1.0),
    "a texture of one place": lambda m: with_reach(m, 1, 0.0),
    "two textures": lambda m: m["textures"].append({**lights(m)[0], "name": "another"}),
    "a second part": lambda m: lights(m)[0].update(part=1),
    "slices without halves": lambda m: lights(m)[0]["mosaic"].update(slices=lights(m)[0]["mosaic"]["slices"] - 1),
    "light that is fixed": lambda m: both(m, "turnable", False),
    "light in colour": lambda m: (both(m, "turnable", False), both(m, "channels", "rgb")),
    "a first colour of light without one": lambda m: with_first_colour(m, [1.0, 0.5, 0.0]),
    "values that do not ascend": lambda m: [each["light"].update(stored_values=[0.5, 0.5]) for each in lights(m)],
    "a gutter": lambda m: [each["mosaic"].update(gutter=1) for each in lights(m)],
    "no filter": lambda m: lights(m)[0].update(filter="nearest"),
    "a level": lambda m: lights(m)[0].update(level=0),
    "no record of the light": lambda m: lights(m)[0].pop("light"),
    "a texture that is not sampled": lambda m: m["programs"][0]["samplers"].remove("u_light"),
    "light of another function": lambda m: [each.update(transfer="other") for each in lights(m)],
}


COLOUR_LIES: Lies = {
    "none": lambda m: with_first_colour(m, None),
    "a half": lambda m: with_first_colour(m, [0.5, 0.25, 0.0]),
    "a brightness with it": lambda m: both(m, "channels", "luminance"),
}
LIES_OF_A_CUT: Lies = {
    "a normal of another length": lambda m: lights(m)[1]["light"]["planes"][0].update(normal=[2.0, 0.0, 0.0]),
    "no direction": lambda m: lights(m)[1]["light"]["planes"][0].update(normal=[0.0, 0.0, 0.0]),
    "another scale": lambda m: lights(m)[1]["light"].update(largest=7.0),
    "two lights of the whole": lambda m: lights(m)[1]["light"].update(planes=[]),
    "two lights of the cut": lambda m: lights(m)[0]["light"].update(planes=lights(m)[1]["light"]["planes"]),
    "no light of the whole": lambda m: m["textures"].remove(lights(m)[0]),
    "thirteen planes": lambda m: lights(m)[1]["light"].update(planes=13 * lights(m)[1]["light"]["planes"]),
}
LIES_OF_COLOUR = {"light in colour", "a first colour of light without one", "none", "a half", "a brightness with it"}
"""Lies that a page refuses, too: it would draw colours that no light has."""
OTHER_CODES = {"thirteen planes": "VP4004"}
"""Codes of lies that the manifest's schema excludes."""


@pytest.mark.parametrize(
    ("scene", "lies"),
    [
        pytest.param("light that turns, in a mosaic", LIES, id="light that turns"),
        pytest.param("editable, light in colour", COLOUR_LIES, id="light in colour"),
        pytest.param("light of a cut", LIES_OF_A_CUT, id="light of a cut", marks=pytest.mark.long),
    ],
)
def test_readers_agree_on_lies_about_light(scene: str, lies: Lies, readers: Readers, tmp_path: Path) -> None:
    package = build_scene(scene, tmp_path).path
    codes = codes_of_lies(readers, package, lies, tmp_path)
    assert {name: c for name, (c, _) in codes.items()} == {name: OTHER_CODES.get(name, "VP4011") for name in lies}
    refused = {name for name, (_, javascript) in codes.items() if javascript == "VP4011"}
    assert refused == LIES_OF_COLOUR & set(lies)
