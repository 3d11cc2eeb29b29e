"""What a machine lacks: VP7xxx."""

from volprep_formats.diagnostics.entry import Diagnostic, ExitStatus

ENTRIES: dict[str, Diagnostic] = {
    "VP7001": Diagnostic(
        ExitStatus.MACHINE,
        "this machine cannot turn a scan into a validated package. Missing: {missing}",
        "Each line marked missing says how to get that part.",
    ),
    "VP7002": Diagnostic(
        ExitStatus.MACHINE,
        "the folder that this command runs in no longer exists",
        "Change to a folder that exists, and run it there.",
    ),
    "VP7003": Diagnostic(
        ExitStatus.MACHINE,
        "{path}: the system refuses it: {error}",
        "See to the permissions of this path and of the folders above it, or name another.",
    ),
}
