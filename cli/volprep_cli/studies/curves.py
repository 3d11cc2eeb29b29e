"""volprep study curves: what each choice of a package costs."""

from volprep_cli.console import print_done
from volprep_cli.outputs import Package
from volprep_cli.studies.of_package import Output, Size, Source, make_study


def curves(package: Package, output: Output, *, source: Source = None, size: Size = None) -> None:
    """Measure every choice that trades accuracy for time or bytes: about ninety packages, drawn and judged.

    Writes curves.html and curves.json. Takes minutes; one that is stopped writes the choices that it has measured.
    """
    found = make_study("curves", package, output, source=source, size=size)
    print_done(f"{output / 'curves.html'}: curves of {package}", package=str(package), report=str(output))
    if getattr(found, "is_stopped", False):
        raise KeyboardInterrupt
