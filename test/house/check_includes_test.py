#!/usr/bin/env python3
"""scripts/check-includes must accept the repository and bite on each kind of wrong arrow."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]


def check(files):
    """Runs the script on a tree made of {path: text}; returns (exit code, output)."""
    with tempfile.TemporaryDirectory() as folder:
        for path, text in files.items():
            file = pathlib.Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)
        done = subprocess.run([sys.executable, TOP / "scripts/check-includes", folder],
                              capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


class CheckIncludes(unittest.TestCase):
    def test_accepts_this_repository(self):
        done = subprocess.run([sys.executable, TOP / "scripts/check-includes"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_accepts_an_arrow_of_the_table(self):
        code, output = check({"core/realtime/a.h": '#include "core/model/b.h"\n#include <Eigen/Core>\n'})
        self.assertEqual(code, 0, output)

    def test_accepts_the_arrows_between_floors(self):
        code, output = check({"core/realtime/oe_mode/a.h": '#include "core/realtime/image/b.h"\n'
                                                           '#include "core/realtime/telemetry/b.h"\n'
                                                           '#include "core/realtime/pt_mode.h"\n',
                              "core/realtime/start_up/a.h": '#include "core/realtime/image/b.h"\n',
                              "core/realtime/pt_mode.h": '#include "core/realtime/telemetry/b.h"\n',
                              "edge_app/a.h": '#include "core/realtime/oe_mode/a.h"\n'})
        self.assertEqual(code, 0, output)

    def test_accepts_what_the_links_use_of_their_neighbours(self):
        for room in ("video", "pan_tilt"):
            for used in ("streams", "system", "storage"):
                code, output = check({f"platform/{room}/a.cpp": f'#include "platform/{used}/b.h"\n'})
                self.assertEqual(code, 0, output)

    def test_lets_commands_join_the_rooms_of_the_program(self):
        code, output = check({"edge_app/commands/a.cpp": "".join(
            f'#include "edge_app/{room}/a.h"\n'
            for room in ("commands", "pipeline", "step", "record", "clocks", "self_calibration", "taps", "tracking", "check", "storage", "output",
                         "config"))})
        self.assertEqual(code, 0, output)

    def test_accepts_the_include_folder_of_a_catkin_package(self):
        code, output = check({"ros_wrapper/alidade_ros/src/a.cpp":
                              '#include "alidade_ros/a.h"\n#include <alidade_msgs/Status.h>\n'})
        self.assertEqual(code, 0, output)

    def test_rejects_wrong_arrows(self):
        for path, line in (
                ("core/model/a.h", '#include "core/realtime/b.h"'),
                ("core/realtime/a.h", '#include "core/calibration/b.h"'),
                ("core/realtime/a.h", "#include <mutex>"),
                ("core/realtime/a.h", "#include <opencv2/core.hpp>"),
                ("core/realtime/image/a.h", '#include "core/realtime/telemetry/b.h"'),
                ("core/realtime/image/a.h", '#include "core/realtime/frame_orientation.h"'),
                ("core/realtime/telemetry/a.h", '#include "core/realtime/image/b.h"'),
                ("core/realtime/oe_mode/a.h", '#include "core/realtime/start_up/b.h"'),
                ("core/realtime/start_up/a.h", '#include "core/realtime/oe_mode/b.h"'),
                ("core/realtime/start_up/a.h", '#include "core/realtime/telemetry/b.h"'),
                ("core/realtime/pt_mode.h", '#include "core/realtime/oe_mode/b.h"'),
                ("core/realtime/image/a.h", "#include <mutex>"),
                ("core/calibration/a.cpp", '#include "platform/system/clock.h"'),
                ("core/calibration/a.cpp", "#include <fstream>"),
                ("core/ground/a.h", '#include "core/tracking/target_tracker.h"'),
                ("platform/video/a.cpp", '#include "core/model/lens/camera.h"'),
                ("platform/video/a.cpp", '#include "platform/pan_tilt/pan_tilt_source.h"'),
                ("platform/pan_tilt/a.cpp", '#include "platform/video/frame_source.h"'),
                ("platform/storage/a.cpp", '#include "platform/video/frame_source.h"'),
                ("platform/system/a.cpp", '#include "platform/streams/frame.h"'),
                ("platform/streams/a.h", '#include "platform/system/clock.h"'),
                ("platform/streams/a.h", "#include <Eigen/Core>"),
                ("edge_app/pipeline/a.cpp", '#include "test/support/guard.h"'),
                ("edge_app/pipeline/a.h", '#include "edge_app/storage/calibration_store.h"'),
                ("edge_app/pipeline/a.cpp", '#include "edge_app/tracking/target_feed.h"'),
                ("edge_app/record/a.h", '#include "edge_app/step/orientation_step.h"'),
                ("edge_app/clocks/a.h", '#include "edge_app/record/record_status.h"'),
                ("edge_app/step/a.cpp", '#include "edge_app/self_calibration/self_calibration.h"'),
                ("edge_app/taps/a.cpp", '#include "edge_app/pipeline/realtime_stage.h"'),
                ("edge_app/check/a.h", '#include "edge_app/output/metrics.h"'),
                ("edge_app/output/a.cpp", '#include "edge_app/config/config.h"'),
                ("edge_app/storage/a.cpp", '#include "edge_app/config/yaml_section.h"'),
                ("edge_app/config/a.cpp", '#include "edge_app/commands/command.h"'),
                ("edge_app/commands/a.cpp", "#include <opencv2/core.hpp>"),
                ("test/simulator/a.cpp", '#include "core/model/lens/camera.h"'),
                ("ros_wrapper/a.cpp", '#include "core/model/lens/camera.h"'),
                ("ros_wrapper/alidade_ros/src/a.cpp", "#include <platform/storage/recording.h>"),
                ("ros_wrapper/alidade_ros/test/a.cpp", '#include "edge_app/output/live_state.h"'),
                ("ros_wrapper/alidade_ros/src/a.cpp", "#include <Eigen/Core>"),
                ("core/model/a.h", '#include "neighbour.h"')):
            with self.subTest(path=path, line=line):
                code, output = check({path: "#pragma once\n" + line + "\n"})
                self.assertEqual(code, 1)
                self.assertIn(f"{path}:2:", output)


if __name__ == "__main__":
    unittest.main()
