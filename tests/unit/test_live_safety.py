"""The live page attacked: what its server refuses, and what it never writes."""

from __future__ import annotations

import json
import os
import random
import socket
import stat
import threading
import time
from contextlib import suppress

import pytest
from helpers.studies import COMMENTED_FOUR_BAR

from mechdesign import load
from mechdesign.door.live import server as serving
from mechdesign.door.live.answers import DRAWING
from mechdesign.door.live.requests import RequestError
from mechdesign.door.live.served import OvertakenError
from mechdesign.door.live.server import LiveServer
from mechdesign.door.live.session import Session
from mechdesign.ground.errors import MechdesignError

FOUR_BAR = f"{COMMENTED_FOUR_BAR}kinematics: {{outputs: [P, rocker.angle]}}\n"
MOVE = {"version": 1, "page": "p", "turn": 1, "changes": {}, "poses": 1, "rows": "A", "sheet": [0, 0, 1, 100, 100]}


@pytest.fixture(scope="module")
def session():
    return Session(load(text=FOUR_BAR))


@pytest.fixture(scope="module")
def server(session):
    running = LiveServer(session)
    running.start()
    yield running
    running.close()


def answered(server, head, body=b"", *, host=True):
    """The status of what a server says to lines of a head and a body, as they are sent; none where it hangs up."""
    lines = [line.replace("TOKEN", server.token) for line in head]
    lines += [f"Host: 127.0.0.1:{server.server_port}"] if host else []
    with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as line:
        line.sendall("\r\n".join([*lines, "", ""]).encode("latin-1") + body)
        answer = line.recv(100_000)
    return int(answer.split()[1]) if answer else None


PAGE, POST = "GET /TOKEN/ HTTP/1.1", "POST /TOKEN/move HTTP/1.1"
GOOD = json.dumps(MOVE).encode()
LENGTH = f"Content-Length: {len(GOOD)}"


@pytest.mark.parametrize(
    ("status", "head"),
    [
        (200, [PAGE]),
        (200, [PAGE, "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate", "Sec-Fetch-Dest: iframe"]),
        (403, [PAGE, "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: no-cors", "Sec-Fetch-Dest: script"]),
        (403, [PAGE, "Sec-Fetch-Site: same-site", "Sec-Fetch-Mode: cors"]),
        (200, [POST, LENGTH, "Sec-Fetch-Site: same-origin"]),
        (403, [POST, LENGTH, "Sec-Fetch-Site: cross-site", "Sec-Fetch-Mode: navigate"]),
        (403, [POST, LENGTH, "Sec-Fetch-Site: same-site"]),
        (403, [POST, LENGTH, "Origin: null"]),
        (403, [POST, LENGTH, "Origin: https://127.0.0.1"]),
        (403, ["POST /TOKEN%2Fmove HTTP/1.1", LENGTH]),
        (403, ["POST //move HTTP/1.1", LENGTH]),
        (403, ["POST /move?TOKEN HTTP/1.1", LENGTH]),
        (403, ["POST http://127.0.0.1/TOKEN/move HTTP/1.1", LENGTH]),
        (404, ["POST /TOKEN/move/ HTTP/1.1", LENGTH]),
        (404, ["POST /TOKEN/__class__ HTTP/1.1", LENGTH]),
        (404, ["GET /TOKEN/../../etc/passwd HTTP/1.1"]),
        (404, ["GET /TOKEN/%2e%2e/bar.yaml HTTP/1.1"]),
        (404, ["GET /TOKEN/changes/1x/p HTTP/1.1"]),
        (421, [PAGE, "Host: evil.example"]),
        (421, [POST, LENGTH, "Host: evil.example"]),
        (400, [POST, LENGTH, LENGTH]),
        (400, [POST, LENGTH, "Content-Length: 0"]),
        (400, [POST, "Content-Length: +5"]),
        (400, [POST, "Content-Length: 5e0"]),
        (400, [POST, "Content-Length: \xb25"]),
        (400, [POST, "Content-Length: "]),
        (411, [POST, LENGTH, "Transfer-Encoding: gzip, chunked"]),
        (431, [PAGE, *(f"X-{k}: 1" for k in range(200))]),
    ],
)
def test_what_a_page_of_another_site_or_a_forged_request_asks_is_refused(server, status, head):
    body = GOOD if LENGTH in head else b"12345"
    assert answered(server, head, body if "POST" in head[0] else b"") == status


