"""The service under a real systemd and udev, in a virtual machine.

    virtual_machine_service_test.py BUILD_FOLDER

Makes the machine if need be, boots a copy of this system in it with its own systemd, and tests what the script left in
build/virtual_machine/service. Ends with 77 where the machine cannot be had.
"""
import json
import pathlib
import re
import shutil
import sys
import unittest

from machine import CALIBRATION, HERE, MACHINES, SKIPPED, TOP, judge, make, run

BUILD = pathlib.Path(sys.argv[1]).resolve()
WORK = MACHINES / "service"
WIDTH, HEIGHT = 320, 180
DEADLINE_S = 500

CONFIG = {"video": {"type": "v4l2", "device": "/dev/v4l/by-path/platform-vivid.0-video-index0", "format": "GREY",
                    "width": WIDTH, "height": HEIGHT, "rate_hz": 15},
          "pan_tilt": {"type": "pelco_d", "device": "/run/head", "angle_quantum_rad": 1.7e-4},
          "camera": {"focal_length_px": 1000},
          "calibration": {"file": "/var/lib/alidade/calibration.yaml", "auto": False},
          "realtime": {"mode": "PT", "priority": 50, "lock_memory": True},
          "output": {"json": False, "http": "127.0.0.1:8080"}}


def boot():
    """The machine's console, after it has run its script."""
    if not pathlib.Path("/lib/systemd/systemd").exists():
        print("SKIPPED: there is no systemd here; scripts/install-deps all installs what is needed")
        sys.exit(SKIPPED)
    machine = make("amd64")
    shutil.rmtree(WORK, ignore_errors=True)
    (WORK / "bin").mkdir(parents=True)
    for program in ("edge_app/alidade", "test/system/virtual_machine/simulated_head"):
        shutil.copy(BUILD / program, WORK / "bin")
    shutil.copytree(TOP / "edge_app/packaging", WORK / "packaging")
    shutil.copy(HERE / "service_prepare", WORK / "prepare")
    shutil.copy(HERE / "service_script", WORK / "script")
    (WORK / "calibration.yaml").write_text(CALIBRATION % (WIDTH, HEIGHT))
    # A section a line, so that one more can be added.
    (WORK / "alidade.yaml").write_text("".join(f"{name}: {json.dumps(section)}\n" for name, section in CONFIG.items()))
    return run(HERE / "run-machine", "amd64", machine, "/", WORK, DEADLINE_S, "systemd").stdout


def text(name):
    file = WORK / name
    return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""


def shown(name):
    """What systemd said of the service."""
    return dict(line.split("=", 1) for line in text(f"{name}.show").splitlines())


class Service(unittest.TestCase):
    def setUp(self):
        if not (WORK / "exit").exists():
            self.fail("the machine did not come to its end; its console is below\n" + text("journal")[-3000:])

    def test_devices_have_lasting_names_and_what_the_rules_say(self):
        self.assertIn("platform-vivid.0-video-index0", text("cameras"))
        self.assertRegex(text("lines"), r"usb-QEMU_.*-port0")
        self.assertEqual("1", text("latency_timer").strip())
        self.assertIn("ID_MM_DEVICE_IGNORE=1", text("line.properties"))

    def test_starts_as_its_own_user_with_the_priority_and_memory_it_asks_for(self):
        service = shown("started")
        self.assertEqual("active", service["ActiveState"])
        self.assertEqual("0", service["NRestarts"])
        self.assertRegex(service["StatusText"], r"records of the last \d+ s: OE 0, PT [1-9]")
        threads = [line.split() for line in text("threads").splitlines()[1:]]
        self.assertEqual({"alidade"}, {thread[0] for thread in threads})
        self.assertIn(("FF", "50"), {(thread[1], thread[2]) for thread in threads})
        self.assertGreater(int(re.search(r"(\d+) kB", text("locked"))[1]), 0)

    def test_comes_back_when_it_is_killed_and_when_it_hangs(self):
        self.assertEqual("1", shown("killed")["NRestarts"])
        self.assertEqual("2", shown("hung")["NRestarts"])
        self.assertIn("Watchdog timeout", text("journal"))

    def test_goes_on_after_the_system_slept(self):
        self.assertEqual(shown("hung")["MainPID"], shown("slept")["MainPID"])
        self.assertEqual("2", shown("slept")["NRestarts"])
        self.assertRegex(shown("slept")["StatusText"], r"PT [1-9]")
        self.assertIn("mode", json.loads(text("asleep.json")))

    def test_stops_cleanly(self):
        service = shown("stopped")
        self.assertEqual(("inactive", "success", "0"),
                         (service["ActiveState"], service["Result"], service["ExecMainStatus"]))

    def test_a_wrong_configuration_is_said_and_not_tried_again(self):
        service = shown("refused")
        self.assertEqual(("failed", "2"), (service["ActiveState"], service["ExecMainStatus"]))
        self.assertEqual("0", service["NRestarts"])
        self.assertRegex(text("refused.journal"), r"vidoe.*video")


if __name__ == "__main__":
    judge(Service, boot())
