"""volprep seal: a draft becomes a package."""

from volprep_cli.stage import Draft, run_stage


def seal(package: Draft) -> None:
    """Make the package of a draft: preview picture and checksums."""
    run_stage(package, "seal")
