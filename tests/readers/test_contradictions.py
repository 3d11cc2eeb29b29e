"""The readers agree on packages that contradict themselves."""

from pathlib import Path
from typing import Any

from reader_lies import Lies, codes_of_lies
from segment_scan import built, write_segments
from three_readers import Readers


def twice(listed: list[Any]) -> None:
    listed.append(listed[-1])


def in_pieces(manifest: Any) -> None:
    picture = manifest["pictures"][0]
    drawing = picture["drawings"][0]
    picture["pieces"] = {key: drawing[key] for key in ("program", "textures", "step_mm")}


LIES: Lies = {
    "a label of no segment": lambda m: m["segments"]["labels"][1].update(segments=["nobody"]),
    "two textures of a name": lambda m: twice(m["textures"]),
    "two programs of a name": lambda m: twice(m["programs"]),
    "two channels of a name": lambda m: twice(m["channels"]),
    "two pictures of a name": lambda m: twice(m["pictures"]),
    "a preview as a shader": lambda m: m["programs"][0].update(vertex=m["preview"]),
    "a picture without a drawing": lambda m: m["pictures"][0].pop("drawings"),
    "pieces without sub-volumes": in_pieces,
    "two transfer functions of a name": lambda m: twice(m["channels"][0]["transfer_functions"]),
}


def test_readers_agree_on_lies(readers: Readers, tmp_path: Path) -> None:
    package = built(write_segments(tmp_path), "p", "gles3", outside_opacity=0.0).path
    assert codes_of_lies(readers, package, LIES, tmp_path) == dict.fromkeys(LIES, ("VP4011", "VP4011"))
