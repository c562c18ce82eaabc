"""The page of a study over HTTP, to this machine alone.

Everything has a token of 128 bits in its address; requests by other names of this machine, or from other pages, are
refused, and what comes in is a small JSON text.
"""

from __future__ import annotations

import json
import re
import secrets
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from hmac import compare_digest
from http import HTTPStatus
from http.client import HTTP_PORT
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from mechdesign.door.live.requests import RequestError, request_in
from mechdesign.door.live.served import OvertakenError, ServedStudy
from mechdesign.ground.errors import explain

_HOST = "127.0.0.1"
_MOST_BYTES = 1_000_000  # of a request
_WAIT = 20.0  # seconds after which a page asks again whether the file has changed
_END = 5.0  # seconds that a computation is waited for at the end
_IDLE = 60.0  # seconds until a connection that says nothing is closed
_SLOW = 10.0  # seconds in which a request has to arrive whole
_MOST_CONNECTIONS = 64
_POLICY = re.compile(rb'<meta http-equiv="Content-Security-Policy" content="([^"]+)">')
_HEADERS = {
    "Cache-Control": "no-store", "X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin", "Cross-Origin-Opener-Policy": "same-origin",
}  # fmt: skip


class _RefusedError(Exception):
    """A request that is answered by a status alone."""


