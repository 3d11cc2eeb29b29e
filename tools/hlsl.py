"""`python tools/hlsl.py PACKAGE FOLDER`: shaders of a package as HLSL (shader model 5), for Unity.

glslangValidator compiles GLSL to SPIR-V, spirv-cross makes HLSL of it, and glslang's front end for HLSL checks the
result. Uniforms keep the names and meanings of the manifest; samplers become a texture and a sampler each.
"""

import re
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from volprep_formats.package.reader import Package

_STAGES = ("vert", "frag")


def converted(name: str, text: str, folder: Path) -> str:
    """Return a shader as HLSL. Raises CalledProcessError if a tool refuses it."""
    stage = name.rpartition(".")[2]
    glsl, spirv, hlsl = (folder / f"shader.{end}" for end in (stage, "spv", "hlsl"))
    # SPIR-V needs 310 of OpenGL ES, which has all of 300.
    glsl.write_text(re.sub(r"^#version 300 es", "#version 310 es", text), encoding="utf-8")
    _ran("glslangValidator", "-G", "--aml", "--amb", "-o", spirv, glsl)
    _ran("spirv-cross", "--hlsl", "--shader-model", "50", "--output", hlsl, spirv)
    _ran("glslangValidator", "-D", "-V", "-e", "main", "-S", stage, "--aml", "--amb", "-o", spirv, hlsl)
    return hlsl.read_text(encoding="utf-8")


def _ran(*command: str | Path) -> None:
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=60)


def main(package: Path, out: Path) -> None:
    """Convert all shaders of a package for OpenGL ES 3."""
    held = Package.open(package)
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory() as scratch:
        for file in held.manifest.files:
            name = Path(file.path).name
            if file.role != "shader" or name.rpartition(".")[2] not in _STAGES:
                continue
            text = converted(name, held.read_bytes(file.path).decode(), Path(scratch))
            (out / f"{name}.hlsl").write_text(text, encoding="utf-8")
            print(f"{name}.hlsl: {text.count(chr(10))} lines")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
