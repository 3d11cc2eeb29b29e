"""Segments that an app hides: the modules compute looks and skip tables, bit by bit."""

import json
import subprocess
from pathlib import Path

import pytest
from looked import texels_with_hidden
from segment_scan import built, write_segments


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("profile", ["gles3", "gles2-2048"])
def test_rays_skip_the_blocks_of_hidden_segments(profile, tmp_path: Path):
    change = {"skip": {"kind": "distance", "block": 2}}
    package = built(write_segments(tmp_path), "p", profile, change, outside_opacity=0.0)
    manifest = json.loads((package.path / "manifest.json").read_text(encoding="utf-8"))
    names = [each.name for each in package.manifest.segments.segments]
    for hidden in (names[:1], names[1:], names):
        wish = {"manifest": manifest, "folder": str(package.path), "level": 0, "hidden": hidden}
        script = str(Path(__file__).with_name("looks.mjs"))
        done = subprocess.run(["node", script], input=json.dumps(wish), capture_output=True, text=True, check=True)
        found = {name: bytes.fromhex(digits) for name, digits in json.loads(done.stdout).items()}
        assert found == texels_with_hidden(package, 0, *hidden)
    # Nothing is shown: no block is visited.
    assert all(found["skip-segments-0"])
