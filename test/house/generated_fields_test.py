#!/usr/bin/env python3
"""Do all interfaces have the record's fields as edge_app/record/record_fields.yaml lists them? And are slips in the list named?"""
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
FILES = ("scripts/generate-fields", ".clang-format", "edge_app/record/record_fields.yaml", "edge_app/record/record_fields.h",
         "edge_app/output/openapi.yaml", "docs/records.md", "ros_wrapper/alidade_msgs/msg/FrameOrientation.msg",
         "ros_wrapper/alidade_ros/include/alidade_ros/record_fields.h", "ros_wrapper/alidade_ros/src/record_fields.cpp")
NEW = """
- name: sun_rad
  type: number
  unit: rad
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
        for file in FILES:
            (self.top / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(TOP / file, self.top / file)
        self.list = self.top / "edge_app/record/record_fields.yaml"

    def run_script(self, *arguments):
        run = subprocess.run([sys.executable, "-B", self.top / "scripts/generate-fields", *arguments], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True)
        return run.returncode, run.stdout

    def test_are_up_to_date(self):
        self.assertEqual(self.run_script("--check"), (0, ""))

    def test_a_new_field_is_wanted_everywhere_and_comes_everywhere(self):
        self.list.write_text(self.list.read_text() + NEW)
        code, output = self.run_script("--check")
        self.assertEqual(code, 1)
        for file in FILES[3:]:
            self.assertIn(f"{file}: not as ", output)
        self.assertEqual(self.run_script()[0], 0)
        self.assertEqual(self.run_script("--check"), (0, ""))
        self.assertIn('line->add("sun_rad", record.sun_rad);', (self.top / FILES[3]).read_text())
        self.assertIn("sun_rad: {type: number, nullable: true", (self.top / FILES[4]).read_text())
        self.assertIn("| `sun_rad` | rad | how high the Sun stands; `null`: it is night |", (self.top / FILES[5]).read_text())
        self.assertIn("float64 sun ", (self.top / FILES[6]).read_text())
        self.assertIn("std::optional<double> sun_rad;", (self.top / FILES[7]).read_text())
        self.assertIn("message->sun = record.sun_rad.value_or(kNan);", (self.top / FILES[8]).read_text())

    def test_an_interface_that_was_changed_by_hand_is_named(self):
        for file in FILES[3:]:
            with self.subTest(file=file):
                path = self.top / file
                text = path.read_text()
                path.write_text(text.replace("telemetry_age", "telemetry_old"))
                code, output = self.run_script("--check")
                self.assertEqual(code, 1)
                self.assertIn(f"{file}: not as ", output)
                path.write_text(text)

    def test_slips_in_the_list_are_named(self):
        for wrong, told in ((NEW.replace("says:", "sais:"), "sun_rad: sais is unknown"),
                            (NEW.replace("  value: record.sun_rad\n", ""), "sun_rad: value is missing"),
                            (NEW.replace("type: number", "type: angle"), "sun_rad: type is angle; it may be array, "),
                            (NEW.replace("type: number", "type: array"), "sun_rad: an array has columns"),
                            (NEW.replace("sun_rad", "zoom"), "zoom stands there twice"),
                            (NEW.replace("type: number", "type: integer"), "sun_rad: an integer that may be null has ros: as: presence"),
                            (NEW.replace("type: number", "type: boolean"), "sun_rad: a field of type boolean cannot be null"),
                            ("- [", "generate-fields: ")):
            with self.subTest(told=told):
                text = self.list.read_text()
                self.list.write_text(text + wrong)
                code, output = self.run_script()
                self.assertEqual(code, 1)
                self.assertIn(told, output)
                self.list.write_text(text)


if __name__ == "__main__":
    unittest.main()