def test_a_name_of_another_host_that_leads_here_is_refused(server):
    for host in ("evil.example", f"evil.example:{server.server_port}", "127.0.0.1", f"127.0.0.1:{server.server_port}x"):
        assert answered(server, [PAGE, f"Host: {host}"], host=False) == 421
    assert answered(server, [PAGE.replace("1.1", "1.0")], host=False) == 421
    assert answered(server, [PAGE, f"Host: localhost:{server.server_port}"], host=False) == 200


def test_a_browser_does_not_name_the_port_of_http(server, monkeypatch):
    monkeypatch.setattr(server, "server_port", 80)
    assert server.hosts == ("127.0.0.1", "localhost")


def test_a_body_of_a_million_bytes_is_read_and_one_byte_more_is_not(server):
    # A million blanks are no JSON.
    assert answered(server, [POST, "Content-Length: 1000000"], b" " * 1_000_000) == 400
    assert answered(server, [POST, "Content-Length: 1000001"]) == 413
    # Nor is a number of ten thousand digits.
    assert answered(server, [POST, "Content-Length: 10000"], b"1" * 10_000) == 400


def test_a_body_that_does_not_come_is_not_waited_for(server, monkeypatch):
    monkeypatch.setattr(serving, "_SLOW", 0.2)
    begin = time.monotonic()
    assert answered(server, [POST, "Content-Length: 1000"], b"{") == 408
    assert time.monotonic() - begin < 10


def test_one_who_opens_connections_without_end_is_not_served(server, monkeypatch):
    monkeypatch.setattr(serving, "_MOST_CONNECTIONS", 3)
    lines = [socket.create_connection(("127.0.0.1", server.server_port)) for _ in range(6)]
    try:
        for line in lines:
            line.settimeout(0.2)
        closed = [line for line in lines if ended(line)]
        assert len(closed) >= 3
    finally:
        for line in lines:
            line.close()


def ended(line):
    """Whether the other side has ended a connection."""
    try:
        return line.recv(1) == b""
    except TimeoutError:
        return False
    except ConnectionError:
        return True


def test_no_answer_tells_a_page_elsewhere_where_it_was_asked(server):
    for head in ([PAGE], ["GET /TOKEN/nothing HTTP/1.1"], ["GET /wrong/ HTTP/1.1"]):
        lines = [line.replace("TOKEN", server.token) for line in head]
        with socket.create_connection(("127.0.0.1", server.server_port), timeout=20) as line:
            line.sendall("\r\n".join([*lines, f"Host: {server.hosts[0]}", "Connection: close", "", ""]).encode())
            answer = b""
            while part := line.recv(100_000):
                answer += part
        head, _, body = answer.partition(b"\r\n\r\n")
        for policy in (b"Referrer-Policy: no-referrer", b"Cache-Control: no-store", b"X-Content-Type-Options: nosniff",
                       b"Cross-Origin-Resource-Policy: same-origin", b"frame-ancestors 'none'"):  # fmt: skip
            assert policy in head
        # Nor stands it in a page that is saved or sent.
        assert server.token.encode() not in body


@pytest.mark.slow
@pytest.mark.parametrize("count", [60, pytest.param(3000, marks=pytest.mark.nightly)])
def test_what_no_page_would_send_ends_in_a_refusal_or_a_sentence(session, count):
    generator = random.Random(5)
    odd = [0, -1, 1e149, -1e149, 1e308, 1e-300, True, None, "x", [], {}, [1], [1e100, 1e100], 2**70, "rod.length"]
    names, points = [*session.shown.parameters.names()], [*session.shown.mechanism.points]

    def often(value):
        return value if generator.random() < 0.85 else generator.choice(odd)

    for turn in range(count):
        numbers = [0, -1, 1e9, 1e149, 1e-9, 50, 1e3, 360]
        changes = {generator.choice(names): often(generator.choice(numbers)) for _ in range(generator.randrange(3))}
        sheet = [often(0), often(0), often(generator.choice([1, 1e-300, 3])), often(500), often(400)]
        drag = {"point": often(generator.choice(points)), "to": often([often(50), often(1e149)]),
                "row": often(generator.choice([0, 3.5, 1e9, -5])), "held": often(names[:2])}  # fmt: skip
        asked = {"page": "p", "turn": often(turn), "changes": often(changes), "sheet": often(sheet), "poses": often(9),
                 "rows": often("ABCD"), "question": often("kinematics"), "name": often("../x")}  # fmt: skip
        asked |= {"drag": drag} if generator.random() < 0.7 else {}
        action = generator.choice(["move"] * 6 + ["answer", "pictures", "save"])
        # A mistake of ours would be another kind of exception.
        with suppress(RequestError, OvertakenError, MechdesignError):
            json.dumps(getattr(session, action)(asked), allow_nan=False)


