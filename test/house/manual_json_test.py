#!/usr/bin/env python3
"""docs/manual/reference/json-of-commands.md: does it name each key that a command writes with --json, none that no command writes, and
which may be null?"""
import pathlib
import re
import sys
import unittest
from collections import Counter

TOP = pathlib.Path(__file__).resolve().parents[2]
PAGE = "docs/manual/reference/json-of-commands.md"
sys.path.insert(0, str(TOP / "scripts"))
sys.dont_write_bytecode = True
from reference import commands, cpp  # noqa: E402: after the line above

# Section: what writes its keys, as (file, functions); no functions: all of the file.
WRITERS = {
    "calibrate": [("edge_app/output/calibration_summary.cpp", ["summary_json"]),
                  ("edge_app/output/calibration_json.cpp", ["parameters_json", "telemetry_error_json"])],
    "calibrate, several zooms": [("edge_app/commands/calibrate_zooms.cpp", ["zooms_json"])],
    "calibrate-shutter": [("edge_app/commands/calibrate_shutter.cpp", ["json_of"])],
    "map build, map info, map check": [("edge_app/commands/map_report.cpp", ["map_json"])],
    "localize": [("edge_app/commands/localize.cpp", []), ("edge_app/commands/localization_json.cpp", [])],
    "plane fit": [("edge_app/output/plane_json.cpp", ["plane_fit_json"])],
    "verify": [("edge_app/verify/verification_json.cpp", [])],
    "check": [("edge_app/commands/check_json.cpp", [])],
    "discover": [("edge_app/setup/camera_findings.cpp", [])],
    "setup": [("edge_app/commands/setup.cpp", [])],
}
# Keys whose names stand in a list elsewhere: section, what takes them from there, the list.
LISTS = {
    "calibrate-shutter": ("kLensParameterNames[", "core/pattern/lens.h", r"kLensParameterNames = \{(.*?)\}"),
    "plane fit": ("kPlaneValueNames[", "core/ground/plane_estimate.h", r"kPlaneValueNames = \{(.*?)\}"),
}
RECORDS = {"run", "replay"}  # whose lines are those of records.md
KEY = r'(?:\{|\[|\b(?:axis|add_curve|add_play|texts?_in)\((?:body, )?)"(\w+)"(?=, |,\n|\]|\))'


def sections():
    """{heading: [(words in the first cell, words in all cells, the row)]}"""
    found = {}
    for heading, text in re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", (TOP / PAGE).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL):
        rows = []
        for row in re.findall(r"^\|.*`.*\|$", text, re.MULTILINE):
            first = row.split("|")[1] if heading != "setup" else row.partition("|")[2].partition("|")[2]
            parts = [{part for word in re.findall(r"`([\w.]+)`", cells) for part in word.split(".")} for cells in (first, row)]
            rows.append((*parts, row))
        found[heading] = rows
    return found


def code_of(section):
    text = ""
    for file, functions in WRITERS[section]:
        bodies = [body for name, body in cpp.functions(file) if name in functions]
        if len(bodies) < len(functions):
            raise AssertionError(f"{file}: not all of {functions}; say in WRITERS of {__file__} who writes the keys")
        text += "\n".join(bodies) if functions else cpp.text_of(file)
    return text


def parameter_names():
    text = cpp.text_of("core/model/calibration.h")
    names = dict(re.findall(r'case Parameter::(k\w+):\s+return "(\w+)";', text))
    names["kRadialDistortion"] = re.search(r'kNames = \{"(\w+)"\}', cpp.text_of("core/model/lens/distortion.h"))[1]
    return names


def keys_of(section):
    text = code_of(section)
    keys = set(re.findall(KEY, text))
    if section == "calibrate":
        names = parameter_names()
        keys |= {names[one] for one in re.findall(r"\bscalar\(Parameter::(k\w+)\)", text)} | {names["kRadialDistortion"]}
    if section in LISTS:
        use, file, names = LISTS[section]
        if use not in text:
            raise AssertionError(f"{section}: no {use} in {WRITERS[section]}")
        keys |= set(re.findall(r'"(\w+)"', re.search(names, cpp.text_of(file), re.DOTALL)[1]))
    return keys


class Keys(unittest.TestCase):
    def test_are_those_of_the_code(self):
        page, wrong = sections(), []
        self.assertEqual(set(WRITERS), set(page))
        for section, rows in page.items():
            keys = keys_of(section)
            self.assertGreater(len(keys), 4, section)
            said = set().union(*(words for _, words, _ in rows))
            named = set().union(*(words for words, _, _ in rows))
            wrong += [f"{section}: lacks {key}" for key in sorted(keys - said)]
            wrong += [f"{section}: no code writes {key}" for key in sorted(named - keys)]
        self.assertFalse(wrong, "\n".join(wrong))

    def test_are_there_once_for_each_object_that_has_them(self):
        """As far as each object has a function of its own."""
        wrong = []
        for section, rows in sections().items():
            if section == "setup":  # its functions share what a body holds
                continue
            written = Counter()
            for file, functions in WRITERS[section]:
                for name, body in cpp.functions(file):
                    if not functions or name in functions:
                        written.update(set(re.findall(KEY, body)))
            said = Counter(part for _, _, row in rows for word in re.findall(r"`([\w.]+)`", row) for part in word.split("."))
            wrong += [f"{section}: {key} {said[key]} times; {count} functions write it" for key, count in written.items() if said[key] < count]
        self.assertFalse(wrong, "\n".join(wrong))

    def test_may_be_null_where_the_code_says_so(self):
        wrong, seen = [], 0
        for section, rows in sections().items():
            for match in re.finditer(r'(?:\{|\[)"(\w+)"(?:, |\] = )((?:(?!\{"|;|\[")[^"])*)', code_of(section)):
                if not re.search(r"or_null\(|\bJson\(\)|\bJson\(nullptr\)|\bnullptr\b", match[2]):
                    continue
                seen += 1
                # What a stream does not say is null, as one row says for all.
                if not any(match[1] in words and ("null" in row or "streams" in words) for _, words, row in rows):
                    wrong.append(f"{section}: {match[1]} may be null")
        self.assertGreater(seen, 30)
        self.assertFalse(wrong, "\n".join(wrong))

    def test_are_there_for_each_command_with_json(self):
        with_json = {name for name, _, rows in commands.commands() if any(option == "--json" for option, _, _ in rows)} - RECORDS
        self.assertGreater(len(with_json), 7)
        for name in with_json:
            self.assertTrue(any(name in heading.split(", ") or name == heading.split()[0] for heading in sections()), f"{PAGE}: lacks {name}")


if __name__ == "__main__":
    unittest.main()
