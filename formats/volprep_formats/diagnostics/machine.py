"""What a machine lacks: VP7xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP7001": Diagnostic(
        ExitStatus.MACHINE,
        "this machine cannot turn a scan into a validated package; missing: {missing}",
        "The lines marked missing say how to get each.",
    ),
}
