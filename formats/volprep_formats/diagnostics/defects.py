"""Defects of volprep: VP9xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP9001": Diagnostic(
        ExitStatus.INTERNAL,
        "internal error: {error}",
        "This is a defect in volprep. Run again with VOLPREP_TRACEBACK=1 and report what it prints.",
    ),
}
