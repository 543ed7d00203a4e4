"""The edge executable of another processor under qemu-user beside this machine's own, on the same recording: the same
calibration to 1e-9, the same orientations to 0.001 px.

    agreement_test.py NATIVE SIMULATE WORK EMULATOR... ALIDADE

NATIVE and SIMULATE are this machine's alidade and alidade-simulate. Ends with 77 where they are not built.
"""
import json
import math
import pathlib
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from calibration_film import FILM, FOCAL_LENGTH_PX, sigmas_apart  # noqa: E402

SKIPPED = 77
NATIVE, SIMULATE, WORK = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[3])
EMULATED = sys.argv[4:]
PROGRAMS = {"native": [NATIVE], "emulated": EMULATED}


def run(*command):
    done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    if done.returncode != 0:
        raise AssertionError(f"{' '.join(str(part) for part in command)} ended with {done.returncode}\n{done.stderr[-4000:]}")
    return done.stdout


def differences(a, b, where=""):
    """Of all numbers of two structures: (relative difference, where); what is no number must be equal."""
    if isinstance(a, dict):
        if a.keys() != b.keys():
            raise AssertionError(f"{where}: {sorted(a)} and {sorted(b)}")
        for key in a:
            yield from differences(a[key], b[key], f"{where}.{key}")
    elif isinstance(a, list):
        if len(a) != len(b):
            raise AssertionError(f"{where}: {len(a)} and {len(b)} values")
        # Of a vector or a matrix, the largest element says what is little.
        scale = max((abs(x) for x in a if isinstance(x, (int, float))), default=0)
        for i, (x, y) in enumerate(zip(a, b)):
            if isinstance(x, float) and scale > 0:
                yield abs(x - y) / scale, f"{where}[{i}]"
            else:
                yield from differences(x, y, f"{where}[{i}]")
    elif isinstance(a, (int, float)) and not isinstance(a, bool):
        yield (abs(a - b) / max(abs(a), abs(b)) if a != b else 0), where
    elif a != b:
        raise AssertionError(f"{where}: {a!r} and {b!r}")


def angle_between(p, q):
    """rad, between two orientations [w, x, y, z]; exact for small ones."""
    vector = [p[0] * q[i] - q[0] * p[i] + c for i, c in zip(
        (1, 2, 3), (p[3] * q[2] - p[2] * q[3], p[1] * q[3] - p[3] * q[1], p[2] * q[1] - p[1] * q[2]))]
    return 2 * math.sqrt(sum(x * x for x in vector))


class OtherProcessor(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        WORK.mkdir(parents=True)
        (WORK / "camera.yaml").write_text(json.dumps(FILM))  # JSON is YAML
        cls.film = WORK / "film"
        run(SIMULATE, "-c", WORK / "camera.yaml", "-o", cls.film)
        # The points that one machine's tracker found, for both.
        cls.from_video = json.loads(run(NATIVE, "calibrate", cls.film, "-o", WORK / "from-video-native", "--json"))
        cls.tracked = WORK / "tracked"
        cls.tracked.mkdir()
        for file in cls.film.iterdir():
            if file.suffix != ".mkv":
                shutil.copy(file, cls.tracked)
        shutil.copy(WORK / "from-video-native/tracks.csv", cls.tracked)
        cls.calibration = WORK / "from-video-native/calibration.yaml"

    def replay(self, mode):
        """The records of each processor."""
        records = {}
        for name, program in PROGRAMS.items():
            out = run(*program, "replay", self.film, "--mode", mode, "--json", "--calibration", self.calibration,
                      "-o", WORK / f"{mode}-{name}")
            records[name] = [json.loads(line) for line in out.splitlines()]
        self.assertEqual(len(records["native"]), FILM["duration_s"] * FILM["image"]["rate_hz"])
        self.assertEqual(len(records["native"]), len(records["emulated"]))
        return list(zip(records["native"], records["emulated"]))

    def test_version_is_the_same(self):
        self.assertEqual(run(NATIVE, "--version"), run(*EMULATED, "--version"))

    def test_calibration_from_the_same_tracks_is_the_same(self):
        results = {name: json.loads(run(*program, "calibrate", self.tracked, "--json", "-o", WORK / f"tracks-{name}"))
                   for name, program in PROGRAMS.items()}
        for result in results.values():
            del result["files"]
        worst, where = max(differences(results["native"], results["emulated"]))
        print(f"measured: calibration from the same tracks: largest relative difference {worst:.1e}, of {where}")
        self.assertLess(worst, 1e-9, where)

    def test_orientations_by_telemetry_are_the_same(self):
        worst = max(angle_between(a["q_base_from_camera"], b["q_base_from_camera"]) for a, b in self.replay("PT"))
        print(f"measured: PT mode: largest difference {worst:.1e} rad")
        self.assertLess(worst, 1e-12)

    def test_orientations_by_landmarks_are_the_same(self):
        pairs = self.replay("OE")
        for a, b in pairs:
            self.assertEqual((a["frame"], a["mode"]), (b["frame"], b["mode"]))
        self.assertGreater(sum(a["mode"] == "OE" for a, _ in pairs), 0.8 * len(pairs))
        worst = max(FOCAL_LENGTH_PX * angle_between(a["q_base_from_camera"], b["q_base_from_camera"]) for a, b in pairs)
        same = sum(a["landmarks"] == b["landmarks"] for a, b in pairs)
        print(f"measured: OE mode: largest difference {worst:.1e} px; the same number of landmarks in {same} of {len(pairs)} frames")
        self.assertLess(worst, 1e-3)

    def test_calibration_from_video_is_the_same_within_its_sigma(self):
        emulated = json.loads(run(*EMULATED, "calibrate", self.film, "-o", WORK / "from-video-emulated", "--json"))
        for name, difference in sigmas_apart(self.from_video, emulated):
            print(f"measured: calibration from video: {name} differs by {difference:.1e} sigmas")
            # What differs is the rounding of tracked points: a thousandth of a pixel of a tenth.
            self.assertLess(difference, 0.1)


if __name__ == "__main__":
    if not (NATIVE.exists() and SIMULATE.exists()):
        print(f"SKIPPED: {NATIVE} or {SIMULATE} is missing: cmake --preset release && cmake --build --preset release "
              "--target alidade alidade-simulate")
        sys.exit(SKIPPED)
    unittest.main(argv=sys.argv[:1], verbosity=2)
