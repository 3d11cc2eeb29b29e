"""Segments that an app hides: the modules compute looks and skip tables, bit by bit."""

import json
import subprocess
from pathlib import Path

import pytest
from looked import look_table, texels_with_hidden
from segment_scan import DENSE_INSIDE, FAINT_STYLES, built, write_segments

JS = Path(__file__).parents[2] / "formats" / "js"


@pytest.mark.long(keep=2)
@pytest.mark.parametrize(
    ("profile", "texel"), [("gles3", "rgba16float"), ("gles3", "rgba8unorm"), ("gles2-2048", "rgba8unorm")]
)
def test_rays_skip_the_blocks_of_hidden_segments(profile, texel, tmp_path: Path):
    change = {"skip": {"kind": "distance", "block": 2}}
    faint = {"style": FAINT_STYLES} if texel == "rgba16float" else {}
    change |= {"transfer": DENSE_INSIDE} if faint else {}
    package = built(write_segments(tmp_path), "p", profile, change, outside_opacity=0.0, **faint)
    assert look_table(package).format == texel
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


WRONG = """
const { Segments } = await import("SEGMENTS");
const record = { segments: [{ name: "liver", transfer: "organs", volume_ml: 1 }], labels: [] };
const segments = new Segments({ segments: record }, "p.volpkg");
const looks = [
  ["lever", { visible: false }], ["liver", { colour: [1, 0, 0] }], ["liver", { tint: "red" }],
  ["liver", { opacity: 5 }],
  ["liver", { tint: new Float32Array([1, 0.5, 0]) }],
];
console.log(JSON.stringify(looks.map(([name, look]) => {
  try {
    segments.set(name, look);
    return segments.all[0].tint;
  } catch (error) {
    return error.message ?? String(error);
  }
})));
"""


def test_what_is_no_segment_and_no_look_is_refused_in_its_own_words() -> None:
    script = WRONG.replace("SEGMENTS", str(JS / "draw/segments.js"))
    command = ["node", "--input-type=module", "-e", script]
    *refused, tint = json.loads(subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout)
    assert [text[:6] for text in refused] == ["VP7083"] * 4
    assert "lever cannot be changed: the package has only liver" in refused[0]
    assert all(word in text for word, text in zip(("colour", "red", "5"), refused[1:], strict=True))
    assert tint == [1, 0.5, 0]
