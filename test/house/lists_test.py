#!/usr/bin/env python3
"""Lists that nothing else compares: is each source built, does each type of video keep the contract, is each scheme's name looked up?"""
import pathlib
import re
import unittest

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


if __name__ == "__main__":
    unittest.main()