class LiveServer(ThreadingHTTPServer):
    """Serves the pages of a session on a port of 127.0.0.1, a free one where it is 0.

    `framed` pages may stand in a page of another origin, as of a notebook.
    """

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 32

    def __init__(self, session: ServedStudy, port: int = 0, *, framed: bool = False) -> None:
        self.session, self.token, self.framed = session, secrets.token_urlsafe(16), framed
        self.waiting: list[str] = []  # open pages, once for each request by which they wait for a change of the file
        self.connections: set[socket.socket] = set()
        self.computing = 0  # requests that are answered just now
        self.lock = threading.Condition()
        super().__init__((_HOST, port), _Handler)

    @property
    def url(self) -> str:
        """The address of the page."""
        return f"http://{_HOST}:{self.server_port}/{self.token}/"

    @property
    def hosts(self) -> tuple[str, str]:
        """What a browser may call this server."""
        # The port of HTTP is not named.
        port = "" if self.server_port == HTTP_PORT else f":{self.server_port}"
        return f"{_HOST}{port}", f"localhost{port}"

    def start(self) -> None:
        """Serve in a thread of its own, until `close`."""
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.1}, daemon=True).start()

    def close(self) -> int:
        """End, and return how many pages were open; a computation is given some seconds to see that it is over."""
        for session in (self.session, *self.session.linkages.values()):
            session.ended = True
        self.shutdown()
        self.server_close()
        with self.lock:
            count, open_ones = len({*self.waiting}), [*self.connections]
            self.lock.wait_for(lambda: not self.computing, _END)
        for connection in open_ones:
            with suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
        return count

    def verify_request(self, request: Any, client_address: Any) -> bool:
        """Whether a connection is taken: not of one who opens them without end."""
        return len(self.connections) < _MOST_CONNECTIONS

    def process_request(self, request: Any, client_address: Any) -> None:
        """Answer a connection in a thread of its own."""
        with self.lock:
            self.connections.add(request)
        super().process_request(request, client_address)

    def shutdown_request(self, request: Any) -> None:
        """End a connection."""
        with self.lock:
            self.connections.discard(request)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A page that is closed while it is answered is no error."""


class _Handler(BaseHTTPRequestHandler):
    server: LiveServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "mechdesign", ""
    timeout = _IDLE
    wbufsize = -1  # a head and its body leave together

    def setup(self) -> None:
        super().setup()
        self.connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def finish(self) -> None:
        with suppress(OSError):
            super().finish()

    def log_message(self, *_: Any) -> None:
        """Say nothing: addresses hold the token."""

    def __getattr__(self, name: str) -> Any:
        # Methods that are none of these two.
        if name.startswith("do_"):
            return partial(self._refuse, HTTPStatus.METHOD_NOT_ALLOWED)
        raise AttributeError(name)

    def do_GET(self) -> None:
        """The page, or what a page waits for."""
        self._serve(self._got)

    def do_POST(self) -> None:
        """What a page asks, as JSON."""
        server = self.server
        with server.lock:
            server.computing += 1
        try:
            self._serve(self._posted)
        finally:
            with server.lock:
                server.computing -= 1
                server.lock.notify_all()

    def _serve(self, answer: Callable[[ServedStudy, list[str]], None]) -> None:
        """Answer a page of ours behind the token by the words of its address; refuse others."""
        try:
            answer(*self._admitted())
        except _RefusedError as refusal:
            self._refuse(refusal.args[0])

    def _got(self, session: ServedStudy, words: list[str]) -> None:
        if words == [""]:
            try:
                page, kind = session.page(), "text/html; charset=utf-8"
            except Exception as error:
                page, kind = f"{explain(error)[1]}\n".encode(), "text/plain; charset=utf-8"
            self._send(HTTPStatus.OK, page, kind)
        elif len(words) == 3 and words[0] == "changes" and words[1].isdigit():
            self._wait(session, int(words[1][:9]), words[2][:40])
        elif len(words) == 2 and words[0] == "progress":
            self._reply({"progress": session.progress(words[1])})
        else:
            raise _RefusedError(HTTPStatus.NOT_FOUND)

    def _posted(self, session: ServedStudy, words: list[str]) -> None:
        body, actions = self._body(), session.actions
        if len(words) != 1 or words[0] not in actions:
            raise _RefusedError(HTTPStatus.NOT_FOUND)
        try:
            request = request_in(body)
            # A page of an older version of the file asks for names that there may not be.
            answer = actions[words[0]](request) if request.get("version") == session.version else {"outdated": True}
        except OvertakenError:
            answer = {"overtaken": True}
        except RequestError:
            raise _RefusedError(HTTPStatus.BAD_REQUEST) from None
        except Exception as error:
            answer = {"wrong": explain(error)[1]}
        self._reply(answer)

    def _admitted(self) -> tuple[ServedStudy, list[str]]:
        """Whose page asks, and the address behind the token, in words."""
        hosts, origin = self.server.hosts, self.headers.get("Origin")
        token, _, rest = self.path.removeprefix("/").partition("/")
        foreign = origin is not None and origin not in [f"http://{host}" for host in hosts]
        # Only to the page itself may something else lead: a link, the frame of a notebook.
        arrives = self.command == "GET" and self.headers.get("Sec-Fetch-Mode") == "navigate"
        foreign |= not arrives and self.headers.get("Sec-Fetch-Site", "none") not in ("same-origin", "none")
        if self.headers.get_all("Host", []) not in ([hosts[0]], [hosts[1]]):
            raise _RefusedError(HTTPStatus.MISDIRECTED_REQUEST)
        if foreign or not compare_digest(token.encode(errors="replace"), self.server.token.encode()):
            raise _RefusedError(HTTPStatus.FORBIDDEN)
        session, words = self.server.session, rest.split("/")
        if words[0] == "linkage" and len(words) > 2 and words[1] in session.linkages:
            return session.linkages[words[1]], words[2:]
        return session, words

    def _body(self) -> bytes:
        """The text of a request."""
        lengths = self.headers.get_all("Content-Length", [])
        if not lengths or "Transfer-Encoding" in self.headers:
            raise _RefusedError(HTTPStatus.LENGTH_REQUIRED)
        if len(lengths) > 1 or not (lengths[0].isascii() and lengths[0].isdigit()):
            raise _RefusedError(HTTPStatus.BAD_REQUEST)
        if len(lengths[0]) > 9 or int(lengths[0]) > _MOST_BYTES:
            raise _RefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        body, count, end = b"", int(lengths[0]), time.monotonic() + _SLOW
        with suppress(TimeoutError):
            while len(body) < count:
                self.connection.settimeout(max(end - time.monotonic(), 1e-3))
                if not (part := self.rfile.read1(count - len(body))):
                    break
                body += part
        self.connection.settimeout(_IDLE)
        if len(body) < count:
            raise _RefusedError(HTTPStatus.REQUEST_TIMEOUT)
        return body

    def _wait(self, session: ServedStudy, version: int, page: str) -> None:
        """Answer when the file has changed, or after a while."""
        self.server.waiting.append(page)
        try:
            with session.changed:
                session.changed.wait_for(lambda: session.version != version, _WAIT)
            self._reply({"version": session.version, "mistake": session.mistake})
        finally:
            self.server.waiting.remove(page)

    def _refuse(self, status: HTTPStatus) -> None:
        """Say no, and end the connection: what else it holds was not read."""
        self.close_connection = True
        self._send(status, status.phrase.encode(), "text/plain; charset=utf-8")

    def _reply(self, answer: dict[str, Any]) -> None:
        self._send(HTTPStatus.OK, json.dumps(answer, separators=(",", ":")).encode(), "application/json")

    def _send(self, status: HTTPStatus, body: bytes, kind: str) -> None:
        # A page says its policy itself, but for who may frame it; nothing else is a page.
        policy = found[1].decode().replace("&#39;", "'") if (found := _POLICY.search(body)) else "default-src 'none'"
        policy += "" if self.server.framed else "; frame-ancestors 'none'"
        headers = {
            "Content-Type": kind,
            "Content-Length": str(len(body)),
            "Content-Security-Policy": policy,
            **_HEADERS,
        }
        headers |= {"Allow": "GET, POST"} if status == HTTPStatus.METHOD_NOT_ALLOWED else {}
        headers |= {"Connection": "close"} if self.close_connection else {}
        with suppress(OSError):
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name, value)
            self.end_headers()
            if self.command != "HEAD":
                self.wfile.write(body)
            self.wfile.flush()
