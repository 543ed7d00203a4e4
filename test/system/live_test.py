#!/usr/bin/env python3
"""The edge executable against the virtual camera: real processes, real RTSP, real HTTP."""
import json
import pathlib
import signal
import time
import unittest

from harness import (CLOCK_OFFSET_MS, FOCAL_LENGTH_PX, IMAGE, LINE_DELAY_US, Process, SIMULATE, SystemTest,
                     TELEMETRY_SIGMA_RAD, Truth, free_port, rms, wait_until)

FIELDS = {"frame", "time_s", "receive_time_s", "mode", "calibrated", "pan_rad", "tilt_rad", "pan_rate_rad_s",
          "tilt_rate_rad_s", "pan_acceleration_rad_s2", "tilt_acceleration_rad_s2", "q_base_from_camera", "orientation_sigma_rad", "landmarks", "residual_px", "line_delay_s",
          "focal_length_px", "aspect", "radial_distortion", "latency_s"}


class Run(SystemTest):
    def records(self, process, count, keep=lambda record: record["mode"] == "PT"):
        """The next `count` records that are kept."""
        kept = []
        while len(kept) < count:
            line = process.line()
            self.assertIsNotNone(line, f"ended after {len(kept)} records\n{process.error_text()}")
            record = json.loads(line)
            if keep(record):
                kept.append(record)
        return kept

    def assert_angles_are_true(self, records, camera):
        """Angles agree with the truth as the records' own sigmas say."""
        camera.end(signal.SIGTERM)
        truth = Truth(camera.truth)
        offset = CLOCK_OFFSET_MS * 1e-3
        errors, speeds = [], []
        for record in records:
            angles = truth.angles(record["time_s"] + offset)
            if angles is None:
                continue
            errors += [record["pan_rad"] - angles[0], record["tilt_rad"] - angles[1]]
            speeds += [record["pan_rate_rad_s"], record["tilt_rate_rad_s"]]
        self.assertGreaterEqual(len(errors), len(records), "hardly any record matches a true frame")
        # Packets need time on loopback, and a sanitized build on a busy machine may need tens of milliseconds more;
        # the answers must at least be nearer to the truth than to a forgotten clock offset.
        self.assertLess(rms(errors), 2 * TELEMETRY_SIGMA_RAD + 0.5 * abs(offset) * rms(speeds))

    def check_run(self, video=None, links=lambda camera: ({}, {}), **options):
        camera = self.camera(**options)
        other_video, other_pan_tilt = links(camera)
        user = options.get("user", "")
        login = {"user": user, "password_env": "TEST_PASSWORD"} if user else {}
        config = self.write_config(camera, video={**login, **(video or {}), **other_video},
                                   pan_tilt={**login, **other_pan_tilt})
        run = self.alidade("run", "-c", config, TEST_PASSWORD="right horse")
        records = self.records(run, 60)
        code, _ = run.end(signal.SIGINT)
        self.assertEqual(code, 0, run.error_text())
        for record in records:
            self.assertLessEqual(FIELDS, record.keys())
            self.assertTrue(record["calibrated"])
            self.assertAlmostEqual(record["line_delay_s"], LINE_DELAY_US * 1e-6, places=12)
            self.assertAlmostEqual(record["focal_length_px"], FOCAL_LENGTH_PX)
        frames = [record["frame"] for record in records]
        self.assertEqual(frames, sorted(set(frames)))
        self.assert_angles_are_true(records, camera)
        self.assertNotIn("right horse", run.error_text())

    def test_mjpeg_over_tcp(self):
        self.check_run()

    def test_h264_over_udp(self):
        self.check_run(codec="h264", video={"transport": "udp"})

    def test_h265_over_tcp(self):
        self.check_run(codec="h265")

    def test_with_digest_login(self):
        self.check_run(user="viewer")

    def test_mjpeg_over_http_and_a_head_on_a_serial_line(self):
        def links(camera):
            return ({"type": "mjpeg", "url": camera.others["mjpeg"]},
                    {"type": "pelco_d", "url": None, "device": camera.others["head"], "baud": 115200})
        self.check_run(links=links, settings={"live": {"mjpeg_port": 0, "head": "pelco_d"}})

    def test_mjpeg_over_http_and_onvif_with_login(self):
        def links(camera):
            return ({"type": "mjpeg", "url": camera.others["mjpeg"]},
                    {"type": "onvif", "url": camera.others["onvif"], "pan_range_deg": [-180, 180],
                     "tilt_range_deg": [-90, 90]})
        self.check_run(links=links, user="viewer", settings={"live": {"mjpeg_port": 0, "onvif_port": 0}})

    def test_survives_the_death_and_return_of_the_camera(self):
        rtsp_port, http_port = free_port(), free_port()
        camera = self.camera(rtsp_port=rtsp_port, http_port=http_port)
        config = self.write_config(camera, video={"timeout_s": 2, "max_backoff_s": 0.5},
                                   pan_tilt={"timeout_s": 1, "max_backoff_s": 0.5})
        run = self.alidade("run", "-c", config)
        before = self.records(run, 30)
        camera.end(signal.SIGKILL)
        lost = self.records(run, 1, keep=lambda record: record["mode"] == "none")[0]
        self.assertIsNone(lost["q_base_from_camera"])
        self.assertNotEqual(lost["status"], "ok")
        second = self.camera(rtsp_port=rtsp_port, http_port=http_port, seed=2)
        after = self.records(run, 40)
        self.assertGreater(after[0]["receive_time_s"], before[-1]["receive_time_s"])
        code, _ = run.end(signal.SIGTERM)
        self.assertEqual(code, 0, run.error_text())
        self.assert_angles_are_true(after, second)

    def test_claims_no_orientation_until_the_time_of_a_picture_is_known(self):
        camera = self.camera(settings={"live": {"mjpeg_port": 0}})
        all_claimed = []
        for video in ({}, {"transport": "udp"}, {"type": "mjpeg", "url": camera.others["mjpeg"]}):
            with self.subTest(video=video):
                run = self.alidade("run", "-c", self.write_config(
                    camera, video={"timeout_s": 2, "max_backoff_s": 0.2, **video}, pan_tilt={"max_backoff_s": 0.2}))
                self.records(run, 50)
                for stopped_s in (0.7, 4):
                    camera.child.send_signal(signal.SIGSTOP)
                    time.sleep(stopped_s)
                    camera.child.send_signal(signal.SIGCONT)
                    continued_s = time.monotonic()
                    records = []
                    while not records or records[-1]["receive_time_s"] < continued_s + 4:
                        records.append(json.loads(run.line()))
                    after = [r for r in records if r["frame"] is not None and r["receive_time_s"] > continued_s]
                    claimed = [r for r in after if r["mode"] == "PT"]
                    self.assertLess(claimed[0]["receive_time_s"], after[0]["receive_time_s"] + 3)
                    if stopped_s > 2:
                        self.assertEqual(after[0]["status"], "picture time unknown")
                        self.assertIsNone(after[0]["time_s"])
                    all_claimed += claimed
                code, _ = run.end(signal.SIGTERM)
                self.assertEqual(code, 0, run.error_text())
        self.assert_angles_are_true(all_claimed, camera)

    def test_says_that_the_password_is_wrong(self):
        camera = self.camera(user="viewer")
        login = {"user": "viewer", "password_env": "TEST_PASSWORD"}
        config = self.write_config(camera, video=login, pan_tilt=login)
        for command in ("run", "check"):
            with self.subTest(command=command):
                process = self.alidade(command, "-c", config, TEST_PASSWORD="wrong horse")
                code, _ = process.end()
                self.assertEqual(code, 1)
                self.assertIn("password", process.error_text())
                self.assertNotIn("wrong horse", process.error_text())

    def test_says_that_the_image_size_differs_from_the_calibration(self):
        camera = self.camera()
        calibration = self.folder / "other-size.yaml"
        truth = (camera.truth / "truth.yaml").read_text()
        self.assertIn(str(IMAGE["width"]), truth)
        calibration.write_text(truth.replace(f"width: {IMAGE['width']}", "width: 640"))
        config = self.write_config(camera, calibration={"file": str(calibration)})
        run = self.alidade("run", "-c", config)
        code, _ = run.end()
        self.assertNotEqual(code, 0)
        self.assertIn(f"640x{IMAGE['height']}", run.error_text())
        self.assertIn(f"{IMAGE['width']}x{IMAGE['height']}", run.error_text())

    def test_ends_when_its_reader_goes_away(self):
        camera = self.camera()
        run = self.alidade("run", "-c", self.write_config(camera))
        self.records(run, 1)
        run.child.stdout.close()
        run.child.wait(60)
        self.assertEqual(run.child.returncode, 0)

    def test_check_reports_what_it_found(self):
        # At the paper's field of view so small a picture of this scene shows noise only.
        wide = {"camera": {"focal_length_px": 600, "line_delay_us": LINE_DELAY_US, "clock_offset_ms": CLOCK_OFFSET_MS},
                "image": {**IMAGE, "width": 320, "height": 192},
                "scene": {"procedural": [{"width_deg": 360, "height_deg": 180, "projection": "equirectangular"}]}}
        camera = self.camera(settings=wide)
        check = self.alidade("check", "-c", self.write_config(camera))
        code, lines = check.end()
        self.assertEqual(code, 0, check.error_text())
        report = "\n".join(lines)
        self.assertIn("320x192 px (as expected)", report)
        self.assertIn("pan sign correct, tilt sign correct", report)

    def test_check_says_that_nobody_is_there(self):
        camera = self.camera()
        config = self.write_config(camera)
        camera.end(signal.SIGKILL)
        check = self.alidade("check", "-c", config)
        code, lines = check.end()
        self.assertEqual(code, 1)
        for url in (camera.video_url, camera.pan_tilt_url):
            self.assertTrue(any(line.startswith("alidade: ") and url in line for line in check.errors), check.error_text())
        self.assertEqual(2, sum("failed" in line for line in lines), lines)


