"""Content Security Policy of pages: sources that are named by their digest."""

import base64
import hashlib


def source_digest(text: str) -> str:
    """Return the source expression that allows an inline script or style of this text, without its quotes."""
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
