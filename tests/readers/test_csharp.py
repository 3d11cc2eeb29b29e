"""The reader in C# for Unity, run by Mono: it reads the samples as their manifests say, and refuses damaged ones."""

import hashlib
import json
import shutil
import struct
import subprocess
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
READER = ROOT / "formats" / "apps" / "unity"
SAMPLES = sorted((ROOT / "formats" / "samples").glob("*.volpkg.zip"))


@pytest.fixture(scope="module")
def program(tmp_path_factory) -> Path:
    if shutil.which("mcs") is None or shutil.which("mono") is None:
        pytest.skip("there is no Mono (Debian: mono-mcs)")
    target = tmp_path_factory.mktemp("csharp") / "read.exe"
    sources = [*READER.glob("*.cs"), Path(__file__).with_name("ReadPackage.cs")]
    # 0649: fields of records are set by reflection.
    command = ["mcs", "-langversion:7.2", "-warnaserror", "-nowarn:0649", f"-out:{target}", *map(str, sources)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return target


def read(program: Path, *packages: Path) -> list[str]:
    done = subprocess.run(["mono", program, *packages], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def expected(path: Path) -> list[str]:
    with zipfile.ZipFile(path) as package:
        manifest = json.loads(package.read("manifest.json"))
        lines = [f"package {manifest['name']} {len(manifest['files'])} {manifest['grid']['direction'][2][0]!r}"]
        for texture in manifest["textures"]:
            data = package.read(texture["file"])
            if texture["format"] != "palette8-rgba8unorm":
                start, length = struct.unpack_from("<2Q", data, 80 + 24 * texture.get("mipmap", 0))
                data = data[start : start + length]
            shape = "x".join(map(str, texture["shape_zyx"]))
            lines.append(f"{texture['name']} {texture['format']} {shape} {hashlib.sha256(data).hexdigest()}")
    for picture in manifest["pictures"]:
        for drawing in picture["drawings"]:
            names = ",".join(drawing["textures"])
            lines.append(f"{picture['name']} {drawing['level']} {names} {drawing.get('step_mm', 0)!r}")
    return lines


def numbers(lines: list[str]) -> list[list[str]]:
    """Words of lines, the last one as a number if it is one: languages write them in other ways."""
    split = [line.split() for line in lines]
    return [[*words[:-1], words[-1] if len(words[-1]) == 64 else f"{float(words[-1]):.12g}"] for words in split]


def test_samples_are_read_as_their_manifests_say(program: Path) -> None:
    assert len(SAMPLES) > 10
    assert numbers(read(program, *SAMPLES)) == numbers([line for path in SAMPLES for line in expected(path)])


def test_damaged_packages_are_refused(program: Path, tmp_path: Path) -> None:
    data = next(path for path in SAMPLES if path.name == "scan.volpkg.zip").read_bytes()
    damaged = {"half": data[: len(data) // 2], "empty": b"", "end": data + b"\0", "text": b"x" * 1000}
    for place in range(100, len(data), len(data) // 40):
        changed = bytearray(data)
        changed[place] ^= 0x21
        damaged[f"byte-{place}"] = bytes(changed)
    for name, content in damaged.items():
        (tmp_path / name).write_bytes(content)
    told = read(program, *(tmp_path / name for name in damaged))
    # Padding between files may hold anything.
    refused = [line for line in told if line.startswith("refused VP4")]
    assert len(refused) >= len(damaged) - 4, told
