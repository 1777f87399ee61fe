"""The base over `wss://`: the emulated bridge behind a TLS server, with and without a trusted certificate."""

from __future__ import annotations

import contextlib
import select
import shutil
import socket
import ssl
import subprocess
import threading

import pytest

from robot_io.errors import DeviceProtocolError, DeviceUnreachable
from robot_io.messages import BodyTwist, LinkState
from robot_io.ridgeback import Ridgeback
from tests.wire.bridge_process import running_bridge, until

pytestmark = pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")


def certificate(folder, name):
    """Write a certificate that is its own authority, for `name`; return the files of certificate and key."""
    crt, key = folder / f"{name}.crt", folder / f"{name}.key"
    command = ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes"]
    command += ["-days", "2", "-subj", f"/CN={name}", "-addext", f"subjectAltName=DNS:{name}"]
    subprocess.run([*command, "-keyout", key, "-out", crt], check=True, capture_output=True)
    return crt, key


def pump(client, server):
    """Pass bytes on between the two until one of them ends."""
    with client, server, contextlib.suppress(OSError):
        while True:
            ready = [client] if client.pending() else select.select([client, server], [], [])[0]
            for source in ready:
                data = source.recv(65536)
                if not data:
                    return
                (server if source is client else client).sendall(data)


@contextlib.contextmanager
def encrypted(bridge, files):
    """Serve TLS in front of a bridge; yield the port."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(*files)
    listener = socket.create_server(("127.0.0.1", 0))
    target = ("127.0.0.1", int(bridge.url.rpartition(":")[2]))

    def serve():
        while True:
            try:
                plain, _ = listener.accept()
            except OSError:
                return
            with contextlib.suppress(OSError):
                plain.settimeout(5.0)
                with plain:  # after the handshake the wrapped socket owns the connection
                    pump(context.wrap_socket(plain, server_side=True), socket.create_connection(target))

    server = threading.Thread(target=serve)
    server.start()
    try:
        yield listener.getsockname()[1]
    finally:
        listener.shutdown(socket.SHUT_RDWR)
        listener.close()
        server.join()


def test_an_encrypted_bridge_is_driven_like_any_other(tmp_path, monkeypatch):
    files = certificate(tmp_path, "localhost")
    monkeypatch.setenv("SSL_CERT_FILE", str(files[0]))
    with running_bridge() as bridge, encrypted(bridge, files) as port, Ridgeback(f"wss://localhost:{port}") as base:
        for _ in range(30):
            assert base.command(BodyTwist(0.1)) == BodyTwist(0.1)
            assert until(lambda: bool(base.drain()), 0.1)
        speeds = [vx for _, vx, _, _ in bridge.heard()]
        assert speeds.count(0.1) >= 25
        assert base.health().counters["echo"] >= 20
        assert base.health().counters["undecodable"] == 0
        assert base.health().state == LinkState.UP


def test_a_certificate_that_nobody_vouches_for_is_refused(tmp_path, monkeypatch):
    files = certificate(tmp_path, "localhost")
    monkeypatch.delenv("SSL_CERT_FILE", raising=False)
    with (
        running_bridge() as bridge,
        encrypted(bridge, files) as port,
        pytest.raises(DeviceProtocolError, match="its certificate is not trusted") as caught,
    ):
        Ridgeback(f"wss://localhost:{port}").open()
    assert "SSL_CERT_FILE" in caught.value.do


def test_a_certificate_for_another_name_is_refused(tmp_path, monkeypatch):
    files = certificate(tmp_path, "another.host")
    monkeypatch.setenv("SSL_CERT_FILE", str(files[0]))
    with (
        running_bridge() as bridge,
        encrypted(bridge, files) as port,
        pytest.raises(DeviceProtocolError, match=r"certificate is not trusted .*localhost"),
    ):
        Ridgeback(f"wss://localhost:{port}").open()


def test_a_bridge_that_does_not_encrypt_is_told_apart():
    with running_bridge() as bridge:
        port = bridge.url.rpartition(":")[2]
        with pytest.raises((DeviceProtocolError, DeviceUnreachable), match=r"TLS|encrypted") as caught:
            Ridgeback(f"wss://localhost:{port}").open()
        assert "ws://" in caught.value.do