@pytest.fixture
def file(tmp_path):
    """A study of its own folder, and a session of it."""
    path = tmp_path / "study" / "bar.yaml"
    path.parent.mkdir()
    path.write_text(FOUR_BAR)
    return path, Session(load(path), lambda: load(path))


ASKED = {"changes": {"rocker.length": 63.5}, "replace": True}


@pytest.mark.parametrize(
    "name",
    ["..", "../out.yaml", "/etc/out.yaml", "a/../../out.yaml", "..\\out.yaml", "C:out.yaml", "a\n.yaml", "a\0.yaml",
     ".bashrc", "out.py", "out.yaml/", "\u202eout.yaml", "x" * 300 + ".yaml"],
)  # fmt: skip
def test_nothing_is_written_by_a_name_that_leads_elsewhere(file, tmp_path, name):
    path, session = file
    with pytest.raises(Exception, match=r"no plain name|too long"):
        session.save({**ASKED, "name": name})
    assert [entry for entry in tmp_path.rglob("*") if entry.is_file()] == [path]


def test_links_folders_devices_and_what_may_not_be_written_are_never_replaced(file, tmp_path):
    path, session = file
    outside = tmp_path / "outside.yaml"
    outside.write_text("mine")
    (path.parent / "link.yaml").symlink_to(outside)
    (path.parent / "dangling.yaml").symlink_to(tmp_path / "new.yaml")
    (path.parent / "folder.yaml").mkdir()
    os.mkfifo(path.parent / "pipe.yaml")
    (path.parent / "kept.yaml").write_text("mine")
    (path.parent / "kept.yaml").chmod(0o444)
    for name in ("link", "dangling", "folder", "pipe", "kept"):
        with pytest.raises(Exception, match=r"not replaced|may not be written"):
            session.save({**ASKED, "name": f"{name}.yaml"})
    assert (outside.read_text(), (path.parent / "kept.yaml").read_text()) == ("mine", "mine")
    assert not (tmp_path / "new.yaml").exists()
    assert (path.parent / "link.yaml").is_symlink()


def test_a_study_that_became_a_link_or_a_folder_meanwhile_is_told_and_not_written(file, tmp_path):
    path, session = file
    path.rename(tmp_path / "moved.yaml")
    path.symlink_to(tmp_path / "moved.yaml")
    with pytest.raises(Exception, match="is a link"):
        session.save({**ASKED, "name": ""})
    path.unlink()
    path.mkdir()
    session.reload()
    assert str(path) in session.mistake
    assert session.study.sizes["rocker.length"] == 60
    with pytest.raises(Exception, match="a folder"):
        session.save({**ASKED, "name": ""})
    assert (tmp_path / "moved.yaml").read_text() == FOUR_BAR


def test_a_file_that_was_deleted_meanwhile_is_written_anew(file):
    path, session = file
    path.unlink()
    session.reload()
    assert session.mistake
    assert session.save({**ASKED, "name": ""})["saved"] == "bar.yaml"
    assert load(path).sizes["rocker.length"] == 63.5
    assert session.mistake == ""


def test_a_study_that_only_its_owner_may_read_stays_so(file):
    path, session = file
    path.chmod(0o600)
    session.save({**ASKED, "name": ""})
    assert "63.5" in path.read_text()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_an_answer_that_a_newer_change_has_overtaken_is_dropped_and_the_page_goes_on(session):
    asked = {"page": "q", "changes": {"rocker.length": 61.0}, "sheet": None, "question": "kinematics"}
    with session._computing:
        older = []

        def answer():
            try:
                older.append(session.answer({**asked, "turn": 1}))
            except OvertakenError:
                older.append("overtaken")

        waiting = threading.Thread(target=answer)
        waiting.start()
        while session._pages.get("q") is None:
            time.sleep(0.01)
        session.move({**MOVE, "page": "q", "turn": 2})
    waiting.join(20)
    assert older == ["overtaken"]
    assert session.answer({**asked, "turn": 3})["html"]
    with pytest.raises(OvertakenError):
        session.pictures({**asked, "turn": 2})


@pytest.mark.nightly
def test_an_answer_does_not_wait_for_pictures_that_are_being_drawn(session):
    asked = {"page": "r", "changes": {}, "sheet": None, "question": "kinematics"}
    session.answer({**asked, "turn": 1})
    drawn = []

    def draw():
        with suppress(OvertakenError):
            drawn.append(session.pictures({**asked, "turn": 1}))

    with DRAWING:
        drawing = threading.Thread(target=draw)
        drawing.start()
        assert session.answer({**asked, "turn": 2})["html"]
        assert drawing.is_alive()
    drawing.join(20)
    # The newer change has made them worthless.
    assert drawn == []
