"""The readers agree on packages that contradict themselves about segments."""

from pathlib import Path

import pytest
from reader_lies import Lies, Manifest, codes_of_lies
from segment_scan import built, write_segments
from three_readers import Readers


def of(manifest: Manifest, role: str) -> Manifest:
    """The first texture of a role."""
    return next(each for each in manifest["textures"] if each["role"] == role)


def mosaic(manifest: Manifest, key: str, value: object) -> None:
    of(manifest, "labels")["mosaic"][key] = value


def narrower(texture: Manifest, axis: int) -> None:
    texture["shape_zyx"][axis] -= 1


def as_rgba(texture: Manifest) -> None:
    texture["format"] = "rgba8unorm"


LIES: Lies = {
    "textures without segments": lambda m: m.pop("segments"),
    "labels of another shape": lambda m: narrower(of(m, "labels"), 0),
    "labels of another level": lambda m: of(m, "labels").update(level=7),
    "labels that are filtered": lambda m: of(m, "labels").update(filter="linear"),
    "labels in more bytes": lambda m: as_rgba(of(m, "labels")),
    "looks of fewer labels": lambda m: narrower(of(m, "looks"), 2),
    "looks of a level": lambda m: of(m, "looks").update(level=0),
    "looks of another picture": lambda m: of(m, "looks").update(transfer="veil"),
    "sets of another number of blocks": lambda m: of(m, "label-sets")["shape_zyx"].__setitem__(1, 7),
    "sets in a longer row": lambda m: of(m, "label-sets").update(shape_zyx=[1, 1, 4096]),
    "sets in other texels": lambda m: as_rgba(of(m, "label-sets")),
    "sets of a level without a table": lambda m: of(m, "label-sets").update(level=1),
    "sets of another picture": lambda m: of(m, "label-sets").update(transfer="veil"),
    "sets twice": lambda m: m["textures"].append({**of(m, "label-sets"), "name": "again"}),
    "two segments of one name": lambda m: m["segments"]["segments"][1].update(
        name=m["segments"]["segments"][0]["name"]
    ),
    "a segment of an unknown function": lambda m: m["segments"]["segments"][0].update(transfer="other"),
    "a label of no segment": lambda m: m["segments"]["labels"][1].update(segments=["nobody"]),
    "a label twice of one segment": lambda m: m["segments"]["labels"][1].update(
        segments=2 * m["segments"]["labels"][1]["segments"]
    ),
    "labels in another order": lambda m: m["segments"]["labels"].reverse(),
    "transfer functions in another order": lambda m: m["segments"]["transfers"].reverse(),
    "the name of a transfer function": lambda m: m["segments"].update(name="veil"),
    "several channels together": lambda m: m.update(together={"name": "both", "transfers": ["veil", "inside"]}),
}
LIES_OF_MOSAICS: Lies = {
    "fewer slices": lambda m: mosaic(m, "slices", 2),
    "wider tiles": lambda m: mosaic(m, "tile_shape_yx", [17, 22]),
    "four slices in a texel": lambda m: mosaic(m, "slices_per_texel", 4),
}


@pytest.mark.long(keep=1)
@pytest.mark.parametrize(("profile", "lies"), [("gles3", LIES), ("gles2-2048", LIES_OF_MOSAICS)])
def test_readers_agree_on_lies_about_segments(readers: Readers, tmp_path: Path, profile: str, lies: Lies) -> None:
    change = {"skip": {"kind": "distance", "block": 2}}
    package = built(write_segments(tmp_path), "p", profile, change, outside_opacity=0.0).path
    codes = codes_of_lies(readers, package, lies, tmp_path)
    assert codes == dict.fromkeys(lies, ("VP4011", "VP4011"))
