"""Packages in one file of every kind: each part that a package may have is in one of them.

`python tests/support/every_kind.py FOLDER` writes them for `make fuzz-c`.
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from channel_scene import write_channel_scene
from phantom_scene import write_phantom_scene
from tamper_scenes import KINDS, write_kind

from volprep.pipeline.build import build
from volprep.scene.request import load_request
from volprep_formats.package.storage.files import names_in
from volprep_formats.package.storage.single_file import write_single_file
from volprep_formats.progress import Silent

SMALL_PROFILE = """
name = "small"
api = "es2.0"
max_texture_size = 64
max_3d_texture_size = 0
texture_units = 8
texture_formats = ["LUMINANCE8", "LUMINANCE_ALPHA8", "RGB8", "RGBA8"]
index_bits = 16
max_texture_bytes = 67_108_864
"""


def single_file(package: Path, target: Path | None = None) -> Path:
    """Write all files of a package, sound or not, as one file, which lies beside it if not told; give its path."""
    target = target or package.with_name(f"{package.name}.zip")
    with target.open("wb") as file:
        write_single_file(package, names_in(package), file, Silent())
    return target


def _together(folder: Path) -> Path:
    scene = write_channel_scene(folder)
    scene.write_text(f'{scene.read_text()}\n[together]\nname = "body"\n')
    return scene


def _several_units(folder: Path) -> Path:
    (folder / "small.toml").write_text(SMALL_PROFILE)
    scene = write_phantom_scene(folder, "gles2-2048")
    text = scene.read_text().replace('profile = "gles2-2048"', 'profile = "small.toml"')
    light = '[lighting]\nlight_mm = [20.0, -30.0, 40.0]\nshininess = 5.0\nnormals = "central"\n'
    scene.write_text(f'{text}\n[render]\nprojection = "perspective"\nlighting = "blinn-phong"\n{light}')
    return scene


def _hybrid(folder: Path) -> Path:
    scene = write_phantom_scene(folder, "gles3")
    scene.write_text(f'{scene.read_text()}\n[render]\ntechnique = "tiles"\n[hybrid]\nlongest_side = 32\n')
    return scene


def write_every_kind(folder: Path) -> dict[str, Path]:
    """Build a package of each kind in a folder; give its single file, by the name of the kind."""
    kinds = {kind: (lambda place, kind=kind: write_kind(place, kind)) for kind in KINDS}
    kinds |= {"together": _together, "several-units": _several_units, "hybrid": _hybrid}
    made = {}
    with patch("os.fsync"):
        for kind, write in kinds.items():
            package = folder / f"{kind}.volpkg"
            with TemporaryDirectory() as place:
                build(load_request(write(Path(place))), package, Silent())
            made[kind] = single_file(package)
    return made


if __name__ == "__main__":
    target = Path(sys.argv[1])
    target.mkdir(parents=True, exist_ok=True)
    if not list(target.glob("*.zip")):
        write_every_kind(target)
