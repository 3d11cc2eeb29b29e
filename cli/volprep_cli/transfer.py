"""volprep transfer: the lookup tables of the transfer functions."""

from volprep_cli.stage import Draft, run_stage


def transfer(package: Draft) -> None:
    """Write the lookup tables of the transfer functions."""
    run_stage(package, "transfer")
