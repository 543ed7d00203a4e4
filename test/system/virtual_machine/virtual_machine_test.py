"""Cameras of the kernel in a virtual machine, and `alidade` with them.

    virtual_machine_test.py amd64|arm64 short|long BUILD_FOLDER

Makes the machine if need be, boots it once, and tests what its script left. Machines and what they left stay in
build/virtual_machine of the source folder. Ends with 77 where the machine cannot be had.
"""
import csv
import json
import math
import pathlib
import shutil
import statistics
import subprocess
import sys
import unittest

from machine import CALIBRATION, HERE, MACHINES, TOP, judge, make, run

sys.path.insert(0, str(HERE.parent))
from calibration_film import FILM, sigmas_apart  # noqa: E402

WIDTH, HEIGHT = 320, 180
PROGRAMS = ("edge_app/alidade", "test/system/virtual_machine/v4l2_camera_test",
            "test/system/virtual_machine/loopback_camera", "test/system/virtual_machine/camera_control",
            "test/system/virtual_machine/simulated_head")

# A thousand lives of each format take minutes.
SHORT = "*-*Thousand*:V4l2Throughput*:V4l2/*Uyvy:V4l2/*Nv12"
SECONDS = {"short": 3, "long": 20}
DEADLINE_S = {"short": 500, "long": 3000}

ARCHITECTURE, LENGTH, BUILD = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3]).resolve()
WORK = MACHINES / f"{ARCHITECTURE}-{LENGTH}"
ALIDADE = BUILD / "edge_app/alidade"
SIMULATE = BUILD / "test/simulator/alidade-simulate"

# The same camera with larger pictures.
FULL_FILM = {**FILM, "duration_s": 4, "image": {"width": 1920, "height": 1080, "rate_hz": 10},
             "camera": {"focal_length_px": 5400, "line_delay_us": 15}}
MOST_RESIDENT_MB = 80


def config(video, **sections):
    """JSON is YAML."""
    return json.dumps({"video": {"type": "v4l2", **video},
                       "pan_tilt": {"type": "pelco_d", "device": "/run/head", "angle_quantum_rad": 1.7e-4},
                       "camera": {"focal_length_px": 1000}, **sections})


def boot():
    """The machine's console, after it has run its script."""
    machine = make(ARCHITECTURE)
    programs, system = (BUILD, "/")
    if ARCHITECTURE != "amd64":
        programs, system = cross_build()
    shutil.rmtree(WORK, ignore_errors=True)
    (WORK / "bin").mkdir(parents=True)
    for program in PROGRAMS:
        shutil.copy(programs / program, WORK / "bin")
    shutil.copy(HERE / "script", WORK)
    (WORK / "settings").write_text(
        f"tests='{SHORT if LENGTH == 'short' else '*'}'\nseconds={SECONDS[LENGTH]}\n")
    (WORK / "raw.yaml").write_text(
        config({"device": "/dev/video10", "format": "GREY", "width": WIDTH, "height": HEIGHT, "rate_hz": 60}))
    (WORK / "run.yaml").write_text(
        config({"device": "/dev/video10", "format": "GREY", "width": WIDTH, "height": HEIGHT, "rate_hz": 15},
               realtime={"mode": "OE"}))
    if LENGTH == "long":
        film("film", FILM)
        film("full", FULL_FILM)
        recording = {"type": "recording", "directory": "full"}
        (WORK / "memory.yaml").write_text(json.dumps({
            "video": recording, "pan_tilt": recording, "realtime": {"mode": "OE"},
            "calibration": {"file": "full/truth.yaml", "auto": False}}))
    (WORK / "mjpg.yaml").write_text(config({"device": "/dev/video14", "format": "MJPG"}))
    return run(HERE / "run-machine", ARCHITECTURE, machine, system, WORK, DEADLINE_S[LENGTH]).stdout


def cross_build():
    """Cross-builds the programs; their folder, and the system that they run in."""
    system = TOP / "build/sysroot-arm64"
    build = TOP / "build/arm64"
    for command in ((TOP / "toolchains/make-sysroot", "arm64"),
                    ("cmake", "-S", TOP, "--preset", "arm64"),
                    ("cmake", "--build", build, "--target", "virtual_machine_programs")):
        done = run(*command)
        if done.returncode != 0:
            sys.exit(f"{command} failed:\n{done.stdout[-5000:]}")
    return build, system


def film(name, camera):
    (WORK / f"{name}.camera.yaml").write_text(json.dumps(camera))
    made = run(SIMULATE, "-c", WORK / f"{name}.camera.yaml", "-o", WORK / name)
    if made.returncode != 0:
        sys.exit(f"no film {name}:\n{made.stdout}")


def text(name):
    file = WORK / name
    return file.read_text(encoding="utf-8", errors="replace") if file.exists() else ""


