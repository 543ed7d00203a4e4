#!/usr/bin/env python3
"""Does docs/glossary.md have every type with Lens, Zoom or Calibration in its name, no type that is gone, and the room of each?"""
import pathlib
import re
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
DECLARED = re.compile(r"^\s*(?:struct|class|enum class|enum|using) +(\w+)(?: final)?(?: *[:{=]|$)", re.MULTILINE)
WORDS = ("Lens", "Zoom", "Calibration")


def declared():
    """The names of all types in headers, nested ones included, with the folders of each."""
    folders = {}
    for room in ("core", "edge_app", "platform"):
        for header in (TOP / room).rglob("*.h"):
            for name in DECLARED.findall(header.read_text(encoding="utf-8")):
                folders.setdefault(name, set()).add(header.parent.relative_to(TOP))
    return folders


def explained():
    """The types in the first column of the glossary's tables, with the line and the room of each."""
    lines = (TOP / "docs/glossary.md").read_text(encoding="utf-8").splitlines()
    return [(name, number, line.split("|")[3].strip(" `")) for number, line in enumerate(lines, 1) if line.startswith("| `")
            for name in re.findall(r"`(\w+)`", line.split("|")[1])]


class Glossary(unittest.TestCase):
    def test_has_every_type_of_these_words(self):
        wanted = {name for name in declared() if any(word in name for word in WORDS)}
        self.assertGreater(len(wanted), 50)
        missing = wanted - {name for name, _, _ in explained()}
        self.assertFalse(missing, f"docs/glossary.md lacks {', '.join(sorted(missing))}")

    def test_has_no_type_that_is_not_in_a_header(self):
        types = declared()
        gone = [f"docs/glossary.md:{line}: no header declares {name}" for name, line, _ in explained() if name not in types]
        self.assertFalse(gone, "\n".join(gone))

    def test_names_the_room_of_each_type(self):
        types = declared()
        wrong = [f"docs/glossary.md:{line}: {name} is in {', '.join(sorted(map(str, types[name])))}, not in {room}"
                 for name, line, room in explained()
                 if name in types and not any(pathlib.Path(room) in (folder, *folder.parents) for folder in types[name])]
        self.assertFalse(wrong, "\n".join(wrong))

    def test_has_each_type_once(self):
        names = [name for name, _, _ in explained()]
        twice = sorted({name for name in names if names.count(name) > 1})
        self.assertFalse(twice, f"docs/glossary.md has {', '.join(twice)} twice")


if __name__ == "__main__":
    unittest.main()
