"""C programs of the tests, compiled once for the same text, flags and compiler: with sanitizers one takes 3 seconds."""

import hashlib
import os
import resource
import shutil
import subprocess
from pathlib import Path

import pytest

WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic")
# AddressSanitizer reserves 15 TB of addresses, which a limit of the address space (ulimit -v) forbids.
_HAS_ADDRESSES = resource.getrlimit(resource.RLIMIT_AS)[0] == resource.RLIM_INFINITY
_KEPT = Path(__file__).parents[2] / ".pytest_cache" / "d" / "volprep-compiled"
SANITIZERS = (f"-fsanitize={'address,' if _HAS_ADDRESSES else ''}undefined", "-fno-sanitize-recover=all")


def compiled(target: Path, source: Path, *flags: str) -> Path:
    """Compile a C program. Skips the test if there is no compiler."""
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    command = ["cc", "-std=c99", *WARNINGS, "-g", str(source), *flags, "-lm"]
    text = subprocess.run([*command, "-E"], check=True, capture_output=True).stdout
    version = subprocess.run(["cc", "--version"], check=True, capture_output=True).stdout
    kept = _KEPT / hashlib.sha256(b"\0".join([text, version, *map(str.encode, command)])).hexdigest()
    if not kept.exists():
        subprocess.run([*command, "-o", target], check=True)
        _KEPT.mkdir(parents=True, exist_ok=True)
        # Another worker may do the same.
        new = kept.with_name(f"{kept.name}.{os.getpid()}")
        shutil.copy2(target, new)
        new.replace(kept)
    shutil.copy2(kept, target)
    return target