def frames_of(recording):
    with open(WORK / recording / "frames.csv", newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


class VirtualMachine(unittest.TestCase):
    def setUp(self):
        if not (WORK / "exit").exists():
            self.fail("the machine did not come to its end; its console is above")

    def step(self, name, exit_code=0):
        """Output and errors of a step that ended so."""
        self.assertEqual(text(f"{name}.exit").strip(), str(exit_code),
                         text(f"{name}.out")[-8000:] + text(f"{name}.err")[-4000:])
        return text(f"{name}.out"), text(f"{name}.err")

    def check_recording(self, name, height, rate_hz, raw):
        self.step(f"record_{name}")
        rows = frames_of(name)
        self.assertGreater(len(rows), 10)
        numbers = [int(row["frame"]) for row in rows]
        self.assertEqual(numbers, list(range(len(rows))))
        times = [float(row["receive_time_s"]) for row in rows]
        counts = [int(row["sequence"]) for row in rows]
        self.assertEqual(times, sorted(times))
        self.assertEqual(counts, sorted(set(counts)))
        if raw:  # the driver's own stamps
            self.assertAlmostEqual((times[-1] - times[0]) / (counts[-1] - counts[0]), 1 / rate_hz, delta=2e-3)
        # A loopback begins with an old buffer.
        print(f"measured: record {name}: {len(rows)} frames in {times[-1] - times[0]:.2f} s, "
              f"{counts[-1] - counts[1] + 2 - len(rows)} lost")
        # Every picture can be read again, here outside.
        calibration = WORK / name / "calibration.yaml"
        calibration.write_text(CALIBRATION % (WIDTH, height))
        done = subprocess.run([ALIDADE, "replay", WORK / name, "--mode", "OE", "-o", WORK / name / "replayed",
                               "--calibration", calibration],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn(f"{len(rows)} frames", done.stderr)
        with open(WORK / name / "replayed/orientation.csv", newline="", encoding="utf-8") as file:
            records = list(csv.DictReader(file))
        self.assertEqual(len(records), len(rows))
        self.assertNotIn("no usable picture", {record["status"] for record in records})

    def test_cameras(self):
        output = text("cameras.out")
        for line in output.splitlines():
            if line.startswith(("measured:", "[==========]", "[  PASSED  ]")):
                print(line)
        self.step("cameras")

    def test_check_tells_what_the_camera_sends(self):
        # The driver's picture does not turn with the head, which is what check says.
        output, errors = self.step("check", exit_code=1)
        self.assertIn("the picture does not move, although the head turned", errors)
        self.assertRegex(output, rf"video +/dev/video10: {WIDTH}x{HEIGHT} px .*sequence numbers")
        self.assertRegex(output, r"pan/tilt +/run/head: pan ")

    def test_raw_pictures_are_stored_and_read_again(self):
        self.check_recording("raw", HEIGHT, 60, raw=True)

    def test_compressed_pictures_are_stored_and_read_again(self):
        self.check_recording("mjpg", 240, 25, raw=False)

    def test_run_answers_each_frame_and_survives_an_unplugged_camera(self):
        output, errors = self.step("run")
        records = [json.loads(line) for line in output.splitlines()]
        lost = [i for i, record in enumerate(records) if record["status"] == "video lost"]
        self.assertTrue(lost, errors[-3000:])
        self.assertIn("connected again", errors)
        before = [record for record in records[:lost[0]] if record["frame"] is not None]
        after = [record for record in records[lost[-1] + 1:] if record["frame"] is not None]
        self.assertGreaterEqual(len(before), 20)
        self.assertGreaterEqual(len(after), 20)
        frames = [record["frame"] for record in before + after]
        self.assertEqual(frames, list(range(len(frames))))
        answered = [record for record in before + after if record["mode"] != "none"]
        self.assertGreater(len(answered), 0.8 * len(frames))
        # The head swings as head_main.cpp has it, at up to 20 degrees a second; its link is late by milliseconds.
        errors_deg = [abs(math.degrees(record["pan_rad"]) - 20 * math.sin(record["time_s"])) for record in answered]
        self.assertLess(statistics.median(errors_deg), 2)
        print(f"measured: run: {len(frames)} frames, {len(answered)} answered, median error of pan "
              f"{statistics.median(errors_deg):.3f} deg, " + next(line for line in errors.splitlines() if "latency" in line))

    def test_full_hd_in_oe_mode_takes_little_memory(self):
        if LENGTH != "long":
            self.skipTest("in long runs only")
        output, errors = self.step("memory")
        records = [json.loads(line) for line in output.splitlines()]
        self.assertGreater(sum(record["mode"] == "OE" for record in records), 20, errors[-2000:])
        status = dict(line.split(":") for line in text("memory.status").splitlines())
        kb = {name: int(value.split()[0]) for name, value in status.items()}
        print("measured: memory at 1920x1080 in OE mode: " + ", ".join(f"{name} {n / 1024:.1f} MiB" for name, n in kb.items()))
        self.assertLess(kb["VmHWM"] * 1024, MOST_RESIDENT_MB * 1e6)

    def test_calibrates_as_this_machine_does(self):
        if LENGTH != "long":
            self.skipTest("in long runs only")
        output, _ = self.step("calibrate")
        done = subprocess.run([ALIDADE, "calibrate", WORK / "film", "-o", WORK / "calibrated_here", "--json"],
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        for name, difference in sigmas_apart(json.loads(done.stdout), json.loads(output)):
            print(f"measured: calibrate: {name} differs by {difference:.1e} sigmas from this machine's")
            self.assertLess(difference, 0.1)


if __name__ == "__main__":
    judge(VirtualMachine, boot())
