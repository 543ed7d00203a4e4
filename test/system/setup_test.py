#!/usr/bin/env python3
"""`alidade setup` without a browser: the page and its policy, the token, a search, a camera that is tried and written."""
import contextlib
import http.client
import json
import re
import signal
import unittest

from harness import DEADLINE_S, SystemTest


class Setup(SystemTest):
    def start(self, *arguments):
        """Its address and token; the lines that it prints are for a person."""
        process = self.alidade("setup", "--port", "0", *arguments)
        lines = [process.line() for _ in range(5)]
        address = re.search(r"http://(127\.0\.0\.1:\d+)/#([0-9a-f]{32})$", lines[1] or "")
        self.assertIsNotNone(address, f"{lines}\n{process.error_text()}")
        port = address.group(1).split(":")[1]
        self.assertRegex(lines[3], rf"^  ssh -L {port}:127\.0\.0\.1:{port} \S+@\S+$")
        return process, address.group(1), address.group(2)

    def ask(self, address, method, path, token=None, body=None):
        """Status, headers, body."""
        with contextlib.closing(http.client.HTTPConnection(address, timeout=DEADLINE_S)) as connection:
            headers = {"Authorization": f"Bearer {token}"} if token else {}
            connection.request(method, path, json.dumps(body) if body is not None else None, headers)
            answer = connection.getresponse()
            return answer.status, answer.headers, answer.read().decode()

    def test_tries_a_camera_and_writes_its_configuration(self):
        camera = self.camera(codec="h264", settings={"live": {"codec": "h264", "onvif_port": 0}})
        config = self.folder / "camera.yaml"
        process, address, token = self.start("--write", str(config))
        status, headers, page = self.ask(address, "GET", "/")
        self.assertEqual(status, 200)
        self.assertIn("default-src 'none'", headers["Content-Security-Policy"])
        self.assertNotIn(token, page)

        def post(what, body, with_token=token):
            status, _, answer = self.ask(address, "POST", f"/api/v1/setup/{what}", with_token, body)
            return status, json.loads(answer)

        self.assertEqual(post("start", {}, None)[0], 401)
        self.assertEqual(post("search", {"device": camera.others["onvif"]}, "0" * 32)[0], 401)
        self.assertEqual(post("start", {}), (200, {"path": str(config)}))
        device = camera.others["onvif"] + "/onvif/device_service"
        status, found = post("search", {"device": device})
        self.assertEqual(status, 200, found)
        self.assertEqual(found["cameras"][0]["model"], "Virtual PTZ")
        # What is missing, or wrong, is said in one line, and nothing is written.
        for body, said in (({"device": device}, "--field-of-view"), ({"device": device, "field_of_view": "3.4"}, "pan_range_deg"),
                           ({"device": device, "keys": 5}, "expected a list"), ({"device": "nonsense://"}, "no device's address")):
            status, answer = post("write", body)
            self.assertEqual(status, 422, answer)
            self.assertIn(said, answer["error"])
            self.assertFalse(config.exists())
        status, answer = post("write", {"other": 1})
        self.assertEqual(status, 400, answer)
        status, answer = post("write", {"device": device, "field_of_view": "3.4",
                                        "keys": ["pan_tilt.pan_range_deg=[-180,180]", "pan_tilt.tilt_range_deg=[-90,90]"]})
        self.assertEqual(status, 200, answer)
        self.assertEqual(answer["path"], str(config))
        self.assertIn("type: onvif", config.read_text())
        code, _ = process.end(signal.SIGTERM)
        self.assertEqual(code, 0, process.error_text())

    def test_overwrites_nothing(self):
        config = self.folder / "camera.yaml"
        config.write_text("mine")
        process = self.alidade("setup", "--port", "0", "--write", str(config))
        code, _ = process.end()
        self.assertEqual(code, 2)
        self.assertIn("exists already", process.error_text())
        self.assertEqual(config.read_text(), "mine")

    def test_run_without_a_configuration_names_it(self):
        process = self.alidade("run")
        code, _ = process.end()
        self.assertEqual(code, 2)
        self.assertIn("alidade setup", process.error_text())


if __name__ == "__main__":
    unittest.main()
