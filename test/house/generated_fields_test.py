#!/usr/bin/env python3
"""Do all interfaces have the fields of records and targets as their lists have them? And are slips in a list named?"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import yaml

TOP = pathlib.Path(__file__).resolve().parents[2]
RECORD_LIST = "edge_app/record/record_fields.yaml"
TARGET_LIST = "edge_app/tracking/target_fields.yaml"
AROUND_TARGETS_LIST = "edge_app/tracking/target_list_fields.yaml"
OPENAPI = "edge_app/output/openapi.yaml"
RECORD = "edge_app/record/orientation_record.h"
# Members that no field shows: metrics and status have the first, localization uses the next two, the history has the last.
NOT_SHOWN = {"clock_locked", "telemetry_zero", "zero_covariance", "telemetry_error"}
# What is generated, and what a new field brings there.
OF_RECORDS = {
    "edge_app/record/record_fields.h": 'line->add("sun_rad", record.sun_rad);',
    OPENAPI: "sun_rad: {type: number, nullable: true, minimum: -2, maximum: 2, ",
    "docs/manual/reference/records.md": "| `sun_rad` | rad | how high the Sun stands; `null`: it is night |",
    "ros_wrapper/alidade_msgs/msg/FrameOrientation.msg": "float64 sun ",
    "ros_wrapper/alidade_ros/include/alidade_ros/record_fields.h": "std::optional<double> sun_rad;",
    "ros_wrapper/alidade_ros/src/record_fields.cpp": "message->sun = record.sun_rad.value_or(kNan);",
}
OF_TARGETS = {
    "edge_app/tracking/target_fields.h": 'if (on_plane) line->add("height_m", target.height_m);',
    OPENAPI: "height_m: {type: number, nullable: true, minimum: 0, description: \"m; how tall it is; null: nobody knows\"}",
    "docs/manual/reference/targets.md": "| `height_m` | m | how tall it is; only on the plane; `null`: nobody knows |",
    "ros_wrapper/alidade_msgs/msg/Target.msg": "float64 height               # m; how tall it is; NaN: nobody knows",
    "ros_wrapper/alidade_ros/src/target_fields.cpp": 'message->height = read.number_or_nan("height_m");',
}
AROUND_TARGETS = {
    "edge_app/tracking/target_list_fields.h": 'line->add("wind_m_s", list.wind_m_s);',
    OPENAPI: "wind_m_s: {type: number, nullable: true, description: \"m/s; how fast the wind is; null: it is calm\"}",
    "docs/manual/reference/targets.md": "| `wind_m_s` | m/s | how fast the wind is; `null`: it is calm |",
    "ros_wrapper/alidade_msgs/msg/Targets.msg": "float64 wind                 # m/s; how fast the wind is; NaN: it is calm",
    "ros_wrapper/alidade_ros/src/target_list_fields.cpp": 'message->wind = read.number_or_nan("wind_m_s");',
}
NEW_AROUND_TARGETS = """
- name: wind_m_s
  type: number
  unit: m/s
  null_if: it is calm
  says: how fast the wind is
  value: list.wind_m_s
  ros: {name: wind, type: float64, as: number_or_nan}
"""
NEW_OF_TARGETS = """
- name: height_m
  type: number
  unit: m
  space: plane
  null_if: nobody knows
  minimum: 0
  says: how tall it is
  value: target.height_m
  ros: {name: height, type: float64}
"""
NEW = """
- name: sun_rad
  type: number
  unit: rad
  minimum: -2
  maximum: 2
  null_if: it is night
  says: how high the Sun stands
  value: record.sun_rad
  ros: {name: sun, type: float64}
