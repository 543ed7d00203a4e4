#!/usr/bin/env python3
"""Does docs/glossary.md have every type with Lens, Zoom or Calibration in its name, and no type that is not there any more?"""
import pathlib
import re
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
DECLARED = re.compile(r"^\s*(?:struct|class|enum class|enum|using) +(\w+)(?: final)?(?: *[:{=]|$)", re.MULTILINE)
WORDS = ("Lens", "Zoom", "Calibration")


def declared():
    """The names of all types in headers, nested ones included."""
    return {name for room in ("core", "edge_app", "platform") for header in (TOP / room).rglob("*.h")
            for name in DECLARED.findall(header.read_text(encoding="utf-8"))}


def explained():
    """The types in the first column of the glossary's tables, with the line of each."""
    lines = (TOP / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
    return [(name, number) for number, line in enumerate(lines, 1) if line.startswith("| `")
            for name in re.findall(r"`(\w+)`", line.split("|")[1])]


class Glossary(unittest.TestCase):
    def test_has_every_type_of_these_words(self):
        wanted = {name for name in declared() if any(word in name for word in WORDS)}
        self.assertGreater(len(wanted), 50)
        missing = wanted - {name for name, _ in explained()}
        self.assertFalse(missing, f"docs/glossary.md lacks {', '.join(sorted(missing))}")

    def test_has_no_type_that_is_not_in_a_header(self):
        types = declared()
        gone = [f"docs/glossary.md:{line}: no header declares {name}" for name, line in explained() if name not in types]
        self.assertFalse(gone, "\n".join(gone))

    def test_has_each_type_once(self):
        names = [name for name, _ in explained()]
        twice = sorted({name for name in names if names.count(name) > 1})
        self.assertFalse(twice, f"docs/glossary.md has {', '.join(twice)} twice")


if __name__ == "__main__":
    unittest.main()
