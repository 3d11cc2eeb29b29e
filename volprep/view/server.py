"""The server of the page: for this machine, or, with an unguessable token, for a local network.

A page of another origin must neither read nor send anything here. So every address begins with a random token, the
header Host must name this server (a name that an attacker points at this machine does not), a request with the header
of another origin is refused, and headers restrict the page to its own files.
"""

import gzip
import hmac
import json
import secrets
import signal
import socket
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from volprep.plan.device_files import MOST_BYTES
from volprep.plan.device_records import DeviceRecord
from volprep.view.ranges import UnsatisfiableError, part_of
from volprep.view.site import DEVICES, INDEX, ServedFile, Site
from volprep.view.stored_devices import store_device
from volprep_formats.diagnostics import VolprepError

if TYPE_CHECKING:
    from io import BufferedReader

LOCAL = "127.0.0.1"
_CHUNK_BYTES = 2**18
_MOST_GZIPPED_BYTES = 2**22
_BINARY = ("image/", "application/octet-stream")
_PATIENCE_S = 30.0
"""Time after which a connection on which nothing happens is closed."""
_REQUEST_S = 30.0
"""Time limit of a request, body included: otherwise a slow client could hold a thread for hours."""
_MOST_CONNECTIONS = 24
"""Connections of one sender at a time; a browser opens six."""
_MOST_MEASUREMENTS = 100
"""Measurements that one sender may store while the server runs."""
CONTENT_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "Content-Security-Policy": CONTENT_POLICY,
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    # With this, the clock of a browser is exact to 5 µs in place of 100 µs.
    "Cross-Origin-Embedder-Policy": "require-corp",
    "Permissions-Policy": "camera=(), microphone=(), geolocation=(), usb=(), serial=()",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cache-Control": "no-store",
}

Received = Callable[[Path, DeviceRecord], None]
"""Callback for each stored measurement."""


