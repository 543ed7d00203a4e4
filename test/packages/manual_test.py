#!/usr/bin/env python3
"""The manual page knows every command and option of the program, and man has nothing to say against it.

    manual_test.py ALIDADE      the executable
"""
import pathlib
import re
import subprocess
import sys
import unittest

ALIDADE = ""
PAGE = pathlib.Path(__file__).resolve().parents[2] / "edge_app/packaging/alidade.1"


def help_of(*command):
    return subprocess.run([ALIDADE, *command, "--help"], check=True, capture_output=True, text=True).stdout


def options(text):
    return set(re.findall(r"^  (?:(-\w),)?(--[\w-]+)", text, re.M))


def commands(*above):
    """`map build` for a command with commands of its own."""
    for name in re.findall(r"^  ([\w-]+) ", help_of(*above).partition("Subcommands:")[2], re.M):
        below = list(commands(*above, name))
        yield from below or [" ".join((*above, name))]


class Manual(unittest.TestCase):
    def setUp(self):
        self.page = PAGE.read_text(encoding="utf-8")
        self.commands = list(commands())

    def section(self, command):
        found = re.search(rf"^\.SS alidade {re.escape(command)}$(.*?)^\.S[SH] ", self.page.replace("\\-", "-"), re.M | re.S)
        self.assertIsNotNone(found, f"no section on alidade {command}")
        return found.group(1)

    def test_has_every_command_and_no_other(self):
        self.assertGreaterEqual(len(self.commands), 5)
        self.assertEqual(set(self.commands), set(re.findall(r"^\.SS alidade ([\w -]+)$", self.page.replace("\\-", "-"), re.M)))

    def test_has_every_option_of_each_command_and_no_other(self):
        for command in self.commands:
            text = self.section(command)
            known = options(help_of(*command.split())) - {("-h", "--help")}
            self.assertTrue(known)
            described = set(re.findall(r"^\.TP\n\.\w+ (?:(-\w)\b.*?)?(--[\w-]+)", text, re.M))
            with self.subTest(command=command):
                self.assertEqual(known, described)

    def test_has_the_options_of_the_program(self):
        text = self.page.partition(".SH OPTIONS")[2].replace("\\-", "-")
        for pair in options(help_of()):
            for option in filter(None, pair):
                self.assertIn(option, text)

    def test_is_set_without_a_warning(self):
        done = subprocess.run(["man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", PAGE], check=False, text=True,
                              stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env={"LC_ALL": "C.UTF-8", "MANWIDTH": "80",
                                                                                     "PATH": "/usr/bin:/bin"})
        self.assertEqual((done.returncode, done.stderr), (0, ""))


if __name__ == "__main__":
    ALIDADE = sys.argv[1]
    unittest.main(argv=[sys.argv[0], "-v"])
