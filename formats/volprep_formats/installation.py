"""How volprep was installed, and how to add one of its extras."""

import json
from importlib.metadata import PackageNotFoundError, distribution
from urllib.parse import unquote, urlsplit


def how_to_add(extra: str) -> str:
    """Return the command that installs volprep with an extra from where this installation came."""
    try:
        installed = distribution("volprep")
        told = json.loads(installed.read_text("direct_url.json") or "{}")
    except (PackageNotFoundError, ValueError):
        return f"install volprep again with its extra {extra}"
    url = str(told.get("url", ""))
    if url.startswith("file:") and "dir_info" in told:
        editable = "--editable " if told["dir_info"].get("editable") else ""
        return f"pip install {editable}'{unquote(urlsplit(url).path)}[{extra}]' (a checkout)"
    if url:
        return f"pip install 'volprep[{extra}] @ {url}' (where this installation came from)"
    return f"pip install 'volprep[{extra}]=={installed.version}' from where this installation came"
