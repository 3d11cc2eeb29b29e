"""volpkg.h compiles wherever apps have C, and damaged packages end in codes."""

import json
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from compiled_c import WARNINGS
from every_kind import single_file
from phantom_scene import write_phantom_scene
from scene_builds import built
from web_scenes import build_scene

from volprep_formats.diagnostics import VolprepError
from volprep_formats.package.check import check
from volprep_formats.package.manifest import VERSION
from volprep_formats.package.parts.light.environment import environment_of, environment_uniform
from volprep_formats.package.reader import Package
from volprep_formats.package.storage.files import MANIFEST, names_in
from volprep_formats.package.transport import write_converted
from volprep_formats.progress import Silent
from volprep_formats.textures import ktx2

from .conftest import HEADER, output, told


def test_the_header_says_the_version_of_its_format_and_its_licence() -> None:
    text = HEADER.read_text()
    assert f"#define VOLPKG_FORMAT_MAJOR {VERSION[0]}\n#define VOLPKG_FORMAT_MINOR {VERSION[1]}\n" in text
    assert "SPDX-License-Identifier: Apache-2.0" in text[:400]


LANGUAGES = {
    "C by GCC": ("gcc", "-x", "c", "-std=c99", "-Wconversion"),
    "C by Clang": ("clang", "-x", "c", "-std=c99"),
    "C++ by GCC": ("g++", "-x", "c++", "-std=c++17", "-Wconversion"),
    "C++ by Clang": ("clang++", "-x", "c++", "-std=c++17"),
    "Objective-C": ("clang", "-x", "objective-c", "-std=c99"),
}


def installed(compiler: str) -> str:
    names = [compiler, *(f"{compiler}-{version}" for version in range(30, 12, -1))]
    found = next((name for name in names if shutil.which(name)), None)
    if found is None:
        pytest.skip(f"{compiler} is not installed")
    return found


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("language", LANGUAGES)
def test_it_compiles_without_a_warning(language, tmp_path: Path):
    compiler, *words = LANGUAGES[language]
    source = tmp_path / "one.source"
    source.write_text(f'#define VOLPKG_IMPLEMENTATION\n#include "{HEADER}"\n')
    command = [installed(compiler), *words, *WARNINGS, "-c", str(source), "-o", str(tmp_path / "one.o")]
    subprocess.run(command, check=True)


@pytest.mark.long
def test_damaged_packages_are_read_or_refused_and_nothing_else(fuzz_program, packages, tmp_path: Path):
    kinds = [
        packages[kind]
        for kind in ("house", "together", "bricks", "mipmaps", "editable", "segments", "half-angle", "slices")
    ]
    write_converted(Package.open(packages["bricks"]), "zstd", tmp_path / "p.volpkg", Silent())
    status, text = told(fuzz_program, "3", "500", *kinds, single_file(tmp_path / "p.volpkg"))
    assert status == 0, text
    assert {"VP4002", "VP4004", "VP4008", "VP4011", "VP4030", "VP4039"} <= {*text.split()}, text


