#!/usr/bin/env python3
"""Is each term of the camera's distortion where no compiler looks for it, and is a parameter asked whether it is a term, not whether it is
the first one? (core/model/lens/README.md)"""
import pathlib
import re
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
KINDS = "core/model/lens/distortion.h"
# (file, first line, end) of the parts that name every term; None: to the file's beginning or end.
PARTS = (("edge_app/output/openapi.yaml", "    ZoomCurve:", "    Calibration:"),
         ("edge_app/output/openapi.yaml", "    Calibration:", "    FrameNumber:"),
         ("edge_app/output/page/calibration.js", "export const kParameters = [", "];"),
         ("edge_app/output/page/calibration.js", "export async function showCalibrationInUse(", "}"),
         ("ros_wrapper/alidade_msgs/msg/Calibration.msg", None, None),
         ("ros_wrapper/alidade_msgs/msg/ZoomNode.msg", None, None),
         ("ros_wrapper/alidade_ros/include/alidade_ros/record.h", "struct ZoomNodeValues {", "};"),
         ("ros_wrapper/alidade_ros/include/alidade_ros/record.h", "struct CalibrationValues {", "};"),
         ("ros_wrapper/alidade_ros/src/record.cpp", "ZoomNodeValues zoom_node(", "}\n"),
         ("ros_wrapper/alidade_ros/src/record.cpp", "bool parse_calibration(", None),
         ("ros_wrapper/alidade_ros/src/conversions.cpp", "sensor_msgs::CameraInfo camera_info(", "}\n"),
         ("ros_wrapper/alidade_ros/src/conversions.cpp", "alidade_msgs::Calibration calibration(", "}\n"),
         ("ros_wrapper/alidade_ros/src/edge_bridge.cpp", "bool same_camera(", "}\n"),
         ("test/simulator/camera_model.cpp", None, None),
         ("test/support/calibration_errors.py", None, None),
         ("scripts/demo_report.py", None, None))


def terms():
    """The names of the kind that `Distortion` is."""
    text = (TOP / KINDS).read_text(encoding="utf-8")
    kind = re.search(r"using Distortion = (\w+)<S>;", text)[1]
    names = re.search(r"kNames = \{(.*?)\};", text[text.index(f"struct {kind} "):], re.DOTALL)[1]
    return re.findall(r'"(\w+)"', names)


def part(file, begin, end):
    text = (TOP / file).read_text(encoding="utf-8")
    if begin:
        text = text[text.index("\n" + begin) + 1:]
    return text[:text.index("\n" + end)] if end else text


# Those that name the enumerators of Parameter: kRadialDistortion.
PARTS_BY_PARAMETER = (("edge_app/verify/departure_columns.cpp", "std::vector<DepartureColumns> all_departures(", "}\n"),)


class DistortionTerms(unittest.TestCase):
    def test_are_in_every_interface(self):
        names = terms()
        self.assertTrue(names)
        enumerators = ["k" + "".join(word.title() for word in name.split("_")) for name in names]
        missing = [f"{file}{f' ({begin.strip()})' if begin else ''} lacks {name}"
                   for parts, wanted in ((PARTS, names), (PARTS_BY_PARAMETER, enumerators)) for file, begin, end in parts for name in wanted
                   if not re.search(rf"\b{name}\b", part(file, begin, end))]
        self.assertFalse(missing, "\n".join(missing))

    def test_are_not_told_by_the_first_one(self):
        """A comparison with it compiles with further terms, and leaves them out."""
        sources = sorted(path for room in ("core", "platform", "edge_app", "test") for path in (TOP / room).rglob("*")
                         if path.suffix in (".h", ".cpp"))
        self.assertGreater(len(sources), 700)
        first = re.compile(r"[=!]=\s*(?:index\()?Parameter::kRadialDistortion|Parameter::kRadialDistortion\)?\s*[=!]=")
        wrong = [str(path.relative_to(TOP)) for path in sources if first.search(path.read_text(encoding="utf-8"))]
        self.assertFalse(wrong, "is_distortion() (core/model/calibration.h) instead: " + ", ".join(wrong))


if __name__ == "__main__":
    unittest.main()
