#!/usr/bin/env python3
"""`alidade run` and a real mosquitto broker as a site has it: TLS by a chain of authorities, a login, and what the broker says when the service dies.

The root signs an intermediate authority, and that one the broker: the broker sends both certificates, and `run` knows the root alone.
"""
import json
import pathlib
import shutil
import signal
import subprocess
import unittest

from harness import Process, SystemTest, free_port, wait_until

PASSWORD = "right horse"
BROKER = shutil.which("mosquitto", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")


class Authority:
    """A key and its certificate in the folder, signed by another one; by itself without."""

    def __init__(self, folder, name, signer=None, extensions="basicConstraints=critical,CA:TRUE"):
        self.key, self.certificate = folder / f"{name}.key", folder / f"{name}.pem"
        request, settings = folder / f"{name}.csr", folder / f"{name}.ext"
        settings.write_text(extensions)
        self.run("req", "-new", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={name}", "-keyout", self.key, "-out", request)
        by = ["-CA", signer.certificate, "-CAkey", signer.key, "-CAcreateserial"] if signer else ["-signkey", self.key]
        self.run("x509", "-req", "-in", request, "-days", "2", "-extfile", settings, "-out", self.certificate, *by)

    @staticmethod
    def run(*arguments):
        subprocess.run(["openssl", *map(str, arguments)], check=True, capture_output=True)


class Mqtt(SystemTest):
    def setUp(self):
        super().setUp()
        self.root = Authority(self.folder, "root")
        between = Authority(self.folder, "between", self.root)
        broker = Authority(self.folder, "broker", between, "subjectAltName=IP:127.0.0.1")
        chain = self.folder / "chain.pem"
        chain.write_text(broker.certificate.read_text() + between.certificate.read_text())
        passwords = self.folder / "passwords"
        subprocess.run(["mosquitto_passwd", "-c", "-b", str(passwords), "mast", PASSWORD], check=True, capture_output=True)
        self.port = free_port()
        settings = self.folder / "mosquitto.conf"
        settings.write_text(f"user root\nlistener {self.port} 127.0.0.1\ncertfile {chain}\nkeyfile {broker.key}\n"
                            f"allow_anonymous false\npassword_file {passwords}\n")
        self.start(BROKER, "-c", settings)
        self.source = self.camera()

    def start(self, *arguments, **environment):
        process = Process(*arguments, **environment)
        self.processes.append(process)
        return process

    def run_with(self, password=PASSWORD, root=None):
        mqtt = {"url": f"mqtts://127.0.0.1:{self.port}", "ca_file": str((root or self.root).certificate), "user": "mast",
                "password_env": "BROKER_PASSWORD", "prefix": "site/mast", "max_backoff_s": 1, "orientation_rate_hz": 5}
        return self.alidade("run", "-c", self.write_config(self.source, mqtt=mqtt), BROKER_PASSWORD=password)

    def listen(self, topic):
        """A subscriber: a line for each message, `r` before those that were retained."""
        client = self.start("mosquitto_sub", "-h", "127.0.0.1", "-p", self.port, "--cafile", self.root.certificate, "-u", "mast",
                            "-P", PASSWORD, "-t", f"site/mast/{topic}", "-F", "%r %p")
        return client

    def test_a_chain_of_authorities_a_login_and_the_last_will(self):
        run = self.run_with()
        self.assertIsNotNone(run.line(), run.error_text())
        orientation = self.listen("orientation")
        told = json.loads(orientation.line()[2:])
        self.assertIn("frame", told)
        status = self.listen("status")
        self.assertEqual(status.line(), "1 online", run.error_text())
        run.end(signal.SIGKILL)
        self.assertEqual(status.line(), "0 offline")
        # It stays for who asks later, until the service is back.
        self.assertEqual(self.listen("status").line(), "1 offline")
        again = self.run_with()
        self.assertEqual(status.line(), "0 online")
        again.end(signal.SIGTERM)
        self.assertEqual(status.line(), "0 offline")

    def assert_refused(self, run, what):
        """Said once, though it is tried again and again, and records go on."""
        wait_until(lambda: what in run.error_text(), f"'{what}'")
        for _ in range(50):
            self.assertIsNotNone(run.line(), run.error_text())
        self.assertEqual(run.error_text().count(what), 1, run.error_text())
        code, _ = run.end(signal.SIGTERM)
        self.assertEqual(code, 0, run.error_text())

    def test_a_wrong_password_is_said(self):
        self.assert_refused(self.run_with(password="wrong horse"), "password")

    def test_a_broker_of_another_authority_is_refused(self):
        other = pathlib.Path(self.folder, "other")
        other.mkdir()
        self.assert_refused(self.run_with(root=Authority(other, "root")), "certificate verify failed")


if __name__ == "__main__":
    unittest.main()
