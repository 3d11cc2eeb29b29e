"""Complete the SBOM of a repaired wheel, add the licences of its libraries, and take dead bytes out of these.

    python tools/wheel_licences.py WHEEL FOLDER

auditwheel copies libraries into the wheel and lists their packages in an SBOM (PEP 770). It does not find those in
/lib, which Debian made a link, and does not know statically linked libraries. Both are added here, by asking dpkg.
"""

import json
import re
import subprocess
import sys
from importlib.metadata import distribution
from pathlib import Path
from typing import Any
from urllib.parse import quote

DOCUMENTATION = Path("/usr/share/doc")
STATIC = "nanobind"
"""Libraries in every module."""


def original_name(copied: str) -> str:
    """Return the name that a library had before auditwheel put a hash into it: libbz2-e4f501c8.so.1.0.4."""
    return re.sub(r"-[0-9a-f]{8}(?=[.])", "", copied)


def package_of(library: str) -> tuple[str, str]:
    """Return the Debian package that a library comes from, and its version."""
    found = _said("dpkg", "-S", f"*/{library}").splitlines()[0].partition(":")[0]
    return found, _said("dpkg-query", "--show", "--showformat=${Version}\n", found).splitlines()[0]


def complete(sbom: dict[str, Any], packages: dict[str, str], nanobind: str) -> None:
    """Add to an SBOM the Debian packages (name, version) that it lacks, and nanobind in this version."""
    listed = {component["name"] for component in sbom["components"]}
    added = [(name, version, "deb/debian") for name, version in packages.items() if name not in listed]
    for name, version, kind in [*added, (STATIC, nanobind, "pypi")]:
        url = f"pkg:{kind}/{name}@{quote(version, safe='')}"
        sbom["components"].append({"type": "library", "bom-ref": url, "name": name, "version": version, "purl": url})
        sbom["dependencies"][0]["dependsOn"].append(url)
        sbom["dependencies"].append({"ref": url})


def add_licences(folder: Path, packages: dict[str, str]) -> None:
    """Copy the licence of each package, and nanobind's, into a folder. Ends if one is missing."""
    folder.mkdir(parents=True)
    texts = {name: DOCUMENTATION / name / "copyright" for name in packages}
    files = distribution(STATIC).files or ()
    texts[STATIC] = next(Path(str(file.locate())) for file in files if file.name.startswith("LICENSE"))
    for name, text in texts.items():
        if not text.is_file():
            sys.exit(f"wheel_licences: {text}: no licence of {name}, which the wheel contains. Install the package.")
        (folder / f"{name}.txt").write_bytes(text.read_bytes())


def _said(*command: str) -> str:
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def main() -> None:
    from auditwheel.wheeltools import InWheel  # noqa: PLC0415 - only make wheel installs it

    wheel, folder = Path(sys.argv[1]).absolute(), Path(sys.argv[2]).absolute()
    with InWheel(wheel, folder / wheel.name) as unpacked:
        root = Path(unpacked)
        for library in sorted(root.glob("*.libs/*")):
            # Whenever patchelf changes a name it leaves the old table behind: 45 of the 125 MB of OpenVDB.
            _said("objcopy", "--strip-unneeded", str(library))
        packages = dict(package_of(original_name(path.name)) for path in sorted(root.glob("*.libs/*")))
        (path,) = root.glob("*.dist-info/sboms/auditwheel.cdx.json")
        sbom = json.loads(path.read_text(encoding="utf-8"))
        complete(sbom, packages, distribution(STATIC).version)
        path.write_text(json.dumps(sbom), encoding="utf-8")
        add_licences(path.parent.with_name("licenses") / "libraries", packages)
    print("libraries of", *sorted(packages))


if __name__ == "__main__":
    main()
