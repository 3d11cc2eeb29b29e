"""A web server for tests: folders under names, byte ranges, and faults that a network may have."""

import re
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Self

_TYPES = {".js": "text/javascript", ".mjs": "text/javascript", ".html": "text/html", ".json": "application/json"}
PAGE = """<!doctype html><meta charset=utf-8><title>test</title><link rel=icon href='data:,'>
<script type=importmap>{"imports": {"volpkg": "/js/volpkg.js", "volpkg/camera": "/js/camera.js",
"volpkg/three": "/js/three.js", "three": "/three/build/three.module.js",
"three/addons/": "/three/examples/jsm/"}}</script>
<body style="margin: 0; background: black"></body>"""


@dataclass
class WebServer:
    """Serves folders on this machine. Use it as a context manager."""

    folders: dict[str, Path] = field(default_factory=dict)
    """Folder of each first part of a path."""
    ranges: bool = True
    """Whether it knows byte ranges."""
    bytes_per_second: float | None = None
    """How fast it is."""
    cut_after: int | None = None
    """Ends each answer after so many bytes."""
    stall_after: int | None = None
    """Sends nothing more after so many bytes."""
    stall_only: str = ""
    """What the addresses contain that stall."""
    latency_s: float = 0.0
    """How long each answer takes to begin."""
    latency_only: str = ""
    """What the addresses contain whose answers take so long."""
    refused: Callable[[str, range], bool] | None = None
    """Which bytes of which paths it answers with 404."""
    asked: list[str] = field(default_factory=list)
    """Address and range of each request, in order."""
    sent: dict[str, int] = field(default_factory=dict)
    """Bytes that were sent of each path."""

    def __enter__(self) -> Self:
        """Begin to serve."""
        outer = self

        class Handler(BaseHTTPRequestHandler):
            protocol_version = "HTTP/1.1"

            def do_GET(self) -> None:
                outer._answer(self)

            def log_message(self, *_: object) -> None:
                pass

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self._ended = threading.Event()
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        """End."""
        self._ended.set()
        self._server.shutdown()
        self._server.server_close()

    def _answer(self, request: BaseHTTPRequestHandler) -> None:
        path = request.path.split("?")[0]
        self.asked.append(f"{path} {request.headers.get('Range', '')}".strip())
        if self.latency_only in path:
            time.sleep(self.latency_s)
        _, mount, *rest = path.split("/")
        if path == "/":
            data, kind = PAGE.encode(), "text/html"
        else:
            file = self.folders.get(mount, Path("/nowhere")) / "/".join(rest)
            if not file.is_file():
                request.send_error(404)
                return
            data, kind = file.read_bytes(), _TYPES.get(file.suffix, "application/octet-stream")
        total = len(data)
        asked = re.fullmatch(r"bytes=(\d*)-(\d*)", request.headers.get("Range", "")) if self.ranges else None
        if asked:
            start, end = int(asked[1] or 0), min(int(asked[2] or total), total - 1)
            if not asked[1]:
                start, end = max(0, total - int(asked[2])), total - 1
            if self.refused and self.refused(path, range(start, end + 1)):
                request.send_error(404)
                return
            data = data[start : end + 1]
            request.send_response(206)
            request.send_header("Content-Range", f"bytes {start}-{end}/{total}")
        else:
            request.send_response(200)
        request.send_header("Content-Type", kind)
        request.send_header("Content-Length", str(len(data)))
        request.send_header("Cache-Control", "no-store")
        request.end_headers()
        try:
            self._send(request, path, data)
        except OSError:
            request.close_connection = True

    def _send(self, request: BaseHTTPRequestHandler, path: str, data: bytes) -> None:
        faulty = not path.endswith((".js", ".html", "/", "manifest.json")) and self.stall_only in path
        piece = len(data) if self.bytes_per_second is None else max(1, int(self.bytes_per_second / 50))
        for at in range(0, len(data), max(1, piece)):
            part = data[at : at + piece]
            if faulty and self.cut_after is not None:
                part = part[: self.cut_after]
                request.close_connection = True
            if faulty and self.stall_after is not None:
                part = part[: self.stall_after]
            request.wfile.write(part)
            self.sent[path] = self.sent.get(path, 0) + len(part)
            if self.bytes_per_second is not None:
                time.sleep(len(part) / self.bytes_per_second)
        if faulty and self.stall_after is not None:
            self._ended.wait(60)
