#!/usr/bin/env python3
"""`alidade calibrate-shutter -c` on a camera that is moved by hand before a printed pattern, live."""
import csv
import json
import signal
import unittest

from harness import SystemTest, free_port, wait_until

FOCAL_LENGTH_PX, LINE_DELAY_US = 300, 80
PATTERN = "chessboard:9x6:30mm"
SETTINGS = {
    "duration_s": 45, "image": {"width": 376, "height": 240, "rate_hz": 15},
    "camera": {"line_delay_us": LINE_DELAY_US},
    "sensor": {"exposure_ms": 1, "read_noise": 2, "jpeg_quality": 95},
    "pattern": {"kind": "chessboard", "hand": {"speed": 0.6, "reach": 1.6},
                "lens": {"focal_length_u_px": FOCAL_LENGTH_PX, "focal_length_v_px": 301, "centre_u_px": 190,
                         "centre_v_px": 118}},
}


class Bench(SystemTest):
    def calibrate(self, name, video, *options, pattern=PATTERN):
        """On a bench: the configuration has no head."""
        config = self.folder / f"{name}.yaml"
        config.write_text(json.dumps({"video": video}))
        return self.alidade("calibrate-shutter", "-c", config, "--pattern", pattern, "-o", self.folder / name, *options)

    def said(self, process, text):
        return any(text in line for line in process.errors)


class LivePatternInBrief(Bench):
    """What a few seconds show."""

    def test_a_wrong_pattern_or_size_is_said(self):
        camera = self.camera(settings={**SETTINGS, "duration_s": 12, "live": {"mjpeg_port": 0}})
        mjpeg = {"type": "mjpeg", "url": camera.others["mjpeg"]}
        wrong = self.calibrate("wrong", mjpeg, pattern="chessboard:7x5:30mm")
        size = self.calibrate("size", {"type": "rtsp", "url": camera.video_url, "width": 640, "height": 480})
        code, _ = size.end()
        self.assertEqual(code, 1, size.error_text())
        self.assertIn("images are of 376x240 px, but the configuration's video is 640x480 px", size.errors[-1])

        for text in ("in 0 of ", "the pattern is not found; is it this pattern"):
            wait_until(lambda: self.said(wrong, text), f"'{text}', while it is filmed")
        code, lines = wrong.end(signal.SIGINT)
        self.assertEqual((code, lines), (1, []), wrong.error_text())
        self.assertTrue(wrong.errors[-1].startswith(f"alidade: {mjpeg['url']}: the pattern was not found in any frame"),
                        wrong.error_text())
        self.assertIn("7x5 are inner corners", wrong.errors[-1])
        self.assertFalse((self.folder / "wrong").exists())


    def test_a_wrong_gap_of_an_april_grid_is_said(self):
        board = {"kind": "april_grid", "columns": 4, "rows": 3, "size_mm": 50, "lens": SETTINGS["pattern"]["lens"]}
        camera = self.camera(settings={**SETTINGS, "duration_s": 12, "pattern": board, "live": {"mjpeg_port": 0}})
        process = self.calibrate("gap", {"type": "mjpeg", "url": camera.others["mjpeg"]},
                                 pattern="aprilgrid:4x3:50mm:0.25")
        gap = "the gap between its tags is 0.30 of a tag's side, but 0.25 was given"
        wait_until(lambda: self.said(process, f"images: {gap}"), "the gap, while it is filmed")
        code, lines = process.end(signal.SIGINT)
        self.assertEqual((code, lines), (1, []), process.error_text())
        self.assertIn(gap, process.errors[-1])


class LivePattern(Bench):
    def assert_is_true(self, process, lines):
        """Line delay and focal length, as the sigmas say."""
        result = json.loads(lines[-1])
        for name, truth in (("line_delay", 1e-6 * LINE_DELAY_US), ("focal_length_u", FOCAL_LENGTH_PX)):
            self.assertGreater(result[name]["sigma"], 0)
            self.assertLess(abs(result[name]["value"] - truth), 5 * result[name]["sigma"],
                            f"{name}: {result[name]}\n{process.error_text()}")

    def assert_stored(self, name):
        self.assertEqual({file.name for file in (self.folder / name).iterdir()},
                         {"lens.yaml", "camera_info.yaml", "trajectory.csv", "report.html"})

    def test_ends_when_all_was_shown_or_when_asked_to(self):
        camera = self.camera(seed=3, settings={**SETTINGS, "live": {"mjpeg_port": 0}})
        rtsp, mjpeg = ({"type": "rtsp", "url": camera.video_url}, {"type": "mjpeg", "url": camera.others["mjpeg"]})
        by_itself = self.calibrate("by_itself", rtsp, "--json")
        interrupted = self.calibrate("interrupted", mjpeg, "--json")
        impatient = self.calibrate("impatient", mjpeg)

        # Ten seconds of the pattern, by the camera's own count.
        wait_until(lambda: len((camera.truth / "truth.csv").read_text().splitlines()) > 10 * 15, "ten seconds")
        self.assertTrue(self.said(interrupted, "parts of the image: "), interrupted.error_text())
        code, lines = interrupted.end(signal.SIGINT)
        self.assertEqual(code, 0, interrupted.error_text())
        self.assert_is_true(interrupted, lines)
        self.assert_stored("interrupted")

        impatient.child.send_signal(signal.SIGINT)
        wait_until(lambda: self.said(impatient, "calibrating, "), "the calibration")
        code, lines = impatient.end(signal.SIGINT)
        self.assertEqual((code, lines), (-signal.SIGINT, []), impatient.error_text())
        self.assertFalse((self.folder / "impatient").exists())

        code, lines = by_itself.end()
        self.assertEqual(code, 0, by_itself.error_text())
        self.assertTrue(self.said(by_itself, "all was shown"), by_itself.error_text())
        self.assert_is_true(by_itself, lines)
        self.assert_stored("by_itself")

    def test_waits_for_a_camera_that_is_lost_and_keeps_what_it_has(self):
        """The second one looks at the pattern in another way: two pieces of one film, with a gap between them."""
        rtsp_port = free_port()
        camera = self.camera(rtsp_port=rtsp_port, seed=3, settings=SETTINGS)
        process = self.calibrate("lost", {"type": "rtsp", "url": camera.video_url, "timeout_s": 2, "max_backoff_s": 0.5},
                                 "--json")

        def frames(of):
            return len((of.truth / "truth.csv").read_text().splitlines())

        wait_until(lambda: frames(camera) > 8 * 15, "eight seconds")
        camera.end(signal.SIGKILL)
        wait_until(lambda: self.said(process, "; trying again"), "the loss")
        second = self.camera(rtsp_port=rtsp_port, seed=4, settings=SETTINGS)
        wait_until(lambda: self.said(process, "connected again"), "the return")
        before = frames(second)
        wait_until(lambda: frames(second) > before + 8 * 15, "eight more seconds")
        code, lines = process.end(signal.SIGTERM)
        self.assertEqual(code, 0, process.error_text())
        self.assertTrue(self.said(process, "no images from "), process.error_text())
        self.assert_is_true(process, lines)
        with open(self.folder / "lost" / "trajectory.csv", newline="", encoding="utf-8") as file:
            times = [float(row["time_s"]) for row in csv.DictReader(file)]
        self.assertEqual(times, sorted(times))


if __name__ == "__main__":
    unittest.main()
