#!/usr/bin/env python3
"""`alidade run` with a scene map: a telemetry zero that has moved since the map was made is found, said and corrected; a camera without
telemetry runs on the map alone."""
import json
import signal
import subprocess
import unittest
import urllib.request

from http_test import check
from harness import ALIDADE, SIMULATE, SystemTest, Truth, rms, wait_until

ZERO_RAD = 5e-3  # what telemetry's pan lacks
MRAD_DEG = 0.0572957795
# A pixel is 1.25 mrad.
CAMERA = {
    "camera": {"focal_length_px": 800, "line_delay_us": 20, "clock_offset_ms": 0},
    "scene": {"procedural": [{"width_deg": 360, "height_deg": 180, "projection": "equirectangular"}]},
    "telemetry": {"sigma_rad": 2e-4, "rate_hz": 20},
}


class WithSceneMap(SystemTest):
    def map_state(self, run):
        """What /api/v1/map says, which is as it is described."""
        address = run.error_text().partition("HTTP: listening on ")[2].split()[0]
        with urllib.request.urlopen(address + "api/v1/map", timeout=30) as answer:
            state = json.load(answer)
        check(state, {"$ref": "#/components/schemas/SceneMap"})
        with urllib.request.urlopen(address + "api/v1/map/views", timeout=30) as answer:
            views = json.load(answer)
        check(views, {"$ref": "#/components/schemas/SceneViews"})
        self.assertEqual(len(views["keyframes"]), state["keyframes"])
        self.assertTrue(all(len(one["border_rad"]) == 16 for one in views["keyframes"]))
        return state

    def build_map(self):
        film = self.folder / "film.yaml"
        film.write_text(json.dumps({
            "seed": 1, "duration_s": 24, "image": {"width": 640, "height": 360, "rate_hz": 1},
            "path": {"type": "triple_cosine", "amplitude": 0.35, "period_s": 24}, "recording": {"images": "png"},
            **CAMERA}))
        subprocess.run([SIMULATE, "-c", film, "-o", self.folder / "film"], check=True, capture_output=True, timeout=300)
        scene_map = self.folder / "scene.map"
        built = subprocess.run([ALIDADE, "map", "build", self.folder / "film", "-o", scene_map, "--calibration",
                                self.folder / "film" / "truth.yaml"], capture_output=True, text=True, timeout=300)
        self.assertEqual(built.returncode, 0, built.stderr)
        return scene_map


