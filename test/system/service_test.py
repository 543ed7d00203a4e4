#!/usr/bin/env python3
"""What `alidade run` tells systemd: a socket like systemd's own hears that it is ready, lives, ends."""
import json
import os
import queue
import signal
import socket
import subprocess
import threading
import unittest

from harness import ALIDADE, DEADLINE_S, SystemTest

WATCHED = {"WATCHDOG_USEC": "400000"}


class Manager:
    """The socket of a service manager, which always reads."""

    def __init__(self, folder):
        self.path = str(folder / "notify")
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(self.path)
        self.messages = queue.Queue()
        self.thread = threading.Thread(target=self._gather)
        self.thread.start()

    def _gather(self):
        while message := self.socket.recv(4096):
            self.messages.put(message.decode())

    def close(self):
        """An empty message ends the thread."""
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as last:
            last.sendto(b"", self.path)
        self.thread.join()
        self.socket.close()

    def next(self):
        return self.messages.get(timeout=DEADLINE_S)

    def forget(self):
        """What has come so far."""
        while not self.messages.empty():
            self.messages.get()


class Service(SystemTest):
    def setUp(self):
        super().setUp()
        self.manager = Manager(self.folder)
        self.addCleanup(self.manager.close)
        self.head = self.camera()
        self.config = self.write_config(self.head)

    def start(self, **environment):
        return self.alidade("run", "-c", self.config, NOTIFY_SOCKET=self.manager.path, **environment)

    def test_is_ready_lives_and_ends(self):
        run = self.start(**WATCHED)
        self.assertEqual("READY=1", self.manager.next())
        for _ in range(5):
            self.assertEqual("WATCHDOG=1", self.manager.next())
        code, _ = run.end(signal.SIGTERM)
        self.assertEqual(code, 0, run.error_text())
        while (message := self.manager.next()) == "WATCHDOG=1":
            pass
        self.assertEqual("STOPPING=1", message)

    def test_tells_what_goes_on(self):
        run = self.start()
        self.assertEqual("READY=1", self.manager.next())
        self.assertRegex(self.manager.next(),
                         r"^STATUS=[0-9.]+ frames a second; records of the last 1\d s: OE 0, PT [1-9]\d*, none \d+$")
        code, _ = run.end(signal.SIGTERM)
        self.assertEqual(code, 0, run.error_text())

    def test_lives_without_a_camera(self):
        run = self.start(**WATCHED)
        self.assertIsNotNone(run.line(), run.error_text())
        self.head.end(signal.SIGKILL)
        self.manager.forget()
        # Beyond what a process that does not live is given.
        for _ in range(10):
            self.assertEqual("WATCHDOG=1", self.manager.next())
        code, _ = run.end(signal.SIGTERM)
        self.assertEqual(code, 0, run.error_text())

    def test_lives_while_nobody_reads_its_records(self):
        environment = {**os.environ, **WATCHED, "NOTIFY_SOCKET": self.manager.path}
        with subprocess.Popen([ALIDADE, "run", "-c", self.config], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              text=True, env=environment) as run:
            try:
                self.assertEqual("READY=1", self.manager.next())
                # In twenty seconds far more records than the pipe holds.
                statuses = 0
                alive = 0
                while statuses < 2:
                    message = self.manager.next()
                    statuses += message.startswith("STATUS=")
                    alive += message == "WATCHDOG=1"
                self.assertGreater(alive, 20)
                run.send_signal(signal.SIGTERM)
                records, said = run.communicate()
            finally:
                run.kill()
        self.assertRegex(said, r"[1-9]\d* records were not written, as the reader of stdout was too slow")
        for line in records.splitlines():
            json.loads(line)


if __name__ == "__main__":
    unittest.main()
