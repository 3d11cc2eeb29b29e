"""The name of this build: its version, and the git revision where it was built from a checkout."""

from importlib.metadata import distribution


def version_text() -> str:
    """Return what `volprep --version` prints. The revision was written when volprep was built (build_name.cmake)."""
    installed = distribution("volprep")
    revision = (installed.read_text("build.txt") or "").strip()
    return f"volprep {installed.version} ({revision})" if revision else f"volprep {installed.version}"
