"""The entry point: the list of verbs."""

import typer

app = typer.Typer(name="volprep", no_args_is_help=True)


def main() -> None:
    """Run the command line."""
    app()
