"""Edited transfer functions: the header computes the tables that the renderer draws with, bit by bit."""

from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
import pytest
import scene_builds
from every_kind import single_file
from slice_packages import slice_package
from tamper_scenes import write_kind

from volprep.parts.editing.inputs import edited_inputs
from volprep.parts.light import decision, solve
from volprep.render.inputs import level_inputs
from volprep.transfer.preclassified import code_colours, largest_opacity
from volprep_formats.package.reader import Package
from volprep_formats.package.transfer_function import TransferFunction, TransferPoint
from volprep_formats.textures import ktx2

from .conftest import SANITIZERS, compiled, output, told

POINTS = {
    "ramp": ((40.0, (0.1, 0.2, 0.9), 0.0), (90.0, (0.2, 0.9, 0.3), 0.08), (210.0, (1.0, 0.1, 0.05), 0.9)),
    # A jump from haze to a wall, and one back to nothing.
    "jumps": (
        (30.0, (0.3, 0.3, 0.3), 0.001),
        (120.0, (0.3, 0.3, 0.3), 0.001),
        (120.0, (1.0, 0.5, 0.0), 4.0),
        (180.0, (1.0, 0.5, 0.0), 4.0),
        (180.0, (0.0, 0.0, 1.0), 0.0),
    ),
    "one point": ((100.0, (0.5, 0.5, 0.5), 0.01),),
}


@dataclass(frozen=True)
class Editable:
    """A package, as a folder and as a file."""

    package: Package
    file: Path


@pytest.fixture(scope="module")
def edit_program(tmp_path_factory) -> Path:
    source = Path(__file__).with_name("edit_texels.c")
    return compiled(tmp_path_factory.mktemp("edit") / "edit", source, *SANITIZERS)


def built(folder: Path, *changes: tuple[str, str]) -> Editable:
    scene = write_kind(folder, "editable")
    text = scene.read_text()
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    scene.write_text(text)
    with patch.object(solve, "BATCH", 1 << 13), patch.object(decision, "_LEAST_SAMPLES", 1 << 13):
        scene_builds.built(scene, folder / "p.volpkg")
    return Editable(Package.open(folder / "p.volpkg"), single_file(folder / "p.volpkg"))


SKIP = "[skip]\nranges = true"
SCENES = {
    "distance": ((SKIP, f'{SKIP}\nkind = "distance"\nblock = 2'),),
    "blocks": ((SKIP, f'{SKIP}\nkind = "blocks"\nblock = 2'),),
    "table16": ((SKIP, f'{SKIP}\nkind = "table16"\nblock = 2'),),
    "mosaic": (('profile = "gles3"', 'profile = "gles2-2048"'), (SKIP, f"{SKIP}\nblock = 2")),
    "baked light": ((SKIP, f'{SKIP}\nblock = 2\n[lighting]\nbaked = "shadow"\nlight_mm = [40.0, -60.0, 50.0]'),),
    "light that turns": (
        (SKIP, f'{SKIP}\nblock = 2\n[lighting]\nbaked = "occlusion"\nresolution = 4\nturnable = true'),
    ),
    "maximum": ((SKIP, f'{SKIP}\nblock = 2\n[render]\ncompositing = "maximum"'),),
}


def expected(package: Package, level: int, function: TransferFunction) -> dict[str, bytes]:
    """Texels of the tables that the renderer draws an edit with."""
    inputs = level_inputs(package, level, function.name)
    return {
        name: np.asarray(texels).tobytes() for name, texels in edited_inputs(package, inputs, function).texels.items()
    }


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("kind", SCENES)
def test_the_tables_of_an_edit_are_those_of_the_renderer(kind, edit_program, tmp_path: Path):
    made = built(tmp_path, *SCENES[kind])
    manifest = made.package.manifest
    before = manifest.transfer_functions[0]
    for level in [each.index for each in manifest.levels]:
        for points in POINTS.values():
            listed = tuple(TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in points)
            function = TransferFunction(name=before.name, points=listed, reference_mm=before.reference_mm)
            words = [",".join(map(repr, (v, *c, e))) for v, c, e in points]
            lines = output(edit_program, made.file, before.name, str(level), *words).splitlines()
            found, own = lines[: len(lines) // 2], lines[len(lines) // 2 :]
            texels = expected(made.package, level, function)
            assert {name: bytes.fromhex(digits) for name, digits in map(str.split, found)} == texels
            # Taken back, they are the package's own.
            for name, digits in map(str.split, own):
                texture = next(each for each in manifest.textures if each.name == name)
                data = ktx2.decode(made.package.read_bytes(texture.file), texture.file).data
                assert bytes.fromhex(digits) == np.asarray(data).tobytes()


def test_the_palettes_of_an_edit_of_slices_are_those_of_the_renderer(edit_program, tmp_path: Path):
    codes = np.random.default_rng(3).integers(0, 256, (5, 9, 13))
    package = slice_package(tmp_path, codes, (2.5, 0.75, 1.0), head="editable = true")
    textures = {each.name: each for each in package.manifest.textures}
    nothing = ((0.0, (1.0, 1.0, 1.0), 0.0),)
    for points in (*POINTS.values(), nothing):
        listed = tuple(TransferPoint(value=v, colour=c, extinction_per_mm=e) for v, c, e in points)
        words = [",".join(map(repr, (v, *c, e))) for v, c, e in points]
        lines = output(edit_program, single_file(package.path), "ramp", "-1", *words).splitlines()
        assert len(lines) == 2 * len(textures)
        for number, (name, digits, opacity) in enumerate(map(str.split, lines)):
            file = package.read_bytes(textures[name].file)
            palette = code_colours(
                TransferFunction(name="ramp", points=listed), (0.0, 255.0), textures[name].reference_mm
            )
            edited = number < len(textures)
            # Taken back, they are the package's own.
            assert bytes.fromhex(digits) == (palette.tobytes() + file[1024:] if edited else file)
            assert float(opacity) == (largest_opacity(palette) if edited else textures[name].slices.largest_opacity)


def test_what_cannot_be_edited_is_refused_with_a_code(edit_program, packages):
    def refused(kind: str, *words: str) -> str:
        transfer = Package.open(packages[kind]).manifest.transfer_functions[0].name
        status, text = told(edit_program, packages[kind], transfer, "0", *words)
        assert status == 1
        return text

    assert refused("mipmaps", "1,0,0,0,1").startswith("VP5023 ")
    assert refused("slices", "1,0,0,0,1").startswith("VP5023 ")
    assert refused("editable").startswith("VP7020 ")
    for words in (("2,0,0,0,1", "1,0,0,0,1"), ("1,2,0,0,1",), ("1,0,0,0,-1",), ("nan,0,0,0,1",)):
        assert refused("editable", *words).startswith("VP7020 ")
