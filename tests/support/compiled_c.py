"""C programs of the tests, compiled."""

import resource
import shutil
import subprocess
from pathlib import Path

import pytest

WARNINGS = ("-Wall", "-Wextra", "-Werror", "-pedantic")
# AddressSanitizer reserves 15 TB of addresses, which a limit of the address space (ulimit -v) forbids.
_HAS_ADDRESSES = resource.getrlimit(resource.RLIMIT_AS)[0] == resource.RLIM_INFINITY
SANITIZERS = (f"-fsanitize={'address,' if _HAS_ADDRESSES else ''}undefined", "-fno-sanitize-recover=all")


def compiled(target: Path, source: Path, *flags: str) -> Path:
    """Compile a C program. Skips the test if there is no compiler."""
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    subprocess.run(["cc", "-std=c99", *WARNINGS, "-g", source, "-o", target, *flags, "-lm"], check=True)
    return target
