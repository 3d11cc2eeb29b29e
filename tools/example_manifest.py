"""The example manifest of formats/spec/example.md: that of a real package, which is built here, with comments.

Sizes and digests of files are zeros, because they would change with each word of a shader. The plan has one item.
"""

import tempfile
from pathlib import Path

import numpy as np
from json_lines import WIDTH, json_lines

from volprep.pipeline.build import build
from volprep.scene.request import load_request
from volprep_formats.package.manifest import Manifest
from volprep_formats.progress import Silent

_SCENE = """
name = "ball"

[source]
path = "ball.raw"
raw = { shape_zyx = [6, 8, 8], dtype = "uint8", spacing_mm_zyx = [1.5, 1.0, 1.0] }

[[transfer]]
name = "ball"
points = [
    { value = 20.0, colour = [1.0, 0.5, 0.25], extinction_per_mm = 0.0 },
    { value = 200.0, colour = [1.0, 0.5, 0.25], extinction_per_mm = 0.5 },
]

[skip]
kind = "none"
"""
_COMMENTS = {
    "compression": "compressed forms that were considered",
    "cost": "what an app uploads, and the memory that it takes",
    "direction": "row by row; the columns are the directions of x, y and z in the patient",
    "files": "every file but this one, in order of path; in a real manifest sizes and digests are not 0",
    "generator": "what wrote the package",
    "grid": "the voxels of level 0 in the patient",
    "levels": "resolutions, finest first",
    "opacity_cutoff": "early ray termination",
    "palettes": "only if shaders classify by constants",
    "pictures": "what a user can choose, the default picture first",
    "plan": "the decisions and their reasons, for people; here one item of a dozen",
    "points": "control points of the transfer function",
    "profile": "check it against your context before you upload anything",
    "programs": "shaders, which drawings name",
    "quantization": "physical = slope * code + intercept",
    "render": "how to draw",
    "samplers": "sampler n is texture unit n, and reads texture n of the drawing",
    "shape_zyx": "depth, height, width",
    "source": "the scan; never a name, a date or a place",
    "stages": "drafts only",
    "state": "drafts are not for apps",
    "statistics": "physical values of the scan",
    "textures": "everything to upload",
    "tolerance": "what validation allows for the standard views",
    "transfer_functions": "the first one is the default",
    "uniforms": "set each one to its source",
}
"""Remark on a key where it first occurs."""


def example() -> str:
    """Return the manifest of a package of a small ball, with a comment beside the first of each of some keys."""
    with tempfile.TemporaryDirectory() as folder:
        manifest = _built(Path(folder))
    record = manifest.model_dump(mode="json", exclude_none=True)
    for file in record["files"]:
        file |= {"sha256": "0" * 64, "size_bytes": 0}
    record["channels"][0]["source"]["sha256"] = "0" * 64
    record["plan"] = [item for item in record["plan"] if not item["kept"]][:1]
    left = dict(_COMMENTS)
    return "\n".join(_commented(line, left) for line in json_lines(record)) + "\n"


def _built(folder: Path) -> Manifest:
    """Build a ball that fades from its centre, and return what its manifest says."""
    z, y, x = np.mgrid[0:6, 0:8, 0:8]
    radius = np.sqrt((1.5 * (z - 2.5)) ** 2 + (y - 3.5) ** 2 + (x - 3.5) ** 2)
    np.clip(255 - 60 * radius, 0, 255).astype(np.uint8).tofile(folder / "ball.raw")
    scene, package = folder / "ball.toml", folder / "ball.volpkg"
    scene.write_text(_SCENE, encoding="utf-8")
    build(load_request(scene), package, Silent())
    return Manifest.model_validate_json((package / "manifest.json").read_bytes())


def _commented(line: str, left: dict[str, str]) -> str:
    """Add the comment of the line's key when it comes for the first time: behind it, or above it if it is long."""
    key = line.split('"')[1] if line.lstrip().startswith('"') else ""
    if key not in left:
        return line
    comment = f"// {left.pop(key)}"
    if len(line) + len(comment) + 2 <= WIDTH:
        return f"{line}  {comment}"
    return f"{line[: len(line) - len(line.lstrip())]}{comment}\n{line}"
