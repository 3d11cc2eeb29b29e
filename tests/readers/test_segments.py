"""The readers agree on packages that contradict themselves about segments."""

from pathlib import Path

from reader_lies import Lies, codes_of_lies
from segment_scan import built, write_segments
from three_readers import Readers

LIES: Lies = {"a label of no segment": lambda m: m["segments"]["labels"][1].update(segments=["nobody"])}


def test_readers_agree_on_lies_about_segments(readers: Readers, tmp_path: Path) -> None:
    package = built(write_segments(tmp_path), "p", "gles3", outside_opacity=0.0).path
    assert codes_of_lies(readers, package, LIES, tmp_path) == dict.fromkeys(LIES, ("VP4011", "VP4011"))
