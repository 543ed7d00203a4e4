#!/usr/bin/env python3
"""Lists that nothing else compares: is each source built, does each type of link keep the contract, is each scheme's name looked up, has
each kind that a configuration can name its line in the test of the examples, and a seed of the fuzzer, is each value of the API
described?"""
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


def contract_cases(texts):
    """The names of cases and suites in these tests, in small letters."""
    pairs = [pair for text in texts for pair in re.findall(r'\{"(\w+)"|INSTANTIATE_TEST_SUITE_P\(\s*(\w+)', text)]
    return [name.lower() for pair in pairs for name in pair if name]


def pan_tilt_types():
    """Without the heads on a line."""
    return re.findall(r'\{"(\w+)", Type::k\w+', read("edge_app/config/pan_tilt_config.cpp"))


class VideoTypes(unittest.TestCase):
    def setUp(self):
        config = read("edge_app/config/video_config.cpp")
        self.types = re.findall(r'\{VideoConfig::Type::k\w+, "(\w+)"', config)
        self.schemes = re.findall(r'"(\w+)://"', config)
        self.assertGreater(len(self.types), 3)
        self.assertGreater(len(self.schemes), 3)

    def test_keep_the_contract_of_sources(self):
        header = '"test/platform/video/frame_source_contract.h"'
        names = contract_cases(text for text in map(read, files("*.cpp", "test")) if header in text)
        for one in self.types:
            self.assertTrue(any(name.startswith(one) for name in names), f"FrameSourceContract has no case whose name begins with {one}")

    def test_are_looked_up_where_nobody_waits(self):
        tested = read("test/system/resolver_test.py")
        for scheme in self.schemes:
            if scheme != "rtp":  # an address of this machine or of a group
                self.assertIn(f'"{scheme}"', tested, "test/system/resolver_test.py: test_of_a_camera")


class PanTiltTypes(unittest.TestCase):
    def test_keep_the_contract_of_sources(self):
        """Heads on a line do by their rows in head_kinds.cpp."""
        names = contract_cases([read("test/platform/pan_tilt/pan_tilt_source_contract_test.cpp")])
        self.assertGreater(len(pan_tilt_types()), 3)
        for one in pan_tilt_types():
            if one != "none":
                self.assertTrue(any(name.startswith(one) for name in names), f"PanTiltSourceContract has no case whose name begins with {one}")


class ConfiguredKinds(unittest.TestCase):
    def setUp(self):
        self.kinds = {
            "video": re.findall(r'\{VideoConfig::Type::k\w+, "(\w+)"', read("edge_app/config/video_config.cpp")),
            "pan_tilt": pan_tilt_types() + re.findall(r'\{HeadType::k\w+, "(\w+)"', read("platform/pan_tilt/heads.h")),
            "detectors": re.findall(r'\{DetectorKind::k\w+, "(\w+)"', read("edge_app/tracking/detector_kinds.h"))}
        for section, kinds in self.kinds.items():
            self.assertGreater(len(kinds), 2, section)

    def assert_all(self, patterns, texts, where):
        """patterns: of a section whose kinds are values of `type`; of `detectors`, whose kinds are keys."""
        for section, kinds in self.kinds.items():
            for kind in kinds:
                pattern = patterns[section == "detectors"].replace("SECTION", section).replace("KIND", kind)
                self.assertTrue(any(re.search(pattern, text, re.MULTILINE) for text in texts), f"{where}: no {section} with {kind}")

    def test_have_a_line_in_the_test_of_the_examples(self):
        test = "TheExamplesShowEveryKey"
        text = read("test/edge_app/config/config_test.cpp")
        begin = text.index(test)
        self.assert_all((r'\{"SECTION", "\{type: KIND\b', r'\{"SECTION", "\{KIND: '), [text[begin:text.index("\nTEST", begin)]],
                        f"test/edge_app/config/config_test.cpp, `sections` of {test}")

    def test_have_a_seed_of_the_fuzzer(self):
        folder = "test/fuzz/corpus/config"
        seeds = [path.read_text(encoding="utf-8", errors="replace") for path in sorted((TOP / folder).iterdir())]
        self.assert_all((r"^SECTION:\s+\{?type: KIND\b", r"^SECTION:(\n  .*)*\n  KIND:|^SECTION: .*\bKIND: "), seeds, folder)


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
