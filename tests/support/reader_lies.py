"""Lies in a manifest, and what the three readers say of each."""

import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from every_kind import single_file
from readers_compare import disagreement
from three_readers import READ, Readers

Manifest = dict[str, Any]
Lies = Mapping[str, Callable[[Manifest], object]]
"""By name, what changes a manifest into one that contradicts itself."""


def codes_of_lies(readers: Readers, package: Path, lies: Lies, folder: Path) -> dict[str, tuple[str, str]]:
    """Return the codes of C and JavaScript for each lie; assert that readers agree, and take the package itself."""
    manifest = json.loads((package / "manifest.json").read_text())
    paths = []
    for number, lie in enumerate((lambda _: None, *lies.values())):
        told = json.loads(json.dumps(manifest))
        lie(told)
        copy = folder / str(number) / "p.volpkg"
        shutil.copytree(package, copy)
        (copy / "manifest.json").write_text(json.dumps(told))
        paths.append(single_file(copy))
    truth, *found = readers.all(paths)
    assert truth == ({READ}, READ, READ)
    for name, said in zip(lies, found, strict=True):
        assert disagreement(*said) is None, (name, said)
    return {name: (c, javascript) for name, (_, c, javascript) in zip(lies, found, strict=True)}
