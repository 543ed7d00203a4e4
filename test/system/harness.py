"""Starts the virtual camera and `alidade` as real processes on real sockets, for the tests of this folder.

Everything waits for an event (a line, an exit, a connection) with one generous deadline; nothing sleeps for luck.
"""
import contextlib
import csv
import io
import json
import math
import os
import pathlib
import queue
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

ALIDADE = os.environ["ALIDADE"]
SIMULATE = os.environ["ALIDADE_SIMULATE"]
DEADLINE_S = 90  # for any one event: a sanitized build on a busy machine is slow

# Small: a sanitized camera takes its time to render. RTP's JPEG comes in blocks of 8 px.
IMAGE = {"width": 160, "height": 96, "rate_hz": 25}
FOCAL_LENGTH_PX = 2667.5  # the paper's field of view of 3.4 degrees
LINE_DELAY_US = -60.0
CLOCK_OFFSET_MS = -84.4
TELEMETRY_SIGMA_RAD = 5e-5


def free_port():
    with contextlib.closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Process:
    """A child whose output lines are gathered by threads, so that it never blocks on a full pipe."""

    def __init__(self, *arguments, stdin=False, **environment):
        self.arguments = [str(a) for a in arguments]
        self.child = subprocess.Popen(self.arguments, stdin=subprocess.PIPE if stdin else None, stdout=subprocess.PIPE,
                                      stderr=subprocess.PIPE, text=True, env={**os.environ, **environment})
        self.lines, self.errors = queue.Queue(), []
        self.threads = [threading.Thread(target=self._gather_output), threading.Thread(target=self._gather_errors)]
        for thread in self.threads:
            thread.start()

    def _gather_output(self):
        for line in self.child.stdout:
            self.lines.put(line.rstrip("\n"))
        self.lines.put(None)

    def _gather_errors(self):
        for line in self.child.stderr:
            self.errors.append(line.rstrip("\n"))

    def line(self):
        """The next line of stdout; None at its end."""
        try:
            return self.lines.get(timeout=DEADLINE_S)
        except queue.Empty:
            raise AssertionError(f"no line within {DEADLINE_S} s from {self.arguments}\n{self.error_text()}") from None

    def tell(self, line):
        """A line to its stdin, if that was asked for."""
        self.child.stdin.write(line + "\n")
        self.child.stdin.flush()

    def error_text(self):
        return "\n".join(self.errors)

    def end(self, sig=None):
        """Sends the signal, if any, waits for the end and returns (exit code, unread lines of stdout)."""
        if sig is not None and self.child.poll() is None:
            self.child.send_signal(sig)
        try:
            self.child.wait(DEADLINE_S)
        except subprocess.TimeoutExpired:
            self.child.kill()
            raise AssertionError(f"{self.arguments} did not end\n{self.error_text()}") from None
        for thread in self.threads:
            thread.join()
        self.child.stdout.close()
        self.child.stderr.close()
        return self.child.returncode, [line for line in list(self.lines.queue) if line is not None]


class Camera(Process):
    """The virtual camera, serving live. Ports may be given so that a second one can take a dead one's place;
    settings are sections of its configuration that take the place of those here."""

    def __init__(self, folder, rtsp_port=0, http_port=0, codec="mjpeg", user="", seed=1, settings=None):
        self.truth = pathlib.Path(folder, f"truth-{seed}")
        config = {
            "seed": seed, "truth_dir": str(self.truth), "image": IMAGE,
            "camera": {"focal_length_px": FOCAL_LENGTH_PX, "radial_distortion": 13.9, "line_delay_us": LINE_DELAY_US,
                       "clock_offset_ms": CLOCK_OFFSET_MS, "pan_axis_mrad": [12, 0],
                       "tilt_axis_mrad": [0, 14]},
            "path": {"type": "triple_cosine", "period_s": 10},
            "scene": {"procedural": [{"azimuth_deg": 0, "elevation_deg": 0, "width_deg": 16, "height_deg": 8}]},
            "telemetry": {"sigma_rad": TELEMETRY_SIGMA_RAD},
            "live": {"rtsp_port": rtsp_port, "http_port": http_port, "codec": codec},
            **(settings or {}),
        }
        environment = {}
        if user:
            config["live"].update(user=user, password_env="TEST_CAMERA_PASSWORD")
            environment["TEST_CAMERA_PASSWORD"] = "right horse"
        file = pathlib.Path(folder, f"camera-{seed}.yaml")
        file.write_text(json.dumps(config))  # JSON is YAML
        super().__init__(SIMULATE, "-c", file, **environment)
        words = (self.line() or "").split()
        if len(words) < 3 or words[0] != "ready":
            self.end(signal.SIGKILL)
            raise AssertionError(f"the virtual camera did not start: {words}\n{self.error_text()}")
        self.video_url, self.pan_tilt_url = words[1:3]
        self.others = dict(word.split("=", 1) for word in words[3:])  # mjpeg, onvif, head


