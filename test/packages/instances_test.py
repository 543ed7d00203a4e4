#!/usr/bin/env python3
"""Two cameras on one machine: the command lines of two instances of alidade@.service, each with its configuration, side by side.

    instances_test.py UNIT      the unit as it is packed; ALIDADE and ALIDADE_SIMULATE in the environment
"""
import json
import pathlib
import re
import signal
import subprocess
import sys
import unittest
import urllib.request

PROJECT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(PROJECT / "test/system"))
from harness import ALIDADE, IMAGE, Process, SystemTest, free_port, wait_until  # noqa: E402  pylint: disable=wrong-import-position

UNIT = ""
# What its RestrictAddressFamilies allows.
FAMILIES = {"AF_UNIX", "AF_INET", "AF_INET6"}


def refused_calls():
    """Of `SystemCallFilter=~@...`, by systemd's own list."""
    refused, waiting = set(), re.findall(r"^SystemCallFilter=~(@\S+)", UNIT, re.M)
    assert waiting
    while waiting:
        text = subprocess.run(["systemd-analyze", "syscall-filter", waiting.pop()], check=True, capture_output=True, text=True).stdout
        words = [line.strip() for line in text.splitlines()[1:] if line.strip() and not line.strip().startswith("#")]
        waiting += [word for word in words if word.startswith("@")]
        refused |= {word for word in words if not word.startswith("@")}
    return refused


class Instances(SystemTest):
    def words(self, name):
        """The command of the instance, with this test's folder for the machine's."""
        command = re.search(r"^ExecStart=(.*)$", UNIT, re.M).group(1).replace("%i", name)
        program, *words = command.replace("/etc/alidade", str(self.folder / "etc")).split()
        self.assertEqual(program, "/usr/bin/alidade")
        return words

    def configure(self, name, camera, port):
        """From the example, where only what it calls its own is replaced, and what a machine for tests does not grant."""
        text = (PROJECT / "edge_app/examples/several_cameras.yaml").read_text(encoding="utf-8")
        own = {"rtsp://gate-camera/axis-media/media.amp": camera.video_url, "http://gate-camera": camera.pan_tilt_url,
               "/var/lib/alidade/gate": str(self.folder / "lib" / name), "127.0.0.1:8081": f"127.0.0.1:{port}"}
        for example, value in own.items():
            self.assertIn(example, text)
            text = text.replace(example, value)
        text = re.sub(r"\n  (priority|lock_memory):.*", "", text)
        for side in ("width", "height"):
            text = re.sub(rf"\n  {side}: .*", f"\n  {side}: {IMAGE[side]}", text)
        (self.folder / "etc").mkdir(exist_ok=True)
        (self.folder / "lib" / name).mkdir(parents=True)
        (self.folder / "etc" / f"{name}.yaml").write_text(text, encoding="utf-8")

    def status(self, port):
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/api/v1/status", timeout=30) as answer:
            return json.load(answer)

    def test_two_run_side_by_side_and_ask_for_nothing_that_the_unit_refuses(self):
        traced = ",".join(["socket", *(f"?{call}" for call in sorted(refused_calls()))])
        runs, ports, traces = {}, {}, {}
        for seed, name in enumerate(("gate", "yard"), 1):
            ports[name], traces[name] = free_port(), self.folder / f"{name}.trace"
            self.configure(name, self.camera(seed=seed), ports[name])
            # -D: what a signal ends is the program, not its observer.
            runs[name] = Process("strace", "-D", "-f", "--seccomp-bpf", "-o", traces[name], "-e", f"trace={traced}", "-e", "signal=none",
                                 ALIDADE, *self.words(name))
            self.processes.append(runs[name])
        for name, port in ports.items():
            wait_until(lambda run=runs[name]: any("HTTP: listening" in line for line in run.errors), f"{name} listens")
            wait_until(lambda port=port: self.status(port)["frames"]["received"] > 10, f"{name} has frames")
        for name, run in runs.items():
            code, _ = run.end(signal.SIGTERM)
            self.assertEqual(code, 0, run.error_text())
            trace = traces[name]
            wait_until(lambda trace=trace: "+++ exited with 0 +++" in trace.read_text(encoding="utf-8").splitlines()[-1], "the end is seen")
            calls = re.findall(r"^\d+ +(\w+)\(([^,)]*)", trace.read_text(encoding="utf-8"), re.M)
            self.assertIn(("socket", "AF_INET"), calls)
            # Netlink is the resolver's, which does without.
            refused = [call for call in calls if call[0] != "socket" or call[1] not in {*FAMILIES, "AF_NETLINK"}]
            self.assertEqual(refused, [])


if __name__ == "__main__":
    UNIT = pathlib.Path(sys.argv.pop(1)).read_text(encoding="utf-8")
    unittest.main()
