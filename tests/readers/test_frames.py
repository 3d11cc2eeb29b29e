"""The readers agree on time series whose drawings are not complete, and on one that is."""

from pathlib import Path
from typing import Any

from reader_lies import Lies, codes_of_lies
from scene_builds import built
from three_readers import Readers
from time_series import moving, write_series


def drawings(manifest: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = manifest["pictures"][0]["drawings"]
    return found


LIES: Lies = {
    "a frame too few": lambda m: m["frames"].pop(),
    "a frame too many": lambda m: m["frames"].append({}),
    "no frames": lambda m: m.pop("frames"),
    "a drawing of no frame": lambda m: drawings(m)[-1].update(frame=7),
    "a level missing in a frame": lambda m: drawings(m).pop(),
    "frames in another order": lambda m: drawings(m).reverse(),
    "another level in a frame": lambda m: drawings(m)[-1].update(level=0),
}


def test_readers_agree_on_lies_about_frames(readers: Readers, tmp_path: Path) -> None:
    package = built(write_series(tmp_path, moving(2)), tmp_path / "p.volpkg").path
    assert codes_of_lies(readers, package, LIES, tmp_path) == dict.fromkeys(LIES, ("VP4011", "VP4011"))