class Record(SystemTest):
    def test_recording_replays_to_the_same_angles(self):
        camera = self.camera()
        config = self.write_config(camera)
        folder = self.folder / "recording"
        record = self.alidade("record", "-c", config, "-o", folder)
        frames = folder / "frames.csv"
        wait_until(lambda: record.child.poll() is not None or
                   frames.exists() and len(frames.read_text().splitlines()) > 100, "a recording of 100 frames")
        code, _ = record.end(signal.SIGINT)
        self.assertEqual(code, 0, record.error_text())

        replay = self.alidade("replay", folder, "--calibration", camera.truth / "truth.yaml", "--json", "--mode", "PT")
        code, lines = replay.end()
        self.assertEqual(code, 0, replay.error_text())
        records = [r for r in map(json.loads, lines) if r["mode"] == "PT"]
        self.assertGreater(len(records), 60)
        self.assertTrue((folder / "alidade" / "orientation.csv").exists())
        self.assert_angles_are_true(records, camera)

    assert_angles_are_true = Run.assert_angles_are_true


class Simulate(SystemTest):
    def test_writes_a_recording_that_replays(self):
        camera = self.camera()  # for its configuration; the live server is not needed
        camera.end(signal.SIGTERM)
        folder = self.folder / "written"
        config = json.loads((self.folder / "camera-1.yaml").read_text())
        config["duration_s"] = 4
        file = self.folder / "write.yaml"
        file.write_text(json.dumps(config))
        writer = Process(SIMULATE, "-c", file, "-o", folder)
        self.processes.append(writer)
        code, _ = writer.end()
        self.assertEqual(code, 0, writer.error_text())
        replay = self.alidade("replay", folder, "--calibration", folder / "truth.yaml")
        code, _ = replay.end()
        self.assertEqual(code, 0, replay.error_text())
        rows = pathlib.Path(folder, "alidade", "orientation.csv").read_text().splitlines()
        self.assertEqual(len(rows), 1 + 4 * IMAGE["rate_hz"])


if __name__ == "__main__":
    unittest.main()
