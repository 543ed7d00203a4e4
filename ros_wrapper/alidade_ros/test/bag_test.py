#!/usr/bin/env python3
"""A camera seen in a bag calibrates like the recording that the bag was made of."""
import json
import unittest

import yaml
from harness import ALIDADE, FOCAL_LENGTH_PX, IMAGE, LINE_DELAY_US, SIMULATE, Process, SystemTest


class Bag(SystemTest):
    def run_to_its_end(self, *command):
        process = Process(*command)
        self.processes.append(process)
        code, _ = process.end()
        self.assertEqual(code, 0, process.error_text())

    def calibrate(self, folder):
        self.run_to_its_end(ALIDADE, "calibrate", folder)
        return yaml.safe_load((folder / "alidade/calibration.yaml").read_text())

    def test_recording_made_of_a_bag_calibrates(self):
        config = self.folder / "camera.yaml"
        config.write_text(json.dumps({
            "seed": 1, "duration_s": 10, "image": {**IMAGE, "width": 320, "height": 180},
            "camera": {"focal_length_px": FOCAL_LENGTH_PX, "radial_distortion": 13.9, "line_delay_us": LINE_DELAY_US,
                       "clock_offset_ms": -20, "pan_axis_mrad": [12, 0], "tilt_axis_mrad": [0, 14]},
            "path": {"type": "triple_cosine", "period_s": 10},
            "scene": {"procedural": [{"azimuth_deg": 0, "elevation_deg": 0, "width_deg": 24, "height_deg": 12}]},
            "telemetry": {"rate_hz": 50, "sigma_rad": 5e-5}, "recording": {"images": "video"}}))
        self.run_to_its_end(SIMULATE, "-c", config, "-o", self.folder / "there")
        self.run_to_its_end("rosrun", "alidade_ros", "bag_tool", "to-bag", self.folder / "there",
                            self.folder / "camera.bag")
        self.run_to_its_end("rosrun", "alidade_ros", "bag_tool", "to-recording", self.folder / "camera.bag",
                            self.folder / "back", "--stamps", "bag")
        there, back = self.calibrate(self.folder / "there"), self.calibrate(self.folder / "back")
        for name in ("focal_length", "line_delay", "clock_offset", "radial_distortion"):
            # The same measurements: what differs is the nanosecond of their times.
            self.assertAlmostEqual(back[name]["value"], there[name]["value"], delta=there[name]["sigma"], msg=name)
        truth = yaml.safe_load((self.folder / "there/truth.yaml").read_text())
        error = back["focal_length"]["value"] / truth["focal_length"]["value"] - 1
        self.assertLess(abs(error), 0.01)


if __name__ == "__main__":
    unittest.main()
