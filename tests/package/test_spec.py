"""formats/spec says what the code does: its tables are the models', its formulas give the field.

The tables of sample_specs/README.md are made in the same way.
"""

import importlib.util
import inspect
import itertools
import json
import math
import re
import struct
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from volprep.truth.camera import standard_views
from volprep_formats import meshes
from volprep_formats.diagnostics import CATALOGUE
from volprep_formats.package import check, manifest, manifest_json, reader
from volprep_formats.package.manifest_json import MAX_MANIFEST_BYTES
from volprep_formats.package.parts.editing import record as editing
from volprep_formats.package.reader import Package
from volprep_formats.package.storage import contents, files, single_file
from volprep_formats.textures import ktx2, paletted
from volprep_formats.textures.texel_formats import COMPONENTS

ROOT = Path(__file__).parents[2]
FOLDER = ROOT / "formats" / "spec"
TABLES = (FOLDER / "fields.md", ROOT / "sample_specs" / "README.md")
GENERATED = (*TABLES, FOLDER / "example.md")
WRITTEN = sorted(set(FOLDER.glob("*.md")) - set(GENERATED))
SPEC = "\n".join(path.read_text(encoding="utf-8") for path in (*WRITTEN, ROOT / "docs" / "CHECKS.md"))


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_spec", ROOT / "tools" / "make_spec.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "tools")
        spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("path", [*GENERATED, *WRITTEN], ids=lambda path: path.name)
def test_the_tables_of_fields_are_those_of_the_models_and_the_examples_those_of_builds(
    path: Path, generator: ModuleType
) -> None:
    assert generator.generated(path) == path.read_text(encoding="utf-8"), (
        f"{path} is old: run python tools/make_spec.py"
    )


