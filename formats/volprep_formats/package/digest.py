"""The digest by which a package is known: that of its manifest, which names the digests of all other files."""

import hashlib
from pathlib import Path

from volprep_formats.package.storage.contents import open_contents
from volprep_formats.package.storage.files import MANIFEST


def manifest_sha256(package: Path) -> str:
    """Return the SHA-256 of the manifest. Raises VP4007 where there is none, VP4002 for a zip that is no package."""
    with open_contents(package, MANIFEST) as contents:
        return hashlib.sha256(contents.read()).hexdigest()
