"""volprep view: look at a package in a browser, on this machine or on another one."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from volprep_cli.console import bytes_text, print_colours, print_json, print_line, print_note, progress, wants_json

if TYPE_CHECKING:
    from collections.abc import Callable

    from volprep.plan.device_records import DeviceRecord
    from volprep.view.site import ShownPackage

Package = Annotated[Path, typer.Argument(help="Package, sealed: a folder or a .volpkg.zip.", metavar="PACKAGE")]
Output = Annotated[
    Path | None,
    typer.Option(
        "-o",
        "--output",
        help="Write the page instead of serving it: FILE.html is one file that opens by double-click, any other name a "
        "folder for a server of your own.",
        metavar="FOLDER|FILE.html",
    ),
]
Force = Annotated[
    bool, typer.Option("--force", help="Replace a page that exists; never a folder that holds anything else.")
]
ReportFolder = Annotated[
    Path | None,
    typer.Option(
        "--report", help="Folder of the report; if not given, NAME.report beside the package.", metavar="FOLDER"
    ),
]
Devices = Annotated[
    Path | None, typer.Option("--devices", help="Folder for measurements that devices send.", metavar="FOLDER")
]
Lan = Annotated[
    bool,
    typer.Option(
        "--lan", help="Also serve to other devices in the local network, at an address that cannot be guessed."
    ),
]
Port = Annotated[
    int, typer.Option(min=0, max=65535, help="Port of the server; if not given, a free one.", metavar="NUMBER")
]
NoOpen = Annotated[bool, typer.Option("--no-open", help="Do not open a browser.")]


def view(
    package: Package,
    *,
    output: Output = None,
    force: Force = False,
    report: ReportFolder = None,
    devices: Devices = None,
    lan: Lan = False,
    port: Port = 0,
    no_open: NoOpen = False,
) -> None:
    """Show a package in a browser, and measure its error and time on that device.

    The page is served to this machine alone, until Ctrl-C, and loads nothing from a network. Errors of pictures need
    the report of volprep validate.
    """
    from volprep.validation.folder import default_report_path
    from volprep.view.site import shown_with

    if output is not None and (lan or devices is not None):
        raise typer.BadParameter("exported pages are not served: leave out --lan and --devices", param_hint="--output")
    shown = shown_with(package, report, default_report_path(package))
    if shown.report is None:
        print_note("no report of this package: volprep validate makes one. The page shows no error, and measures none")
    if output is not None:
        _write(shown, output, force=force)
    else:
        _serve(shown, devices, port, lan=lan, opens=not no_open)


def _write(shown: "ShownPackage", output: Path, *, force: bool) -> None:
    from volprep.view.export import write_page_file, write_page_folder

    with progress() as watcher:
        if output.suffix.lower() in {".html", ".htm"}:
            size = write_page_file(shown, output, watcher, force=force)
            facts: dict[str, object] = {"page": str(output), "size_bytes": size}
            told = f"{output}: one file, {bytes_text(size)}; open it with a browser"
        else:
            count = write_page_folder(shown, output, watcher, force=force)
            facts = {"page": str(output), "files": count}
            told = f"{output}: {count} files, for any server of static files"
    if wants_json():
        print_json(facts)
    else:
        print_line(told)


def _serve(shown: "ShownPackage", devices: Path | None, port: int, *, lan: bool, opens: bool) -> None:
    import sys
    import threading
    import webbrowser

    from volprep.view.server import LOCAL, ViewServer, lan_address, qr_code
    from volprep.view.site import make_site
    from volprep_formats.package.digest import manifest_sha256

    say = print_note if wants_json() else print_line
    site = make_site(shown, takes_devices=devices is not None)
    address = lan_address() if lan else LOCAL
    digest = manifest_sha256(shown.package.path)
    with ViewServer(site, digest, address=address, port=port, devices=devices, received=partial(_told, say)) as server:
        if wants_json():
            print_json({"url": server.url})
        elif lan:
            print_colours(qr_code(server.url))
            print_line(
                "This address is for devices in the same network. Only share it with people who may see the scan."
            )
        if not wants_json():
            print_line(f"{server.url}")
            print_line("Ctrl-C ends it.")
        sys.stdout.flush()
        if opens:
            # Some browsers of a terminal do not come back until they are closed.
            threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
        server.serve()
    say("ended")


def _told(say: "Callable[[str], None]", path: Path, record: "DeviceRecord") -> None:
    import sys

    slower = ", it became slower while measuring" if record.throttling.throttled else ""
    say(f"{path}: {record.device.gpu}, {record.device.browser}{slower}")
    sys.stdout.flush()