class SystemTest(unittest.TestCase):
    """A folder of its own for each test, and every process ended whatever happens."""

    def setUp(self):
        self.folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) \
            if hasattr(self, "enterContext") else self._folder()
        self.processes = []
        self.addCleanup(self._kill_all)

    def _folder(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        return pathlib.Path(folder.name)

    def _kill_all(self):
        for process in self.processes:
            if process.child.poll() is None:
                process.child.kill()
                process.child.wait()
            for thread in process.threads:
                thread.join()
            for pipe in (process.child.stdin, process.child.stdout, process.child.stderr):
                if pipe is not None:
                    pipe.close()

    def camera(self, **options):
        camera = Camera(self.folder, **options)
        self.processes.append(camera)
        return camera

    def alidade(self, *arguments, **environment):
        process = Process(ALIDADE, *arguments, **environment)
        self.processes.append(process)
        return process

    def write_config(self, camera=None, video=None, pan_tilt=None, focal_length_px=FOCAL_LENGTH_PX, **sections):
        """Configuration of alidade for the given camera, with the truth as its calibration; None leaves a key out."""
        config = {
            "video": {"type": "rtsp", "url": camera.video_url if camera else "", **(video or {})},
            "pan_tilt": {"type": "vapix", "url": camera.pan_tilt_url if camera else "", "rate_hz": 50,
                         "angle_sigma_rad": TELEMETRY_SIGMA_RAD, **(pan_tilt or {})},
            "camera": {"focal_length_px": focal_length_px},
            "calibration": {"file": str(camera.truth / "truth.yaml"), "auto": False} if camera else {},
            "realtime": {"mode": "PT"}, "output": {"json": True}, **sections}
        for section in config.values():
            for key in [key for key, value in section.items() if value is None]:
                del section[key]
        file = self.folder / "alidade.yaml"
        file.write_text(json.dumps(config))
        return file

    def ground(self):
        """A plane.yaml: the camera 20 m above the ground looks down by 20 degrees at zero pan and tilt. And where it then looks."""
        pitch, height = math.radians(-20), 20
        names = ["heading", "pitch", "roll", "x", "y", "height"]
        values = dict(zip(names, (0, pitch, 0, 0, 0, height)))
        sigmas = dict(zip(names, (0, 1e-3, 1e-3, 0, 0, 0.05)))
        plane = {"format": 1, **{name: {"value": values[name], "sigma": sigmas[name]} for name in names},
                 "origin": {"latitude_deg": 48, "longitude_deg": 11, "height_m": 500},
                 "covariance": {"names": names, "matrix": [[sigmas[a] ** 2 * (a == b) for b in names] for a in names]}}
        file = self.folder / "plane.yaml"
        file.write_text(json.dumps(plane))
        return str(file), (0, height / math.tan(-pitch))


class Truth:
    """The path of truth.csv: angles at any time between its frames."""

    def __init__(self, folder):
        with open(folder / "truth.csv", newline="", encoding="utf-8") as file:
            # A camera that was killed may leave its last row unfinished.
            whole = file.read().rpartition("\n")[0]
        self.rows = [(float(r["time_s"]), float(r["pan_rad"]), float(r["tilt_rad"]))
                     for r in csv.DictReader(io.StringIO(whole))]

    def angles(self, time_s):
        """Linear between frames: at 25 frames a second its error is below 0.02 mrad on the path used here."""
        for (t0, *a0), (t1, *a1) in zip(self.rows, self.rows[1:]):
            if t0 <= time_s <= t1:
                x = (time_s - t0) / (t1 - t0)
                return [p + x * (q - p) for p, q in zip(a0, a1)]
        return None


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def wait_until(condition, what):
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"{what} did not happen within {DEADLINE_S} s")
        time.sleep(0.02)