def test_the_example_manifest_without_its_comments_is_a_manifest() -> None:
    (text,) = re.findall(
        r"^```jsonc\n(.*?)^```$", (FOLDER / "example.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL
    )
    example = manifest.Manifest.model_validate_json(re.sub(r"(^|  )//.*$", "", text, flags=re.MULTILINE))
    assert example.state == "sealed"
    assert [program.transfer for program in example.level_programs] == ["ball"]
    assert len(re.findall(r"//", text)) > 20


@pytest.mark.parametrize("path", TABLES, ids=lambda path: path.name)
def test_every_record_and_every_field_has_its_place(path: Path, generator: ModuleType) -> None:
    records, text = generator.records_of(path), path.read_text(encoding="utf-8")
    section = r"^(?:## |<!-- fields of )(\w+)(?: -->)?\n(.*?)(?=^## |^<!-- |\Z)"
    parts = dict(re.findall(section, text, re.MULTILINE | re.DOTALL))
    assert set(parts) >= set(records)
    for name in records:
        table = parts[name]
        assert re.findall(r"^\| `([\w.]+)` \|", table, re.MULTILINE) == list(generator.own_fields(name, records))
        assert "|  |" not in table


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_a_page_is_short(path: Path) -> None:
    assert path.stat().st_size <= (40_000 if path.name == "README.md" else 10_000)


@pytest.mark.parametrize("path", WRITTEN, ids=lambda path: path.name)
def test_each_name_in_the_text_is_a_field_or_a_name_of_shaders(path: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    names = re.findall(r"\b[a-z]{2,}(?:_[a-z]+)+\b", " ".join(re.findall(r"`([^`\n]+)`", text)))
    fields = re.findall(r"\w+", "".join(page.read_text(encoding="utf-8") for page in GENERATED))
    assert set(names) - set(fields) <= {
        "clip_from_world",
        "world_from_box",
        "your_from_world",
        "scan_value",
        "box_x",
        "box_y",
        "box_z",
        "volume_looks",
    }


def test_every_code_that_a_check_can_give_is_in_the_table() -> None:
    told = set(re.findall(r"^\| (VP4\d{3}) \|", SPEC, re.MULTILINE))
    readers = (check, contents, editing, files, manifest_json, meshes, ktx2, paletted, reader, single_file)
    sources = "".join(inspect.getsource(module) for module in readers)
    # VP4014 and VP4054 are for callers that ask for a file or a frame that is not there, VP4020 for writers.
    assert told == set(re.findall(r"VP4\d{3}", sources)) - {"VP4014", "VP4020", "VP4054"}
    assert told <= set(CATALOGUE)


def test_the_limits_in_the_text_are_those_of_the_code() -> None:
    assert f"{MAX_MANIFEST_BYTES:,}".replace(",", " ") in SPEC
    assert manifest.PackagePath.__metadata__[0].metadata[0].pattern in SPEC


@pytest.mark.parametrize(
    "texture_format",
    [
        "r8unorm",
        "rg8unorm",
        "rgb8unorm",
        "rgb8snorm",
        "rgba8unorm",
        "rgba8snorm",
        "r16unorm",
        "r16float",
        "rgba16float",
    ],
)
def test_the_layout_of_a_texture_file_is_the_one_in_the_text(texture_format: ktx2.Ktx2Format) -> None:
    data = ktx2.header(texture_format, (1, 3, 5), 2)
    (vk_format,) = struct.unpack_from("<I", data, 12)
    (row,) = [line for line in SPEC.splitlines() if line.startswith(f"| `{texture_format}` | {vk_format} ")]
    texel_bytes = int(row.split("|")[-2])
    channels = COMPONENTS[texture_format]
    assert struct.unpack_from("<2I", data, 48) == (104, 28 + 16 * channels)
    assert struct.unpack_from("<Q", data, 80) == (len(data),)
    assert len(data) % math.lcm(4, texel_bytes) == 0
    assert struct.unpack_from("<2Q", data, 88) == (15 * texel_bytes,) * 2


def test_step_4_finds_the_texels_without_a_library(sealed: Path) -> None:
    for texture in Package.open(sealed).manifest.textures:
        data = (sealed / texture.file).read_bytes()
        (size,) = struct.unpack_from("<Q", data, 88)
        assert data[-size:] == ktx2.decode(data, "t").data.tobytes()


def mix(a: float, b: float, weight: float) -> float:
    return a + (b - a) * weight


def linear_sample(texels: np.ndarray, x: float, y: float) -> float:
    """GL's linear filter at unnormalised texture coordinates, CLAMP_TO_EDGE."""
    height, width = texels.shape
    x, y = x - 0.5, y - 0.5
    column, row = math.floor(x), math.floor(y)
    columns = [min(max(at, 0), width - 1) for at in (column, column + 1)]
    rows = [min(max(at, 0), height - 1) for at in (row, row + 1)]
    upper, lower = ([float(texels[at, each]) for each in columns] for at in rows)
    return mix(mix(*upper, x - column), mix(*lower, x - column), y - row)


def trilinear(voxels: np.ndarray, at_zyx: tuple[float, float, float]) -> float:
    """The field at a position in voxels, whose corner is at 0."""
    clamped = [min(max(at - 0.5, 0), n - 1) for at, n in zip(at_zyx, voxels.shape, strict=True)]
    base = [min(math.floor(at), max(n - 2, 0)) for at, n in zip(clamped, voxels.shape, strict=True)]
    total = 0.0
    for corner in itertools.product((0, 1), repeat=3):
        weight = math.prod(abs(1 - c - (at - b)) for c, at, b in zip(corner, clamped, base, strict=True))
        if weight:
            total += weight * float(voxels[tuple(b + c for b, c in zip(base, corner, strict=True))])
    return total


def test_the_formula_for_mosaics_gives_the_trilinear_field(sealed_mosaic: Path) -> None:
    package = Package.open(sealed_mosaic)
    (texture,) = (each for each in package.manifest.textures if each.role == "volume")
    layout = texture.mosaic
    assert layout is not None
    texels = ktx2.decode(package.read_bytes(texture.file), "t").data[0]
    (height, width), slices = layout.tile_shape_yx, layout.slices
    voxels = np.random.default_rng(0).integers(0, 256, (slices, height, width), np.uint8)

    def fetch(k: int, x: float, y: float) -> float:
        tile = k // layout.slices_per_texel
        column, row = tile % layout.tiles_x, tile // layout.tiles_x
        return linear_sample(texels, column * width + x, row * height + y)

    for z, y, x in np.random.default_rng(1).uniform(-0.5, 1.5, (300, 3)) * voxels.shape:
        at = min(max(z - 0.5, 0), slices - 1)
        lower = math.floor(at)
        upper = min(lower + 1, slices - 1)
        inside = (min(max(x, 0.5), width - 0.5), min(max(y, 0.5), height - 0.5))
        value = mix(fetch(lower, *inside), fetch(upper, *inside), at - lower)
        assert value == pytest.approx(trilinear(voxels, (z, y, x)), abs=1e-9)


def test_the_formulas_for_spaces_are_those_of_the_grid(sealed: Path) -> None:
    record = json.loads((sealed / "manifest.json").read_text())
    levels, (picture,) = Package.open(sealed).manifest.levels, record["pictures"]
    drawn = zip(levels, record["channels"][0]["levels"], picture["drawings"], strict=True)
    for level, fields, drawing in drawn:
        grid = fields["grid"]
        direction, origin = np.array(grid["direction"]), np.array(grid["origin_mm_xyz"])
        spacing_xyz = np.array(grid["spacing_mm_zyx"][::-1])
        corner = origin - direction @ (spacing_xyz / 2)
        np.testing.assert_allclose(corner, levels[0].grid.corner_mm_xyz, rtol=0, atol=1e-12)
        np.testing.assert_allclose(level.grid.world_from_box[:3, :3], direction, rtol=0, atol=0)
        index = np.array([2.0, 1.0, 3.0])
        world = origin + direction @ (spacing_xyz * index)
        np.testing.assert_allclose(level.grid.world_from_index @ [*index, 1.0], [*world, 1.0], rtol=0, atol=1e-12)
        box = direction.T @ (world - corner)
        texture = box * drawing["values"][0]["numbers"]
        np.testing.assert_allclose(texture, (index + 0.5) / grid["shape_zyx"][::-1], rtol=0, atol=1e-12)


def test_the_standard_views_are_those_of_the_text(sealed: Path) -> None:
    grid = Package.open(sealed).manifest.grid
    assert grid is not None
    told: dict[str, list[tuple[float, ...]]] = {}
    for row in re.findall(r"^\| ((?:anterior|posterior|left|superior)[^|]*)\|([^|]*)\|([^|]*)\|$", SPEC, re.MULTILINE):
        names, views, (up,) = row[0].split(","), _vectors(row[1]), _vectors(row[2])
        told |= {name.strip(): [view, up] for name, view in zip(names, views, strict=True)}
    d = math.dist((0, 0, 0), grid.extent_mm_zyx)
    middle = (grid.world_from_box @ [*np.divide(grid.extent_mm_zyx[::-1], 2), 1])[:3]
    for projection, eye, field, planes in (
        ("orthographic", d, d, (0, 2 * d)),
        ("perspective", 2 * d, 1.2 * d, (0.02 * d, 4 * d)),
    ):
        found = standard_views(grid, projection)
        assert list(found) == list(told)
        for name, camera in found.items():
            assert [camera.forward, camera.up] == told[name]
            forward = np.divide(camera.forward, math.dist((0, 0, 0), camera.forward))
            assert np.allclose(middle - eye * forward, camera.eye_mm_xyz)
            ends = np.array([[0, 0, -1, 1], [0, 0, 1, 1]]) @ camera.world_from_clip(1).T
            assert np.allclose((ends[:, :3] / ends[:, 3:] - camera.eye_mm_xyz) @ forward, planes)
            corner = np.linalg.inv(camera.world_from_clip(1)) @ [*(middle + field / 2 * _unit(camera.up, forward)), 1]
            assert np.isclose(corner[1] / corner[3], 1)


def _vectors(text: str) -> list[tuple[float, ...]]:
    found = re.findall(r"\(([^)]*)\)", text.replace("−", "-"))
    return [tuple(float(number) for number in each.split(",")) for each in found]


def _unit(up: tuple[float, ...], forward: np.ndarray) -> np.ndarray:
    across = np.array(up) - np.dot(up, forward) * forward
    return across / np.linalg.norm(across)
