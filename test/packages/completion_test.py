#!/usr/bin/env python3
"""What bash completes after `alidade`: every command and option of the program and no other, and what may follow them.

    completion_test.py ALIDADE      the executable
"""
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ALIDADE = ""
COMPLETION = pathlib.Path(__file__).resolve().parents[2] / "edge_app/packaging/alidade.bash-completion"
# `compopt` works only while bash completes: here it says nothing.
ASK = """
source "$1"; shift
compopt() { :; }
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
$(complete -p alidade | sed 's/.*-F \\([^ ]*\\).*/\\1/') alidade "${!#}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


def help_of(*command):
    return subprocess.run([ALIDADE, *command, "--help"], check=True, capture_output=True, text=True).stdout


def options(text):
    pairs = re.findall(r"^  (?:(-\w),)?(--[\w-]+)", text, re.M)
    return {name for pair in pairs for name in pair if name}


class Completion(unittest.TestCase):
    def offered(self, *words, folder=None):
        """For the words so far, the last of which is being typed."""
        done = subprocess.run(["bash", "--norc", "-eu", "-c", ASK, "bash", COMPLETION, "alidade", *words], cwd=folder,
                              check=False, capture_output=True, text=True)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return set(done.stdout.split())

    def setUp(self):
        self.commands = set(re.findall(r"^  ([\w-]+) ", help_of().partition("Subcommands:")[2], re.M))

    def test_offers_every_command(self):
        self.assertGreaterEqual(len(self.commands), 5)
        self.assertEqual(self.offered("") - {"--help", "--version"}, self.commands)
        self.assertEqual(self.offered("re"), {"record", "replay"})

    def test_offers_every_option_of_each_command_and_no_other(self):
        for command in self.commands:
            with self.subTest(command=command):
                self.assertEqual(self.offered(command, "-"), options(help_of(command)))
        self.assertEqual(self.offered("calibrate", "x", "--foc"), {"--focal-length"})

    def test_offers_what_a_map_can_be_asked_and_the_options_of_each(self):
        asked = set(re.findall(r"^  ([\w-]+) ", help_of("map").partition("Subcommands:")[2], re.M))
        self.assertGreaterEqual(len(asked), 4)
        self.assertEqual(self.offered("map", "") - {"-h", "--help"}, asked)
        for command in asked:
            with self.subTest(command=command):
                self.assertEqual(self.offered("map", command, "-"), options(help_of("map", command)))

    def test_offers_files_where_they_are_wanted_and_nothing_for_a_number(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "camera.yaml").touch()
            pathlib.Path(folder, "recording").mkdir()
            for words in (("run", "-c", ""), ("check", "--config", ""), ("replay", "x", "--calibration", ""), ("calibrate", "x", "--prior", ""), ("calibrate-shutter", ""),
                          ("plane", "fit", ""), ("plane", "fit", "x", "-o", "")):
                self.assertEqual(self.offered(*words, folder=folder), {"camera.yaml", "recording"})
            for words in (("replay", ""), ("calibrate", "re"), ("record", "-o", "")):
                self.assertEqual(self.offered(*words, folder=folder), {"recording"})
            self.assertEqual(self.offered("plane", "", folder=folder), {"fit"})
            self.assertEqual(self.offered("replay", "x", "--mode", "", folder=folder), {"OE", "PT"})
            self.assertEqual(self.offered("run", "--duration", "", folder=folder), set())
            self.assertEqual(self.offered("fly", "", folder=folder), set())


if __name__ == "__main__":
    ALIDADE = sys.argv[1]
    unittest.main(argv=[sys.argv[0], "-v"])
