"""`sovo dashboard` behind TLS: pages, token and Foxglove's protocol, by Python's own TLS."""

import base64
import http.client
import json
import os
import re
import shutil
import signal
import socket
import ssl
import subprocess

import harness
from harness import FAILED, OK, USAGE, own_domain, sovo, start

TOKEN = "0123456789abcdef0123456789abcdef"


class DashboardTls(harness.CommandTest):
    def setUp(self):
        super().setUp()
        if shutil.which("openssl") is None:
            self.skipTest("openssl is missing: it makes the certificate")
        self.certificate, self.key = self.make_certificate("server")
        self.token = self.folder / "token"
        self.token.write_text(TOKEN + "\n")
        self.token.chmod(0o600)
        self.bus = ["--network", "lo", "--domain", str(own_domain())]

    def make_certificate(self, name):
        certificate, key = self.folder / f"{name}.pem", self.folder / f"{name}.key"
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1",
             "-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=localhost",
             "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-nodes"],
            check=True, capture_output=True)
        return certificate, key

    def start_dashboard(self):
        process = start("dashboard", *self.bus, "--listen", "127.0.0.1:0", "--token-file",
                        self.token, "--tls-cert", self.certificate, "--tls-key", self.key)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        log = "".join(self.wait_for_line(process.stderr, "Foxglove connects to"))
        self.port = int(re.search(r"wss://127\.0\.0\.1:(\d+)/", log).group(1))
        self.assertIn(f"https://127.0.0.1:{self.port}/", log)
        self.assertNotIn(TOKEN, log)
        return process

    def trust(self):
        """TLS as a client that trusts this one certificate does it, with the name checked."""
        return ssl.create_default_context(cafile=self.certificate)

    def get(self, path, **headers):
        connection = http.client.HTTPSConnection("127.0.0.1", self.port, context=self.trust(),
                                                 timeout=60)
        connection.request("GET", path, headers=headers)
        response = connection.getresponse()
        response.body = response.read().decode()
        connection.close()
        return response

    def open_socket(self, path, **headers):
        """A WebSocket after its handshake, and the answer's head."""
        plain = socket.create_connection(("127.0.0.1", self.port), timeout=60)
        secure = self.trust().wrap_socket(plain, server_hostname="127.0.0.1")
        self.addCleanup(secure.close)
        key = base64.b64encode(os.urandom(16)).decode()
        lines = [f"GET {path} HTTP/1.1", f"Host: 127.0.0.1:{self.port}", "Upgrade: websocket",
                 "Connection: Upgrade", "Sec-WebSocket-Version: 13", f"Sec-WebSocket-Key: {key}",
                 "Sec-WebSocket-Protocol: foxglove.sdk.v1",
                 *(f"{name}: {value}" for name, value in headers.items()), "", ""]
        secure.sendall("\r\n".join(lines).encode())
        stream = secure.makefile("rb")
        head = []
        while (line := stream.readline().decode().strip()):
            head.append(line)
        return stream, head

    def read_text(self, stream):
        """The next message, which must be text of one frame."""
        first, length = stream.read(2)
        self.assertEqual(first, 0x81)
        if length == 126:
            length = int.from_bytes(stream.read(2), "big")
        return json.loads(stream.read(length))

    def test_token_and_cookie_and_protocol_over_tls(self):
        process = self.start_dashboard()
        self.assertEqual(self.get("/healthz").body, "ok\n")
        self.assertEqual(self.get("/metrics").status, 401)
        self.assertEqual(self.get("/metrics", Authorization=f"Bearer {TOKEN}").status, 200)

        exchanged = self.get(f"/?token={TOKEN}")
        self.assertEqual(exchanged.status, 303)
        self.assertEqual(exchanged.getheader("Location"), "/")
        cookie = exchanged.getheader("Set-Cookie")
        for part in ("Secure", "HttpOnly", "SameSite=Strict"):
            self.assertIn(part, cookie.split("; "))
        self.assertNotIn(TOKEN, cookie)
        session = cookie.split(";")[0]
        self.assertEqual(self.get("/metrics", Cookie=session).status, 200)
        self.assertEqual(self.get("/metrics", Cookie=session[:-1]).status, 401)

        own = f"https://127.0.0.1:{self.port}"
        for path, headers in ((f"/?token={TOKEN}", {}), ("/", {"Cookie": session, "Origin": own})):
            stream, head = self.open_socket(path, **headers)
            self.assertIn("101", head[0])
            self.assertEqual(self.read_text(stream)["op"], "serverInfo")
        self.assertIn("401", self.open_socket("/")[1][0])
        foreign = {"Cookie": session, "Origin": "https://elsewhere.example"}
        self.assertIn("403", self.open_socket("/", **foreign)[1][0])
        # The same host without TLS is another origin.
        foreign["Origin"] = own.replace("https", "http")
        self.assertIn("403", self.open_socket("/", **foreign)[1][0])

        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as plain:
            plain.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
            self.assertNotIn(b"HTTP/1.1 200", plain.recv(4096))
        old = self.trust()
        old.minimum_version = old.maximum_version = ssl.TLSVersion.TLSv1_2
        with socket.create_connection(("127.0.0.1", self.port), timeout=60) as plain:
            with old.wrap_socket(plain, server_hostname="127.0.0.1") as secure:
                self.assertEqual(secure.version(), "TLSv1.2")
        self.assertEqual(self.get("/healthz").body, "ok\n")
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=60), OK)

    def test_what_is_wrong_with_the_files_is_said(self):
        _, other = self.make_certificate("other")
        listen = ["dashboard", *self.bus, "--listen", "127.0.0.1:0"]
        locked = self.folder / "locked.key"
        subprocess.run(["openssl", "ec", "-in", self.key, "-aes256", "-passout", "pass:secret",
                        "-out", locked], check=True, capture_output=True)
        for certificate, key, code, text in [
                (self.certificate, locked, FAILED, "no passphrase"),
                (self.folder / "none.pem", self.key, FAILED, "none.pem: cannot be read"),
                (self.certificate, self.folder / "none.key", FAILED, "none.key: cannot be read"),
                (self.key, self.key, FAILED, "TLS certificate"),
                (self.certificate, other, FAILED, "key values mismatch")]:
            with self.subTest(certificate=certificate, key=key):
                refused = sovo(*listen, "--tls-cert", certificate, "--tls-key", key)
                self.assertIn(text, self.expect(refused, code).stderr)
        alone = self.expect(sovo(*listen, "--tls-cert", self.certificate), USAGE)
        self.assertIn("--tls-key", alone.stderr)


if __name__ == "__main__":
    harness.main()
