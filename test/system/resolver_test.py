#!/usr/bin/env python3
"""A name server that never answers: whatever `alidade` looks up the name of, SIGTERM ends it, and so does the deadline
of what it cannot start without.

Runs itself again in namespaces of its own, where that server is the only one. A look-up there takes 150 s, longer than
the harness waits for an end. Where such namespaces are not allowed, the exit code is 77, and ctest says "skipped".
"""
import fcntl
import os
import pathlib
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

from harness import SystemTest, wait_until

SKIPPED = 77
INSIDE = "ALIDADE_TEST_NAME_SERVER"
VIDEO = {"type": "rtp", "url": "rtp://@:15004", "format": "MJPG", "width": 160, "height": 96}
HEAD = {"type": "pelco_d", "url": "tcp://127.0.0.1:1"}
CALIBRATION = {"calibration": {"auto": False}}


def enter_namespaces():
    """Replaces this process by itself inside, or ends it."""
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    unshare = ["unshare", *user, "--net", "--mount"]
    tried = subprocess.run([*unshare, "true"], capture_output=True, text=True, check=False)
    if tried.returncode != 0:
        print(f"skipped: no namespaces here: {tried.stderr.strip()}", file=sys.stderr)
        sys.exit(SKIPPED)
    os.execvpe(unshare[0], [*unshare, sys.executable, "-B", *sys.argv], {**os.environ, INSIDE: "1"})


def bind(folder, path, text):
    file = pathlib.Path(folder, pathlib.Path(path).name)
    file.write_text(text)
    subprocess.run(["mount", "--bind", str(file), path], check=True)


def loopback_up():
    """SIOCGIFFLAGS, SIOCSIFFLAGS of `struct ifreq`."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        request = bytearray(struct.pack("16sh22x", b"lo", 0))
        fcntl.ioctl(any_socket, 0x8913, request)
        flags = struct.unpack_from("h", request, 16)[0]
        fcntl.ioctl(any_socket, 0x8914, struct.pack("16sh22x", b"lo", flags | 1))


class Resolver(SystemTest):
    @classmethod
    def setUpClass(cls):
        loopback_up()
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        bind(folder.name, "/etc/nsswitch.conf", "hosts: files dns\n")
        bind(folder.name, "/etc/resolv.conf", "nameserver 127.0.0.1\noptions timeout:30 attempts:5\n")
        cls.server = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        cls.server.bind(("127.0.0.1", 53))
        cls.asked = set()
        cls.listener = threading.Thread(target=cls.listen, daemon=True)
        cls.listener.start()

    @classmethod
    def listen(cls):
        """Notes the first label of each name that is asked for."""
        while True:
            query = cls.server.recv(4096)
            cls.asked.add(query[13:13 + query[12]].decode())

    def assert_ends(self, name, *arguments):
        """After the name is asked for."""
        process = self.alidade(*arguments)
        wait_until(lambda: name in self.asked or process.child.poll() is not None, f"a query for {name}")
        self.assertIn(name, self.asked, process.error_text())
        code, _ = process.end(signal.SIGTERM)
        self.assertEqual(code, 0, process.error_text())

    def run_with(self, **sections):
        config = self.write_config(**{"video": VIDEO, "pan_tilt": HEAD, **CALIBRATION, **sections})
        return "run", "-c", config

    def test_of_a_camera(self):
        for scheme, kind in (("rtsp", "rtsp"), ("rtsps", "rtsp"), ("http", "mjpeg"), ("https", "mjpeg")):
            with self.subTest(scheme):
                name = f"camera-by-{scheme}"
                self.assert_ends(name, *self.run_with(video={**VIDEO, "type": kind, "format": None, "url": f"{scheme}://{name}.example/x"}))

    def test_of_a_head(self):
        for kind, scheme in (("vapix", "http"), ("onvif", "http"), ("pelco_d", "tcp"), ("pelco_d", "udp")):
            with self.subTest(f"{kind} by {scheme}"):
                name = f"{kind}-by-{scheme}"
                self.assert_ends(name, *self.run_with(pan_tilt={"type": kind, "url": f"{scheme}://{name}.example:4001"}))

    def test_of_a_broker(self):
        for scheme in ("mqtt", "mqtts"):
            with self.subTest(scheme):
                name = f"broker-by-{scheme}"
                self.assert_ends(name, *self.run_with(mqtt={"url": f"{scheme}://{name}.example"}))

    def test_of_its_own_server(self):
        self.assert_ends("server", *self.run_with(output={"http": "server.example:0"}))

    def test_of_its_own_server_without_a_signal(self):
        process = self.alidade(*self.run_with(output={"http": "deadline.example:0"}))
        code, _ = process.end()
        self.assertEqual(code, 1, process.error_text())
        self.assertIn("HTTP: cannot listen on deadline.example:0: its name was not found within ", process.error_text())


if __name__ == "__main__":
    if INSIDE not in os.environ:
        enter_namespaces()
    unittest.main()