class MovedZero(WithSceneMap):
    def run_with(self, camera, scene_map, records_after, **scene):
        """Records until so many were tied to the map, and what /api/v1/map says then."""
        config = self.write_config(
            camera, pan_tilt={"pan_zero_deg": 5 * MRAD_DEG, "angle_sigma_rad": 2e-4, "rate_hz": 20},
            realtime={"mode": "OE"}, scene_map={"file": str(scene_map), "zero_sigma_rad": 3e-4, **scene},
            output={"json": True, "http": "127.0.0.1:0"})
        run = self.alidade("run", "-c", config)
        records, tied = [], 0
        said = lambda: "has moved" in run.error_text()
        while tied < records_after or not said():
            line = run.line()
            self.assertIsNotNone(line, run.error_text())
            records.append(json.loads(line))
            tied += records[-1]["localized"] is not None or records_after == 0
        state = self.map_state(run)
        code, _ = run.end(signal.SIGINT)
        self.assertEqual(code, 0, run.error_text())
        return run, records, state

    def pan_errors(self, camera, records):
        truth = Truth(camera.truth)
        errors = []
        for record in records:
            angles = truth.angles(record["time_s"]) if record["pan_rad"] is not None else None
            if angles is not None:
                errors.append(record["pan_rad"] - angles[0])
        self.assertGreater(len(errors), len(records) // 2)
        return errors

    def test_is_found_and_said_and_corrected_as_configured(self):
        scene_map = self.build_map()
        camera = self.camera(settings={
            "image": {"width": 640, "height": 360, "rate_hz": 5},
            "path": {"type": "triple_cosine", "amplitude": 0.05, "period_s": 6}, **CAMERA})
        run, records, state = self.run_with(camera, scene_map, 24)
        reported, untied, of_report = self.run_with(camera, scene_map, 0, on_moved_base="report")
        camera.end(signal.SIGTERM)

        self.assertIn("corrected: directions are the map's", run.error_text())
        self.assertEqual(state["movements"], 1)
        self.assertFalse(state["uncorrected"])
        self.assertIsNone(state["upkeep"])
        self.assertGreaterEqual(state["pictures"]["found"], 2)
        # Two thirds of a pixel: the map's own base rests on telemetry that errs by 0.2 mrad.
        self.assertAlmostEqual(state["moved"]["pan_rad"], ZERO_RAD, delta=0.8e-3)
        self.assertAlmostEqual(state["moved"]["tilt_rad"], 0, delta=0.8e-3)
        before = [r for r in records if r["localized"] is None and r["mode"] != "none"]
        after = [r for r in records if r["localized"] is not None]
        # By arrival pictures are some milliseconds late: the camera turns slowly.
        self.assertAlmostEqual(rms(self.pan_errors(camera, before)), ZERO_RAD, delta=0.8e-3)
        self.assertLess(rms(self.pan_errors(camera, after)), 0.8e-3)
        self.assertLess(after[-1]["localized"]["sigma_rad"], 1e-3)

        self.assertIn("not corrected", reported.error_text())
        self.assertTrue(of_report["uncorrected"])
        self.assertAlmostEqual(of_report["offset"]["pan_rad"], ZERO_RAD, delta=0.8e-3)
        self.assertFalse([r for r in untied if r["localized"] is not None])

    def test_what_cannot_be_used_is_said_and_records_come_without_it(self):
        camera = self.camera()
        broken = self.folder / "broken.map"
        broken.write_text("this is no map")
        for file, words in ((broken, "broken.map"), (self.folder / "none.map", "none.map")):
            config = self.write_config(camera, realtime={"mode": "OE"}, scene_map={"file": str(file)})
            run = self.alidade("run", "-c", config)
            wait_until(lambda: "run goes on without it" in run.error_text(), "the error")
            self.assertIn(words, run.error_text())
            while json.loads(run.line())["mode"] == "none":
                pass
            code, _ = run.end(signal.SIGINT)
            self.assertEqual(code, 0, run.error_text())


class NoTelemetry(WithSceneMap):
    NONE = {"type": "none", "url": None, "rate_hz": None, "angle_sigma_rad": None}

    def test_directions_are_the_maps_from_the_first_picture_that_is_found(self):
        scene_map = self.build_map()
        camera = self.camera(settings={
            "image": {"width": 640, "height": 360, "rate_hz": 5}, "duration_s": 60,
            "sensor": {"covered": [{"from_s": 20, "to_s": 24}]},
            "path": {"type": "triple_cosine", "amplitude": 0.05, "period_s": 6}, **CAMERA})
        config = self.write_config(
            camera, pan_tilt=self.NONE, realtime={"mode": "OE"}, scene_map={"file": str(scene_map), "interval_s": 3},
            output={"json": True})
        run = self.alidade("run", "-c", config)
        records, held, gaps = [], 0, 0
        # Found, covered, and found again.
        while gaps < 1 or held < 20:
            line = run.line()
            self.assertIsNotNone(line, run.error_text())
            records.append(json.loads(line))
            was_held, is_held = held > 0, records[-1]["mode"] == "OE"
            if was_held and not is_held:
                gaps += held >= 5
                held = 0
            held += is_held
            self.assertLess(len(records), 600, run.error_text())
        camera.end(signal.SIGTERM)
        run.end(signal.SIGINT)
        truth = Truth(camera.truth)
        self.assertEqual({r["mode"] for r in records}, {"none", "OE"})
        errors, sigmas = [], []
        for record in records:
            if record["mode"] == "none":
                self.assertIn(record["status"], ("not localized", "picture time unknown"))
                continue
            angles = truth.angles(record["time_s"])
            if angles is None:
                continue
            error = max(abs(record["pan_rad"] - angles[0]), abs(record["tilt_rad"] - angles[1]))
            errors.append(error)
            # The map's own base rests on telemetry that errs by 0.2 mrad; by arrival pictures are some milliseconds late.
            sigmas.append(error / (max(record["orientation_sigma_rad"]) + 0.3e-3))
        print(f"NoTelemetry: {len(records)} records, {len(errors)} in OE mode, rms {1e3 * rms(errors):.2f} mrad, "
              f"largest {1e3 * max(errors):.2f} mrad, {max(sigmas):.1f} sigmas")
        self.assertGreater(len(errors), 20)
        self.assertLess(rms(errors), 0.8e-3)
        self.assertLess(max(sigmas), 5)

    def check(self, config, code):
        """Text, JSON and errors of `alidade check`."""
        text, as_json = (subprocess.run([ALIDADE, "check", "--duration", "2", "-c", config, *more], capture_output=True,
                                        text=True, timeout=120) for more in ([], ["--json"]))
        self.assertEqual((text.returncode, as_json.returncode), (code, code), text.stderr + as_json.stderr)
        return text.stdout, json.loads(as_json.stdout), text.stderr

    def test_check_tells_where_the_last_picture_looks_by_the_map(self):
        scene_map = self.build_map()
        # Rests where the map has been.
        camera = self.camera(settings={
            "image": {"width": 640, "height": 360, "rate_hz": 5},
            "path": {"type": "triple_cosine", "amplitude": 0, "period_s": 6}, **CAMERA})
        named = {"realtime": {"mode": "OE"}, "pan_tilt": self.NONE, "scene_map": {"file": str(scene_map)}}
        text, report, _ = self.check(self.write_config(camera, **named), 0)
        self.assertIn("none: no telemetry, by configuration", text)
        self.assertIn("looks at     pan ", text)
        self.assertIsNone(report["pan_tilt"])
        self.assertIsNone(report["scene_map"]["error"])
        last = report["scene_map"]["last"]
        self.assertEqual(last["status"], "ok")
        # The map's base rests on telemetry that errs by 0.2 mrad.
        self.assertAlmostEqual(last["pan_rad"], 0, delta=0.8e-3)
        self.assertAlmostEqual(last["tilt_rad"], 0, delta=0.8e-3)
        self.assertLess(max(last["orientation_sigma_rad"]), 1e-3)

        broken = self.folder / "broken.map"
        broken.write_text("this is no map")
        _, report, errors = self.check(self.write_config(camera, **{**named, "scene_map": {"file": str(broken)}}), 1)
        self.assertIn("broken.map", report["scene_map"]["error"])
        self.assertIsNone(report["scene_map"]["last"])
        self.assertEqual(errors.count("alidade: scene map: "), 1)
        camera.end(signal.SIGTERM)

        elsewhere = self.camera(settings={
            "image": {"width": 640, "height": 360, "rate_hz": 5}, "seed": 77,
            "path": {"type": "triple_cosine", "amplitude": 0, "period_s": 6}, **CAMERA})
        text, report, errors = self.check(self.write_config(elsewhere, **named), 1)
        self.assertIn("is not localized: not in the map", text)
        self.assertEqual(report["scene_map"]["last"]["status"], "not in the map")
        self.assertIn("shows nothing that is in the map", errors)
        elsewhere.end(signal.SIGTERM)

    def test_a_map_that_is_kept_up_outlives_a_kill(self):
        scene_map = self.build_map()
        before = scene_map.read_bytes()
        camera = self.camera(settings={
            "image": {"width": 640, "height": 360, "rate_hz": 5},
            "path": {"type": "triple_cosine", "amplitude": 0.05, "period_s": 6}, **CAMERA})
        config = self.write_config(
            camera, pan_tilt=self.NONE, realtime={"mode": "OE"}, output={"json": True, "http": "127.0.0.1:0"},
            scene_map={"file": str(scene_map), "interval_s": 0.5, "update": True})
        for held_for in (8, 17, 29):
            run = self.alidade("run", "-c", config)
            held = 0
            while held < held_for:
                line = run.line()
                self.assertIsNotNone(line, run.error_text())
                held += json.loads(line)["mode"] == "OE"
            upkeep = self.map_state(run)["upkeep"]
            self.assertGreaterEqual(upkeep["updated"], upkeep["updates"])
            self.assertGreaterEqual(upkeep["updates"], 1)
            self.assertFalse(upkeep["stopped"])
            run.end(signal.SIGKILL)
            self.assertNotIn("updated any more", run.error_text())
            checked = subprocess.run([ALIDADE, "map", "check", scene_map], capture_output=True, text=True, timeout=60)
            self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
        camera.end(signal.SIGTERM)
        self.assertNotEqual(scene_map.read_bytes(), before)

    def test_what_it_cannot_do_without_is_an_error_in_one_line(self):
        camera = self.camera()
        config = self.write_config(camera, pan_tilt=self.NONE, realtime={"mode": "OE"})
        run = self.alidade("run", "-c", config)
        code, _ = run.end()
        self.assertEqual(code, 2)
        self.assertIn("no scene map shows where the camera looks", run.error_text())
        config = self.write_config(camera, pan_tilt=self.NONE, realtime={"mode": "OE"},
                                   scene_map={"file": str(self.folder / "none.map")})
        run = self.alidade("run", "-c", config)
        code, _ = run.end()
        self.assertEqual(code, 2)
        self.assertIn("with pan_tilt.type none a scene map is needed", run.error_text())


if __name__ == "__main__":
    unittest.main()
