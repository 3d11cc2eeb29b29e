"""volprep seal: a draft becomes a package."""

from volprep_cli.stage import Draft, run_stage


def seal(package: Draft) -> None:
    """Turn a draft into a package: draw the preview, write the checksums."""
    run_stage(package, "seal")
