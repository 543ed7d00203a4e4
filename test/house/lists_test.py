#!/usr/bin/env python3
"""Lists that nothing else compares: is each source built, does each type of video keep the contract, is each scheme's name looked up,
is each value of the API described?"""
import pathlib
import re
import unittest

import yaml

TOP = pathlib.Path(__file__).resolve().parents[2]
ROOMS = ("core", "platform", "edge_app", "ros_wrapper")


def files(pattern, *rooms):
    """Paths below the top."""
    return [path.relative_to(TOP) for room in rooms for path in sorted((TOP / room).rglob(pattern))]


def read(path):
    return (TOP / path).read_text(encoding="utf-8")


class Sources(unittest.TestCase):
    def test_are_built(self):
        """Each is named in a CMakeLists.txt of its folder or of one above: a file that is not is neither built nor missed."""
        named = {path.parent: {name.rsplit("/", 1)[-1] for name in re.findall(r"[\w./-]+\.cpp\b", read(path))}
                 for path in files("CMakeLists.txt", *ROOMS, "test")}
        sources = files("*.cpp", *ROOMS) + files("*_test.cpp", "test")
        self.assertGreater(len(sources), 300)

        def is_named(source):
            names = {name for folder in source.parents for name in named.get(folder, ())}
            # alidade_files_of_heads() has the end of a name: _protocol.cpp.
            return source.name in names or any(source.name.endswith(name) for name in names if name.startswith("_"))

        lost = [str(source) for source in sources if not is_named(source)]
        self.assertFalse(lost, "in no CMakeLists.txt of their folders: " + ", ".join(lost))


class VideoTypes(unittest.TestCase):
    def setUp(self):
        config = read("edge_app/config/video_config.cpp")
        self.types = re.findall(r'\{VideoConfig::Type::k\w+, "(\w+)"', config)
        self.schemes = re.findall(r'"(\w+)://"', config)
        self.assertGreater(len(self.types), 3)
        self.assertGreater(len(self.schemes), 3)

    def test_keep_the_contract_of_sources(self):
        cases = set()
        for path in files("*.cpp", "test"):
            text = read(path)
            if '"test/platform/video/frame_source_contract.h"' in text:
                cases.update(re.findall(r'\{"(\w+)"|INSTANTIATE_TEST_SUITE_P\(\s*(\w+)', text))
        names = [name.lower() for pair in cases for name in pair if name]
        for one in self.types:
            self.assertTrue(any(name.startswith(one) for name in names), f"FrameSourceContract has no case whose name begins with {one}")

    def test_are_looked_up_where_nobody_waits(self):
        tested = read("test/system/resolver_test.py")
        for scheme in self.schemes:
            if scheme != "rtp":  # an address of this machine or of a group
                self.assertIn(f'"{scheme}"', tested, "test/system/resolver_test.py: test_of_a_camera")


class Answers(unittest.TestCase):
    """Of HTTP: what an object inside an answer holds is described. test/system/http_test.py asks that of the answer itself only."""

    def setUp(self):
        self.description = yaml.safe_load(read("edge_app/output/openapi.yaml"))

    def described(self, schema, seen):
        """The names of all members, also of what it refers to."""
        if isinstance(schema, list):
            return set().union(*(self.described(part, seen) for part in schema))
        if not isinstance(schema, dict):
            return set()
        names = set(schema.get("properties", ()))
        if isinstance(schema.get("required"), list):
            names.update(schema["required"])
        name = str(schema.get("$ref", "")).rpartition("/")[2]
        if name and name not in seen:
            seen.add(name)
            names |= self.described(self.description["components"]["schemas"].get(name), seen)
        return names.union(*(self.described(part, seen) for part in schema.values()))

    def check(self, schema, sources):
        described = self.described(schema, set())
        for source in sources:
            said = set(re.findall(r'(?:\{|\[)"([a-z_0-9]+)"[],]', read(source)))
            self.assertTrue(said, source)
            missing = said - described
            self.assertFalse(missing, f"{source}: openapi.yaml does not describe " + ", ".join(sorted(missing)))

    def test_status_is_described(self):
        self.check(self.description["components"]["schemas"]["Status"],
                   ("edge_app/output/service_status.cpp", "edge_app/output/scene_json.cpp", "edge_app/output/clock_pair.cpp"))

    def test_other_json_is_described(self):
        self.check(self.description, [*files("*_json.cpp", "edge_app/output"),
                                      *(f"edge_app/output/{name}.cpp" for name in ("http_api", "pixel_query", "status_page"))])


if __name__ == "__main__":
    unittest.main()