"""


class GeneratedFields(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.top = pathlib.Path(folder.name)
        shutil.copytree(TOP / "scripts/fields", self.top / "scripts/fields", ignore=shutil.ignore_patterns("__pycache__"))
        for file in {"scripts/generate-fields", ".clang-format", RECORD_LIST, TARGET_LIST, AROUND_TARGETS_LIST, *OF_RECORDS, *OF_TARGETS, *AROUND_TARGETS}:
            (self.top / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(TOP / file, self.top / file)

    def run_script(self, *arguments):
        run = subprocess.run([sys.executable, "-B", self.top / "scripts/generate-fields", *arguments], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True)
        return run.returncode, run.stdout

    def test_are_up_to_date(self):
        self.assertEqual(self.run_script("--check"), (0, ""))

    def test_a_new_field_is_wanted_everywhere_and_comes_everywhere(self):
        for source, new, files in ((RECORD_LIST, NEW, OF_RECORDS), (TARGET_LIST, NEW_OF_TARGETS, OF_TARGETS),
                                   (AROUND_TARGETS_LIST, NEW_AROUND_TARGETS, AROUND_TARGETS)):
            with self.subTest(source=source):
                path = self.top / source
                path.write_text(path.read_text() + new)
                code, output = self.run_script("--check")
                self.assertEqual(code, 1)
                for file in files:
                    self.assertIn(f"{file}: not as {source} has it", output)
                self.assertEqual(self.run_script()[0], 0)
                self.assertEqual(self.run_script("--check"), (0, ""))
                for file, line in files.items():
                    self.assertIn(line, (self.top / file).read_text())

    def test_an_interface_that_was_changed_by_hand_is_named(self):
        for files, was, made in ((OF_RECORDS, "telemetry_age", "telemetry_old"), (OF_TARGETS, "latitude", "breadth"), (AROUND_TARGETS, "space", "room")):
            for file in files:
                path = self.top / file
                path.write_text(path.read_text().replace(was, made))
        code, output = self.run_script("--check")
        self.assertEqual(code, 1)
        for file in (*OF_RECORDS, *OF_TARGETS, *AROUND_TARGETS):
            self.assertIn(f"{file}: not as ", output)

    def test_every_member_of_a_record_is_in_its_list(self):
        struct = (TOP / RECORD).read_text(encoding="utf-8").split("struct OrientationRecord {")[1].split("\n};")[0]
        struct = re.sub(r"//.*", "", struct)
        members = re.findall(r"^ +[\w:]+(?:<.*>)? (\w+)(?: = [^;]+|\{[^;]*\})?;", struct, re.MULTILINE)
        self.assertEqual(len(members), struct.count(";") - len(re.findall(r"\n +\};", struct)), "some member is not understood")
        values = [one["value"] for field in yaml.safe_load((TOP / RECORD_LIST).read_text(encoding="utf-8"))
                  for one in (field, *field.get("members", ()))]
        used = set(re.findall(r"\w+", "\n".join([*values, (TOP / "edge_app/record/record_values.h").read_text(encoding="utf-8")])))
        missing = [member for member in members if member not in used | NOT_SHOWN]
        self.assertFalse(missing, f"{RECORD_LIST} has no field for {', '.join(missing)} of {RECORD}")

    def test_slips_in_a_list_are_named(self):
        of_records = ((NEW.replace("says:", "sais:"), "sun_rad: sais is unknown"),
                      (NEW.replace("  value: record.sun_rad\n", ""), "sun_rad: value is missing"),
                      (NEW.replace("type: number", "type: angle"), "sun_rad: type is angle; it may be array, "),
                      (NEW.replace("type: number", "type: array"), "sun_rad: an array has columns"),
                      (NEW.replace("type: number", "type: object"), "sun_rad: an object has members"),
                      (NEW.replace("unit: rad", "unit: ms"), "sun_rad: unit is ms; it may be s, "),
                      (NEW.replace("unit: rad", "unit: s"), "sun_rad: sun_rad is in s, so its name ends in _s"),
                      (NEW.replace("type: number", "type: object\n  members: [{name: a, unit: deg}]"), "sun_rad: unit is deg; it may be s, "),
                      (NEW.replace("sun_rad", "zoom"), "zoom stands there twice"),
                      (NEW.replace("type: number", "type: integer"), "sun_rad: an integer that may be null has ros: as: presence"),
                      (NEW.replace("type: number", "type: boolean"), "sun_rad: a field of type boolean cannot be null"),
                      ("- [", "generate-fields: "))
        new = NEW_OF_TARGETS
        of_targets = ((new.replace("says:", "sais:"), "height_m: sais is unknown"),
                      (new.replace("unit: m", "unit: feet"), "height_m: unit is feet; it may be s, "),
                      (new.replace("height_m", "pixel"), "pixel stands there twice"),
                      (new.replace("type: number", "type: vector"), "height_m: a vector has a size"),
                      (new.replace("type: number", "type: matrix\n  size: 2"), "height_m: ros: as is missing"),
                      (new.replace("type: number", "type: integer"), "height_m: a ROS message cannot say that an integer is missing"),
                      (new.replace("space: plane", "space: air"), "height_m: space is air"),
                      (new.replace("null_if", "left_out_if").replace("type: number", "type: word"), "height_m: only a number may be left out"))
        new = NEW_AROUND_TARGETS
        around_targets = ((new.replace("says:", "sais:"), "wind_m_s: sais is unknown"),
                          (new.replace("wind_m_s", "space"), "space stands there twice"),
                          (new.replace("type: number", "type: targets"), "wind_m_s: targets cannot be null"),
                          (new.replace("type: number", "type: targets").replace("null_if", "more").replace(", as: number_or_nan", ""),
                           "wind_m_s: ros: as is missing"))
        for source, slips in ((RECORD_LIST, of_records), (TARGET_LIST, of_targets), (AROUND_TARGETS_LIST, around_targets)):
            path = self.top / source
            text = path.read_text()
            for wrong, told in slips:
                with self.subTest(told=told):
                    path.write_text(text + wrong)
                    code, output = self.run_script()
                    self.assertEqual(code, 1)
                    self.assertIn(told, output)
            path.write_text(text)


if __name__ == "__main__":
    unittest.main()