class ViewServer(ThreadingHTTPServer):
    """Serves one package. Use it as a context manager, and call `serve`."""

    daemon_threads = True

    def __init__(
        self,
        site: Site,
        manifest_sha256: str,
        *,
        address: str = LOCAL,
        port: int = 0,
        devices: Path | None = None,
        received: Received = lambda _path, _record: None,
    ) -> None:
        """Listen at `address`; port 0 is any that is free. Measurements are stored in the folder `devices`.

        Raises VP7031 if the system refuses.
        """
        self.site = site
        self.manifest_sha256 = manifest_sha256
        self.devices = devices
        self.received = received
        self.token = secrets.token_urlsafe(16)
        self._guard = threading.Lock()
        self._connections: Counter[str] = Counter()
        self._measurements: Counter[str] = Counter()
        try:
            super().__init__((address, port), _Handler)
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            raise VolprepError("VP7031", address=address, port=port, error=reason) from error

    @property
    def origin(self) -> str:
        """Origin of everything that is served."""
        return f"http://{self.server_address[0]!s}:{self.server_port}"

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"{self.origin}/{self.token}/"

    @property
    def hosts(self) -> set[str]:
        """Allowed values of the header Host."""
        names = {str(self.server_address[0])} | ({"localhost"} if self.server_address[0] == LOCAL else set())
        return {f"{name}:{self.server_port}" for name in names} | (names if self.server_port == 80 else set())

    def serve(self) -> None:
        """Serve until Ctrl-C, or until the process is asked to end."""
        # A browser that closes a connection early must not end us.
        signal.signal(signal.SIGPIPE, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        with suppress(KeyboardInterrupt):
            self.serve_forever(poll_interval=0.2)

    def verify_request(self, request: object, client_address: object) -> bool:  # noqa: ARG002 - as in the base class
        """Return whether a connection is served, and count it; one sender has only so many at a time."""
        with self._guard:
            has_room = self._connections[_sender(client_address)] < _MOST_CONNECTIONS
            self._connections[_sender(client_address)] += has_room
        return has_room

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        """Serve one connection, which no longer counts when it ends."""
        try:
            super().process_request_thread(request, client_address)
        finally:
            with self._guard:
                self._connections[_sender(client_address)] -= 1

    def require_room(self, client_address: object) -> None:
        """Count a measurement of a sender. Raises VP7072 if it has sent the maximum already."""
        with self._guard:
            count = self._measurements[_sender(client_address)]
            if count >= _MOST_MEASUREMENTS:
                raise VolprepError("VP7072", count=count)
            self._measurements[_sender(client_address)] += 1

    def handle_error(self, request: object, client_address: object) -> None:
        """Ignore a broken connection: the client has gone."""


def _sender(client_address: object) -> str:
    return str(client_address[0]) if isinstance(client_address, tuple) else str(client_address)


class _Handler(BaseHTTPRequestHandler):
    """Answers one connection."""

    server: ViewServer
    protocol_version = "HTTP/1.1"
    server_version = "volprep"
    sys_version = ""
    timeout = _PATIENCE_S

    def handle_one_request(self) -> None:
        """Answer one request, which must arrive within its time limit."""
        try:
            cast("BufferedReader", self.rfile).peek(1)
        except OSError:
            self.close_connection = True
            return
        self._deadline = threading.Timer(_REQUEST_S, self._cut_off)
        self._deadline.daemon = True
        self._deadline.start()
        try:
            super().handle_one_request()
        finally:
            self._deadline.cancel()

    def _cut_off(self) -> None:
        """Close the connection of a request that takes too long to arrive."""
        with suppress(OSError):
            self.connection.shutdown(socket.SHUT_RDWR)

    def do_GET(self) -> None:
        """Send a file, or a part of it."""
        self._send(with_body=True)

    def do_HEAD(self) -> None:
        """Send a file."""
        self._send(with_body=False)

    def do_POST(self) -> None:
        """Take a measurement."""
        if self._allowed() and self._address() != DEVICES:
            self._refuse(HTTPStatus.METHOD_NOT_ALLOWED)
        elif self._allowed() and self.server.devices is None:
            self._refuse(HTTPStatus.NOT_FOUND)
        elif self._allowed():
            self._take(self.server.devices)
        else:
            self._refuse(self._status())

    def log_message(self, format: str, *arguments: object) -> None:  # noqa: A002 - its name in the base class
        """Print nothing: requests are of no interest, and their text is foreign."""

    def send_error(self, code: int, message: str | None = None, explain: str | None = None) -> None:  # noqa: ARG002 - as in the base class
        """Refuse requests that the base class refuses in our format, without a page that repeats foreign text."""
        self.close_connection = True
        self._answer(HTTPStatus(code), f"{HTTPStatus(code).phrase}\n".encode(), "text/plain; charset=utf-8")

    def _send(self, *, with_body: bool) -> None:
        # Large files take their time on the way to a phone; each piece has a limit of its own.
        self._deadline.cancel()
        address = self._address()
        served = self.server.site.get(INDEX if address == "" else address or "")
        if not self._allowed() or served is None:
            self._refuse(HTTPStatus.NOT_FOUND if self._allowed() else self._status())
            return
        try:
            self._send_file(served, with_body=with_body)
        except VolprepError as error:
            self._answer(HTTPStatus.GONE, f"{error}\n".encode(), "text/plain; charset=utf-8")
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def _send_file(self, served: ServedFile, *, with_body: bool) -> None:
        with served.open() as contents:
            try:
                part = part_of(self.headers.get("Range"), contents.size_bytes)
            except UnsatisfiableError:
                size = {"Content-Range": f"bytes */{contents.size_bytes}"}
                self._head(HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE, 0, "text/plain", size)
                return
            if part is None and self._takes_gzip(served, contents.size_bytes):
                data = gzip.compress(contents.read(), mtime=0)
                self._head(HTTPStatus.OK, len(data), served.content_type, {"Content-Encoding": "gzip"})
                if with_body:
                    self.wfile.write(data)
                return
            start, stop = part or (0, contents.size_bytes)
            more = {"Accept-Ranges": "bytes"}
            if part is not None:
                more["Content-Range"] = f"bytes {start}-{stop - 1}/{contents.size_bytes}"
            status = HTTPStatus.OK if part is None else HTTPStatus.PARTIAL_CONTENT
            self._head(status, stop - start, served.content_type, more)
            if not with_body:
                return
            contents.file.seek(contents.start_bytes + start)
            left = stop - start
            while left > 0 and (data := contents.file.read(min(_CHUNK_BYTES, left))):
                self.wfile.write(data)
                left -= len(data)
            # The file became shorter: only a closed connection tells the browser that bytes are missing.
            self.close_connection = self.close_connection or left > 0

    def _takes_gzip(self, served: ServedFile, size: int) -> bool:
        """Return whether a file is text that is sent smaller: scripts and manifests are, textures are not."""
        accepted = {word.strip() for word in self.headers.get("Accept-Encoding", "").split(",")}
        return "gzip" in accepted and size < _MOST_GZIPPED_BYTES and not served.content_type.startswith(_BINARY)

    def _take(self, folder: Path | None) -> None:
        length = self.headers.get("Content-Length", "")
        if not length.isascii() or not length.isdigit():
            self._refuse(HTTPStatus.LENGTH_REQUIRED)
        elif self.headers.get_content_type() != "application/json":
            self._refuse(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        elif len(length) > 9 or int(length) > MOST_BYTES:
            self._refuse(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        elif folder is not None:
            data = self.rfile.read(int(length))
            self._deadline.cancel()
            try:
                self.server.require_room(self.client_address)
                path, record = store_device(folder, data, self.server.manifest_sha256)
            except VolprepError as error:
                told = {"code": error.code, "summary": error.summary, "remedy": error.remedy}
                self._answer(HTTPStatus.BAD_REQUEST, json.dumps(told).encode(), "application/json")
                return
            self.server.received(path, record)
            self._answer(HTTPStatus.CREATED, json.dumps({"file": path.name}).encode(), "application/json")

    def _address(self) -> str | None:
        """Return the address behind the token; None without the token."""
        token, _, address = self.path.partition("?")[0].removeprefix("/").partition("/")
        right = hmac.compare_digest(token.encode("utf-8", "surrogateescape"), self.server.token.encode())
        return address if right and self.path.startswith(f"/{token}/") else None

    def _allowed(self) -> bool:
        return self._status() is HTTPStatus.OK

    def _status(self) -> HTTPStatus:
        """Return whether a request may be answered: right server, right token, and not from another page."""
        if len(self.headers.get_all("Host", [])) != 1 or self.headers.get("Host") not in self.server.hosts:
            return HTTPStatus.MISDIRECTED_REQUEST
        # A link to the page may be in a mail; another page may not load the files behind it.
        is_link = self.command == "GET" and self.headers.get("Sec-Fetch-Dest") == "document"
        if self.headers.get("Sec-Fetch-Site", "none") not in {"none", "same-origin"} and not is_link:
            return HTTPStatus.FORBIDDEN
        if self.headers.get("Origin", self._own_origin()) != self._own_origin():
            return HTTPStatus.FORBIDDEN
        return HTTPStatus.OK if self._address() is not None else HTTPStatus.NOT_FOUND

    def _own_origin(self) -> str:
        return f"http://{self.headers.get('Host')}"

    def _refuse(self, status: HTTPStatus) -> None:
        # The unread rest of a body must not be taken for the next request.
        self.close_connection = True
        self._answer(status, f"{status.phrase}\n".encode(), "text/plain; charset=utf-8")

    def _answer(self, status: HTTPStatus, body: bytes, content_type: str) -> None:
        try:
            self._head(status, len(body), content_type, {})
            if self.command != "HEAD":
                self.wfile.write(body)
        except (ConnectionError, TimeoutError):
            self.close_connection = True

    def _head(self, status: HTTPStatus, size: int, content_type: str, more: dict[str, str]) -> None:
        self.send_response(status)
        headers = {**_HEADERS, "Content-Type": content_type, "Content-Length": str(size), **more}
        if self.close_connection:
            headers["Connection"] = "close"
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()


def lan_address() -> str:
    """Return the address of this machine in its local network. Raises VP7032 if it has none."""
    # No packet is sent: the system only reports the address that it would send one from.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))
            address = str(probe.getsockname()[0])
        except OSError as error:
            raise VolprepError("VP7032") from error
    if address.startswith("127.") or address == "0.0.0.0":  # noqa: S104 - compared, not bound
        raise VolprepError("VP7032")
    return address


def qr_code(url: str) -> str:
    """Return a QR code of an address, as lines of text for a terminal."""
    import io  # noqa: PLC0415 - only with --lan

    import segno  # noqa: PLC0415 - as above

    text = io.StringIO()
    segno.make(url, error="m").terminal(out=text, compact=True)
    return text.getvalue()
