"""The digest that identifies a package: that of its manifest, which holds the digests of all other files."""

import hashlib
from pathlib import Path

from volprep_formats.package.storage.contents import open_contents
from volprep_formats.package.storage.files import MANIFEST


def manifest_sha256(package: Path) -> str:
    """Return the SHA-256 of the manifest. Raises VP4007 if it is missing, VP4002 for a zip that is not a package."""
    with open_contents(package, MANIFEST) as contents:
        return hashlib.sha256(contents.read()).hexdigest()
