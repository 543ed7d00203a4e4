#!/usr/bin/env python3
"""Do the functions and tests that READMEs and docs name exist, and stand where they say? Do their links lead somewhere?"""
import functools
import pathlib
import re
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ("core", "platform", "edge_app", "ros_wrapper", "test", "scripts")
CODE = (".h", ".cpp", ".py", ".js")
OTHERS = ("cv", "ceres", "std")  # libraries


@functools.lru_cache(None)
def sources():
    """The text of each source, by its path below the top."""
    paths = (path for room in ROOMS for path in sorted((TOP / room).rglob("*")) if path.suffix in CODE and "build" not in path.parts)
    return {path.relative_to(TOP).as_posix(): path.read_text(encoding="utf-8") for path in paths}


@functools.lru_cache(None)
def pages():
    """The text of each page, in one line, by its path."""
    pages = [*TOP.glob("*.md"), *(path for room in ("docs", *ROOMS) for path in sorted((TOP / room).rglob("*.md")))]
    return {path.relative_to(TOP).as_posix(): re.sub(r"\s*\n\s*", " ", path.read_text(encoding="utf-8")) for path in pages}


@functools.lru_cache(None)
def words():
    """Those of each source."""
    return {path: set(re.findall(r"\w+", text)) for path, text in sources().items()}


@functools.lru_cache(None)
def homes():
    """Of each class, enumeration and namespace, the files that declare it, without their endings."""
    homes = {}
    for path, text in sources().items():
        for name in re.findall(r"^\s*(?:class|struct|enum class|enum|namespace) (\w+)(?: final)?(?: *[:{]|$)", text, re.MULTILINE):
            homes.setdefault(name, set()).add(path.rsplit(".", 1)[0])
    return homes


@functools.lru_cache(None)
def tests():
    """Suite.Name, as gtest or ctest has it."""
    names = {f"{suite}.{name}" for path, text in sources().items() if path.startswith(("test/", "ros_wrapper/"))
             for suite, name in re.findall(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\)", text, re.MULTILINE)}
    lists = "\n".join(path.read_text(encoding="utf-8") for path in sorted((TOP / "test").rglob("CMakeLists.txt")))
    return names.union(re.findall(r"NAME (\w+\.\w+)", lists),
                       (f"System.{name}" for name in re.findall(r"alidade_(?:system|soak)_test\((\w+) ", lists)))


def anchors(page):
    """Of a page's headings, as GitHub makes them."""
    headings = re.findall(r"^#+ (.+)$", without_code((TOP / page).read_text(encoding="utf-8")), re.MULTILINE)
    headings = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading) for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in headings}


def without_code(text):
    return re.sub(r"```.*?```", "", text, flags=re.DOTALL)


class Names(unittest.TestCase):
    def setUp(self):
        self.assertGreater(len(sources()), 700)
        self.assertGreater(len(pages()), 60)

    def test_of_members_exist(self):
        """`Class::member` is in a file that begins as the one that declares the class, as orientation_step_zoom.cpp does."""
        wrong, seen = [], 0
        for page, text in pages().items():
            for name in re.findall(r"`((?:\w+::)+\w+)(?:\(\))?`", text):
                *_, kind, member = name.split("::")
                if kind in OTHERS:
                    continue
                seen += 1
                begins = tuple(homes().get(kind, ()))
                if not any(path.startswith(begins) and member in known for path, known in words().items()):
                    wrong.append(f"{page}: {name}")
        self.assertGreater(seen, 60)
        self.assertFalse(wrong, "no such members: " + ", ".join(wrong))

    def test_of_functions_exist(self):
        """`function()` is in some source."""
        known = set().union(*words().values())
        wrong = [f"{page}: {name}()" for page, text in pages().items() for name in re.findall(r"`(\w+)\(\)`", text) if name not in known]
        self.assertFalse(wrong, "no such functions: " + ", ".join(wrong))

    def test_stand_in_the_files_that_are_named(self):
        """`name` (`file.cpp`): the file is there, and has the name."""
        wrong, seen = [], 0
        for page, text in pages().items():
            for name, file in re.findall(r"`((?:\w+::)*\w+)(?:\(\))?` \(`([\w./-]+\.(?:h|cpp|py|js))`", text):
                seen += 1
                named = [path for path in sources() if path == file or path.endswith("/" + file)]
                if not any(name.rsplit("::", 1)[-1] in words()[path] for path in named):
                    wrong.append(f"{page}: {name} in {file}")
        self.assertGreater(seen, 40)
        self.assertFalse(wrong, "not there: " + ", ".join(wrong))

    def test_of_tests_exist(self):
        """`Suite.Name`, where there is such a suite; `Suite.Begin*`."""
        suites = {name.split(".")[0] for name in tests()}
        self.assertGreater(len(suites), 300)
        named = [(page, name) for page, text in pages().items() for name in re.findall(r"`([A-Z]\w+\.[A-Z]\w+\*?)`", text)
                 if name.split(".")[0] in suites]
        self.assertGreater(len(named), 40)
        wrong = [f"{page}: {name}" for page, name in named
                 if not (name in tests() or name.endswith("*") and any(one.startswith(name[:-1]) for one in tests()))]
        self.assertFalse(wrong, "no such tests: " + ", ".join(wrong))


class Links(unittest.TestCase):
    def test_lead_to_files_and_headings(self):
        wrong, seen = [], 0
        for page in pages():
            for link in re.findall(r"\]\(([^)\s]+)\)", without_code((TOP / page).read_text(encoding="utf-8"))):
                if re.match(r"\w+:", link):
                    continue
                seen += 1
                file, _, heading = link.partition("#")
                target = (TOP / page).parent / file if file else TOP / page
                if not target.exists() or heading and heading not in anchors(target.resolve().relative_to(TOP)):
                    wrong.append(f"{page}: {link}")
        self.assertGreater(seen, 250)
        self.assertFalse(wrong, "nothing there: " + ", ".join(wrong))


if __name__ == "__main__":
    unittest.main()
