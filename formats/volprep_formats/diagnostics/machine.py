"""What a machine lacks: VP7xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP7001": Diagnostic(
        ExitStatus.MACHINE,
        "this machine cannot turn a scan into a validated package. Missing: {missing}",
        "Each line marked missing says how to get that part.",
    ),
}
