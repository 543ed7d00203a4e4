#!/usr/bin/env python3
"""What the manual (docs/manual) tells a beginner to type, typed: the tutorial of the virtual camera from its first line to its last, and
the how-to guides whose commands need nothing but what that tutorial leaves."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import unittest

from harness import ALIDADE, DEADLINE_S, SIMULATE, Process, SystemTest, free_port

MANUAL = pathlib.Path(__file__).resolve().parents[2] / "docs/manual"
TUTORIAL_CAMERA = MANUAL.parents[1] / "test/simulator/examples/tutorial_camera.yaml"
sys.path.insert(0, str(MANUAL.parents[1] / "test/house"))
sys.dont_write_bytecode = True
from manual_test import blocks  # noqa: E402: after the line above

RENDERING_S = 900  # the virtual camera draws its pictures before it begins
COMMAND_S = 900


class Tutorial(SystemTest):
    def setUp(self):
        super().setUp()
        self.ports = {port: str(free_port()) for port in ("8554", "8081", "8080")}
        self.path = os.pathsep.join([str(pathlib.Path(ALIDADE).parent), str(pathlib.Path(SIMULATE).parent), os.environ["PATH"]])

    def with_free_ports(self, text):
        for port, free in self.ports.items():
            text = re.sub(rf"\b{port}\b", free, text)
        return text

    def blocks_of(self, page):
        for language, kind, content in blocks((MANUAL / page).read_text(encoding="utf-8")):
            yield language, kind, self.with_free_ports(content)

    def shell(self, line, codes=(0,)):
        done = subprocess.run(["bash", "-c", line], cwd=self.folder, env={**os.environ, "PATH": self.path}, capture_output=True, text=True,
                              timeout=COMMAND_S, check=False)
        self.assertIn(done.returncode, codes, f"{line}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    def lines_of(self, page):
        """The commands of a page that are not meant for elsewhere."""
        return [line for language, kind, content in self.blocks_of(page) if language == "sh" and kind != "elsewhere"
                for line in content.strip().splitlines()]

    def start_camera(self):
        # As --example tutorial does, but for the ports.
        text = self.with_free_ports(TUTORIAL_CAMERA.read_text(encoding="utf-8"))
        (self.folder / "virtual-camera.yaml").write_text(text, encoding="utf-8")
        camera = Process(SIMULATE, "-c", self.folder / "virtual-camera.yaml")
        self.processes.append(camera)
        ready = camera.lines.get(timeout=RENDERING_S)
        self.assertTrue(ready and ready.startswith("ready "), camera.errors)

    def in_folder(self, *arguments):
        """alidade in the folder, as a process that goes on."""
        process = Process("env", "-C", self.folder, ALIDADE, *arguments)
        self.processes.append(process)
        return process

    def run_until_oe(self, line):
        run = self.in_folder(*line.split(">")[0].split()[1:])
        for _ in range(25 * 300):
            record = run.lines.get(timeout=DEADLINE_S)
            self.assertIsNotNone(record, run.errors)
            if json.loads(record)["mode"] == "OE":
                return run
        raise AssertionError("not in OE mode within 300 s: " + "\n".join(run.errors))

    def ask_while_it_runs(self):
        """Python, and the API: how-to/python.md, reference/http-api.md."""
        shutil.copy(MANUAL / "files/alidade_stream.py", self.folder)
        programs = [content for language, kind, content in self.blocks_of("how-to/python.md") if language == "python" and kind == "run"]
        self.assertTrue(programs)
        for program in programs:
            done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=DEADLINE_S, check=False)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(len(done.stdout.split()), 3, done.stdout)
        lines = self.lines_of("how-to/python.md")
        self.assertTrue(lines)
        for line in lines:
            self.assertEqual(len(self.shell(line).splitlines()), 5)
        if shutil.which("curl"):
            for line in self.lines_of("reference/http-api.md"):
                self.assertTrue(self.shell(line, codes=(0, 28)))  # 28: the stream was cut off when its time was over

    def test_of_the_virtual_camera_leads_where_it_says(self):
        said, configured = [], 0
        for language, kind, content in self.blocks_of("tutorial/virtual-camera.md"):
            if language == "yaml":
                (self.folder / "camera.yaml").write_text(content, encoding="utf-8")
                configured += 1
            for line in content.strip().splitlines() if language == "sh" and kind != "elsewhere" else ():
                if line.startswith("alidade-simulate "):
                    self.start_camera()
                elif line.startswith("alidade run "):
                    run = self.run_until_oe(line)
                    self.ask_while_it_runs()
                    run.child.send_signal(signal.SIGINT)
                    self.assertEqual(run.child.wait(timeout=DEADLINE_S), 0)
                else:
                    said.append(self.shell(line))
        self.assertEqual(configured, 1)
        self.assertIn("motion       pan sign correct, tilt sign correct", said[0])
        self.assertTrue(said[-1].startswith("sigmas hold"), said[-1])
        self.assertTrue((self.folder / "minute/alidade/verification.html").is_file())
        self.follow_how_to_guides()

    def follow_how_to_guides(self):
        """With the recording and the calibration that the tutorial has left."""
        os.symlink(self.folder / "minute", self.folder / "recording")
        for name in ("recording-1", "recording-2", "recording-3"):
            os.symlink(self.folder / "minute", self.folder / name)
        shutil.copy(self.folder / "calibration.zoom-1.yaml", self.folder / "calibration.yaml")
        for language, kind, content in self.blocks_of("how-to/ground.md"):
            if language == "yaml" and kind == "plane":
                (self.folder / "yard.yaml").write_text(content, encoding="utf-8")
        typed = 0
        for page, wanted in (("how-to/near-things.md", r"alidade calibrate "), ("how-to/ground.md", r"alidade plane "),
                             ("how-to/bench-lens.md", r"alidade calibrate-shutter .*--print"), ("how-to/scene-map.md", r"alidade map "),
                             ("how-to/scene-map.md", r"alidade localize ")):
            for line in self.lines_of(page):
                if re.match(wanted, line):
                    if "localize" in line:
                        shutil.copy(next((self.folder / "map").rglob("*.jpg")), self.folder / "picture.jpg")
                    self.shell(line)
                    typed += 1
        self.assertGreater(typed, 7)
        self.assertTrue((self.folder / "plane.yaml").is_file())
        self.assertTrue((self.folder / "map/panorama.png").is_file())

    def of_the_virtual_camera(self, configuration, ready):
        """A configuration of the page for the camera that the line `ready` names, with pictures of 480x272."""
        video, pan_tilt = ready.split()[1:3]
        for pattern, text in ((r'url: "rtsp:[^"]*"', f'url: "{video}"'), (r'url: "http:[^"]*"', f'url: "{pan_tilt}"'),
                              ("width: 1280, height: 720", "width: 480, height: 272"), ("wide: 1200, tele: 24000", "wide: 450, tele: 9000")):
            configuration, count = re.subn(pattern, text, configuration)
            self.assertEqual(count, 1, pattern)
        return configuration

    def follow_a_zoom(self, line):
        """Over a whole round of five zooms: the mode stays OE, and the curve in use."""
        run = self.in_folder(*line.split()[1:], "--json")
        records = []
        while len(records) < 25 * 75:
            record = run.lines.get(timeout=DEADLINE_S)
            self.assertIsNotNone(record, run.errors)
            records.append(json.loads(record))
            if records[-1]["mode"] == "none" and not any(one["mode"] == "OE" for one in records):
                records.clear()  # not begun
        run.child.send_signal(signal.SIGINT)
        self.assertEqual(run.child.wait(timeout=DEADLINE_S), 0)
        log = "\n".join(run.errors)
        self.assertIn("is localized", log)
        self.assertNotIn("set aside", log)
        readings = {one["zoom"] for one in records}
        self.assertTrue({1, 3906, 6551, 8522, 9999} <= readings, readings)
        others = [one["status"] for one in records if one["mode"] != "OE"]
        self.assertLess(len(others), 0.1 * len(records), sorted(set(others)))
        self.assertNotIn("no calibration for this zoom", others)

    def test_of_a_zooming_camera_leads_where_it_says(self):
        """With the virtual camera wherever the page offers it."""
        ran = []
        for language, _, content in self.blocks_of("tutorial/zooming-camera.md"):
            if language == "yaml":
                configuration = content
            for line in content.strip().splitlines() if language == "sh" else ():
                if line.startswith("alidade-simulate ") and " -o " not in line:
                    camera = Process("env", "-C", self.folder, SIMULATE, *line.split()[1:])
                    self.processes.append(camera)
                    ready = camera.lines.get(timeout=RENDERING_S)
                    self.assertTrue(ready and ready.startswith("ready "), camera.errors)
                    (self.folder / "camera.yaml").write_text(self.of_the_virtual_camera(configuration, ready), encoding="utf-8")
                elif line.startswith("alidade run "):
                    self.follow_a_zoom(line)
                elif not line.startswith("alidade record "):  # the virtual camera has shown it all
                    self.shell(line.replace(" zooms scene ", " zooms "))
                ran.append(line.split()[:2])
        self.assertEqual([words for words in ran if words[0].startswith("alidade")].count(["alidade", "map"]), 3)
        self.assertIn(["alidade", "run"], ran)


if __name__ == "__main__":
    unittest.main()
