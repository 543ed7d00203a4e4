#!/usr/bin/env python3
"""The bills of materials of the packages: valid CycloneDX by its own library, and true.

    sbom_test.py DIR BUILD VENV      DIR holds the packages, BUILD is their build folder, VENV a place for what comes from PyPI
"""
import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

PACKAGES, BUILD, VENV = pathlib.Path(), pathlib.Path(), pathlib.Path()
PROJECT = pathlib.Path(__file__).resolve().parents[2]
VALIDATE = """
import sys
from cyclonedx.schema import OutputFormat, SchemaVersion
from cyclonedx.validation import make_schemabased_validator
validator = make_schemabased_validator(OutputFormat.JSON, SchemaVersion.V1_4)
for file in sys.argv[1:]:
    if error := validator.validate_str(open(file, encoding="utf-8").read()):
        sys.exit(f"{file}: {error}")
"""


def output_of(*command, **options):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise AssertionError(f"{command}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


class Bills(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.bills = {}
        for deb in PACKAGES.glob("alidade*.deb"):
            copied = pathlib.Path(shutil.copy2(deb, folder.name))
            file = output_of(PROJECT / "scripts/sbom", copied, BUILD, env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}).strip()
            cls.bills[deb.name.split("_")[0]] = (copied, pathlib.Path(file))

    def bill(self, name):
        return json.loads(self.bills[name][1].read_text(encoding="utf-8"))

    def test_are_valid(self):
        if not (VENV / "bin/python3").exists():
            output_of(sys.executable, "-m", "venv", VENV)
            output_of(VENV / "bin/pip", "install", "--quiet", "--disable-pip-version-check", "cyclonedx-python-lib[json-validation]")
        self.assertEqual(set(self.bills), {"alidade", "alidade-dev", "alidade-simulator"})
        files = [file for _, file in self.bills.values()]
        output_of(VENV / "bin/python3", "-c", VALIDATE, *files)
        # It would have found something.
        broken = files[0].with_name("broken.json")
        broken.write_text(files[0].read_text(encoding="utf-8").replace('"library"', '"livery"', 1), encoding="utf-8")
        with self.assertRaisesRegex(AssertionError, "livery"):
            output_of(VENV / "bin/python3", "-c", VALIDATE, broken)

    def test_the_program_has_what_it_depends_on_what_is_linked_and_its_headers(self):
        bill = self.bill("alidade")
        used = {one["name"]: one["properties"][0]["value"] for one in bill["components"]}
        loaded = {name for name, how in used.items() if how == "loaded"}
        # Or what stands in for it on this machine, as ATLAS does for LAPACK.
        for text in output_of("dpkg-query", "-W", "-f", "${Provides}\n", *sorted(loaded)).splitlines():
            loaded |= set(re.findall(r"[a-z][a-z0-9.+-]+", text))
        for wanted in output_of("dpkg-deb", "--field", self.bills["alidade"][0], "Depends").split(", "):
            alternatives = {one.split()[0] for one in wanted.split(" | ")}
            if alternatives != {"adduser"}:
                self.assertTrue(alternatives & loaded, wanted)
        for name, how in (("libceres-dev", "linked statically"), ("libeigen3-dev", "headers"), ("nlohmann-json3-dev", "headers")):
            self.assertEqual(used[name], how)
        # Behind others: nobody links it.
        self.assertEqual(used["libgfortran5"], "loaded")
        self.assertNotIn("libgtest-dev", used)

    def test_versions_are_those_that_dpkg_has_installed(self):
        for name in self.bills:
            for one in self.bill(name)["components"]:
                self.assertIn(one["version"], output_of("dpkg-query", "-W", "-f", "${Version}\n", one["name"]).split())
                self.assertRegex(one["purl"], rf"^pkg:deb/debian/{re.escape(one['name'].replace('+', '%2B'))}@")

    def test_names_the_package_itself_and_each_thing_once(self):
        for name, (deb, _) in self.bills.items():
            bill = self.bill(name)
            self.assertEqual(bill["metadata"]["component"]["hashes"][0]["content"], hashlib.sha256(deb.read_bytes()).hexdigest())
            names = [one["name"] for one in bill["components"]]
            self.assertEqual(names, sorted(set(names)))
            for one in bill["dependencies"]:
                self.assertLessEqual(set(one["dependsOn"]), set(names))

    def test_are_the_same_again(self):
        deb, file = self.bills["alidade-dev"]
        before = file.read_bytes()
        output_of(PROJECT / "scripts/sbom", deb, BUILD, env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000", "TZ": "Asia/Tokyo"})
        self.assertEqual(file.read_bytes(), before)


if __name__ == "__main__":
    PACKAGES, BUILD, VENV = (pathlib.Path(word).resolve() for word in sys.argv[1:4])
    del sys.argv[1:4]
    unittest.main(argv=[sys.argv[0], "-v"])