def test_every_beginning_of_a_package_is_refused(fuzz_program, packages, tmp_path: Path):
    whole = packages["mipmaps"].read_bytes()
    sizes = [*range(60), *range(60, len(whole), len(whole) // 60), len(whole) - 1]
    files = [tmp_path / f"{size}.zip" for size in sizes]
    for size, file in zip(sizes, files, strict=True):
        file.write_bytes(whole[:size])
    _, text = told(fuzz_program, "--try", *files)
    assert [line.split()[0] for line in text.splitlines()] == ["4002"] * len(files)


def leaves(record: object, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:
    """Paths of all numbers, words and truths of a JSON value; of a long list only those of its first two entries."""
    if isinstance(record, dict):
        return [each for key, value in record.items() for each in leaves(value, (*path, key))]
    if isinstance(record, list):
        return [each for index, value in enumerate(record[:2]) for each in leaves(value, (*path, index))]
    return [path]


def changed(manifest: dict, path: tuple[str | int, ...]) -> str:
    """Give the manifest with another value of the same type at a path."""
    copy = json.loads(json.dumps(manifest))
    place = copy
    for key in path[:-1]:
        place = place[key]
    value = place[path[-1]]
    other = not value if isinstance(value, bool) else f"{value}x" if isinstance(value, str) else value + 1
    place[path[-1]] = other
    return json.dumps(copy)


def verdicts_of_the_reader(folder: Path) -> set[str]:
    """Codes of all that the Python reader finds in a package, or nothing."""
    try:
        Package.open(folder)
    except VolprepError as error:
        return {error.code, *(finding.code for finding in check(folder))}
    return {finding.code for finding in check(folder)}


@pytest.mark.long
@pytest.mark.parametrize("kind", ["house", "together", "slices", "several-units"])
def test_a_lie_in_any_field_of_the_manifest_ends_as_in_the_reader(kind, fuzz_program, packages, tmp_path: Path):
    """Both take the manifest, or both refuse it, the header with one of the reader's codes."""
    folder = packages[kind].with_suffix("")
    copy = tmp_path / "p.volpkg"
    shutil.copytree(folder, copy)
    manifest = json.loads((folder / MANIFEST).read_text())
    # Nothing can contradict these.
    skipped = {"reason", "generator", "statistics", "sha256"}
    paths = [path for path in leaves(manifest) if not skipped & {*path}][::4]
    files, expected = [], []
    for number, path in enumerate(paths):
        (copy / MANIFEST).write_text(changed(manifest, path))
        expected.append(verdicts_of_the_reader(copy))
        files.append(single_file(copy, tmp_path / f"{number}.zip"))
    _, lines = told(fuzz_program, "--try", *files)
    wrong = []
    for path, codes, line in zip(paths, expected, lines.splitlines(), strict=True):
        number, text = line.split(" ", 1)
        if (number == "0") != (not codes) or (codes and f"VP{number}" not in codes):
            wrong.append(f"{'.'.join(map(str, path))}: the reader says {codes or 'nothing'}, the header {text}")
    assert wrong == []
    assert any(codes for codes in expected)


def test_a_file_with_another_digest_is_found_when_it_is_asked_for(dump_program, packages, tmp_path: Path):
    copy = tmp_path / "p.volpkg"
    shutil.copytree(packages["mipmaps"].with_suffix(""), copy)
    name = json.loads((copy / MANIFEST).read_text())["programs"][0]["fragment"]
    (copy / name).write_bytes((copy / name).read_bytes().replace(b"0", b"1", 1))
    status, text = told(dump_program, single_file(copy))
    assert status == 1
    assert f"VP4009 {name}" in text


def test_an_internal_format_that_does_not_go_with_its_texels_is_refused(fuzz_program, packages, tmp_path: Path):
    copy = tmp_path / "p.volpkg"
    shutil.copytree(packages["mipmaps"].with_suffix(""), copy)
    manifest = json.loads((copy / MANIFEST).read_text())
    manifest["textures"][0]["format"] = "r16float"
    (copy / MANIFEST).write_text(json.dumps(manifest))
    _, text = told(fuzz_program, "--try", single_file(copy))
    assert text.startswith("4011 VP4011")


def wide(package: Path, target: Path) -> Path:
    """Write the files of a package as a zip that says all of its sizes in fields of 64 bits (ZIP64)."""
    with zipfile.ZipFile(target, "w") as archive:
        for name in sorted(names_in(package), key=lambda name: (name != MANIFEST, name)):
            with archive.open(zipfile.ZipInfo(name), "w", force_zip64=True) as file:
                file.write((package / name).read_bytes())
    data = target.read_bytes()
    count, directory_bytes, directory_at = struct.unpack_from("<H2I", data, len(data) - 12)
    record = struct.pack("<IQ2H2I4Q", 0x06064B50, 44, 45, 45, 0, 0, count, count, directory_bytes, directory_at)
    locator = struct.pack("<IIQI", 0x07064B50, 0, len(data) - 22, 1)
    end = struct.pack("<I4H2IH", 0x06054B50, 0, 0, 65535, 65535, 2**32 - 1, 2**32 - 1, 0)
    target.write_bytes(data[:-22] + record + locator + end)
    return target


def test_a_zip_with_sizes_of_64_bits_is_read(fuzz_program, packages, tmp_path: Path):
    folder = packages["mipmaps"].with_suffix("")
    whole = wide(folder, tmp_path / "wide.zip")
    assert Package.open(whole).manifest == Package.open(folder).manifest
    _, text = told(fuzz_program, "--try", whole)
    assert text == "0 read\n"


def test_two_end_records_that_differ_are_refused(fuzz_program, packages, tmp_path: Path):
    data = bytearray(wide(packages["mipmaps"].with_suffix(""), tmp_path / "wide.zip").read_bytes())
    data[-12:-10] = struct.pack("<H", 3)  # the number of files, which the other record says, too
    data[-14:-12] = data[-12:-10]
    (tmp_path / "lie.zip").write_bytes(data)
    _, text = told(fuzz_program, "--try", tmp_path / "lie.zip")
    assert "the two end records of the zip differ" in text


def test_textures_that_travel_as_frames_are_refused_with_what_to_do(fuzz_program, packages, tmp_path: Path):
    write_converted(Package.open(packages["house"]), "zstd", tmp_path / "p.volpkg", Silent())
    _, text = told(fuzz_program, "--try", single_file(tmp_path / "p.volpkg"))
    assert text.startswith("7062 ")
    assert "volprep zip --texels plain" in text


@pytest.mark.long(keep=1)
@pytest.mark.parametrize("kind", ["house", "mipmaps", "segments"])
def test_folders_and_unpacked_textures_have_the_texels_of_the_zip(kind, open_program, packages, tmp_path: Path):
    folder, frames = packages[kind].with_suffix(""), tmp_path / "p.volpkg"
    write_converted(Package.open(folder), "zstd", frames, Silent())
    assert list(check(frames)) == []
    of_zip, of_folder = output(open_program, packages[kind]), output(open_program, folder)
    unpacked = output(open_program, frames, "unpack")
    assert of_zip == of_folder == unpacked
    assert len(of_zip.splitlines()) > 3


def test_folders_are_refused_with_the_codes_of_the_reader(open_program, packages, tmp_path: Path):
    folder = tmp_path / "p.volpkg"
    shutil.copytree(packages["mipmaps"].with_suffix(""), folder)
    shader = json.loads((folder / MANIFEST).read_text())["programs"][0]["fragment"]
    text = (folder / shader).read_text()
    changes = {"VP4010": ("more.txt", "x"), "VP4009": (shader, text.replace("0", "1", 1)), "VP4008": (shader, "")}
    for code, (name, written) in changes.items():
        (folder / name).write_text(written)
        status, said = told(open_program, folder)
        assert (status, said[:6]) == (1, code)
        (folder / "more.txt").unlink(missing_ok=True)
    for code, name in {"VP4007": shader, "VP4002": MANIFEST}.items():
        (folder / name).unlink()
        status, said = told(open_program, folder)
        assert (status, said[:6]) == (1, code)


def test_damaged_frames_are_refused(open_program, packages, tmp_path: Path):
    frames = tmp_path / "p.volpkg"
    write_converted(Package.open(packages["house"]), "zstd", frames, Silent())
    files = [frames / each["path"] for each in json.loads((frames / MANIFEST).read_text())["files"]]
    packed = next(path for path in files if ktx2.is_supercompressed(path.read_bytes()[: ktx2.HEADER_BYTES]))
    data = packed.read_bytes()
    for at in (-1, -len(data) // 3, data.index(b"\x28\xb5\x2f\xfd") + 4):
        damaged = bytearray(data)
        damaged[at] ^= 0x55
        packed.write_bytes(damaged)
        status, said = told(open_program, frames, "unpack")
        assert status == 1
        # What unpacks to other texels is found by the digest.
        assert said[:6] in {"VP4030", "VP4009"}, said


@pytest.mark.long
def test_windows_maps_files(tmp_path: Path):
    compiler = "x86_64-w64-mingw32-gcc"
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed (Debian: gcc-mingw-w64-x86-64-win32)")
    source = tmp_path / "one.c"
    source.write_text(
        f'#include <windows.h>\n#define VOLPKG_IMPLEMENTATION\n#include "{HEADER}"\n'
        "int main(int count, char** words) {\n    volpkg_mapping file;\n    volpkg_folder folder;\n"
        "    static char room[4096];\n    return count > 1 && volpkg_map(words[1], &file, NULL) &&\n"
        "           volpkg_map_folder(words[1], room, sizeof room, &folder, NULL);\n}\n"
    )
    command = [compiler, "-std=c99", *WARNINGS, str(source), "-o", str(tmp_path / "one.exe")]
    subprocess.run(command, check=True)


MOVED = """
#define VOLPKG_IMPLEMENTATION
#include "volpkg.h"
int main(int count, char** names) {
    static unsigned char arena[1 << 22];
    volpkg_mapping file;
    volpkg_error error;
    volpkg_drawing drawing;
    double matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    float value[16];
    int turn, i, k;
    const volpkg_package* p;
    if (count < 2 || volpkg_map(names[1], &file, &error)) return 2;
    p = volpkg_open(file.data, file.size, arena, sizeof arena, &error);
    if (p == NULL || volpkg_choose(p, NULL, -1, &drawing, &error)) return printf("%s\\n", error.text), 3;
    for (turn = 0; turn < 2; ++turn) {
        for (i = 0; i < drawing.program->uniforms.count; ++i)
            if (drawing.program->uniforms.at[i].source == VOLPKG_UNIFORM_SOURCE_LIGHT_MM) {
                volpkg_uniform(&drawing, &drawing.program->uniforms.at[i], matrix, 1.0, value);
                printf("%.9g %.9g %.9g\\n", value[0], value[1], value[2]);
            } else if (drawing.program->uniforms.at[i].source == VOLPKG_UNIFORM_SOURCE_ENVIRONMENT) {
                int numbers = volpkg_uniform(&drawing, &drawing.program->uniforms.at[i], matrix, 1.0, value);
                for (k = 0; k < numbers; ++k) printf("%.9g%c", value[k], k + 1 < numbers ? ' ' : '\\n');
            }
        for (k = 0; k < 3; ++k) drawing.environment[0][k] = 0.5 + k, drawing.environment[2][k] = 0.25 * k;
        drawing.light_mm_xyz[0] = 7;
        drawing.light_mm_xyz[1] = -8;
        drawing.light_mm_xyz[2] = 9;
    }
    return 0;
}
"""


def moved(folder: Path, package: Path) -> str:
    """Return what the program above prints for a package."""
    (folder / "moved.c").write_text("#include <stdio.h>\n" + MOVED)
    command = ["cc", "-std=c99", *WARNINGS, f"-I{HEADER.parent}", folder / "moved.c", "-o", folder / "moved", "-lm"]
    subprocess.run(command, check=True)
    status, text = told(folder / "moved", single_file(package))
    assert status == 0, text
    return text


def test_an_app_turns_the_light_around_the_volume(tmp_path: Path):
    package = build_scene("light that turns, in a mosaic", tmp_path)
    model = next(each.light.model for each in package.manifest.textures if each.light is not None)
    environment = environment_of(model)
    lines = [[float(word) for word in line.split()] for line in moved(tmp_path, package.path).splitlines()]
    np.testing.assert_allclose(lines[0], environment_uniform(environment).T.ravel(), atol=1e-6)
    environment[0], environment[2] = [0.5, 1.5, 2.5], [0.0, 0.25, 0.5]
    np.testing.assert_allclose(lines[1], environment_uniform(environment).T.ravel(), atol=1e-6)


@pytest.mark.long
def test_an_app_moves_the_light(tmp_path: Path):
    lit = '[render]\nlighting = "phong"\n[lighting]\nlight_mm = [20.0, -30.0, 40.0]\nnormals = "central"\n'
    scene = write_phantom_scene(tmp_path, more=f"\n{lit}")
    built(scene, tmp_path / "p.volpkg")
    text = moved(tmp_path, tmp_path / "p.volpkg")
    grid = Package.open(tmp_path / "p.volpkg").manifest.grid
    for line, place in zip(text.splitlines(), ((20.0, -30.0, 40.0), (7.0, -8.0, 9.0)), strict=True):
        wanted = np.linalg.inv(grid.world_from_box) @ [*place, 1.0]
        np.testing.assert_allclose([float(word) for word in line.split()], wanted[:3], rtol=1e-6, atol=1e-5)
