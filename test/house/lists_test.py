#!/usr/bin/env python3
"""Lists that nothing else compares: is each source built, does each type of link keep the contract, is each scheme's name looked up, has
each section and each kind that a configuration can name its line in the test of the examples, and each kind and key a seed of the fuzzer,
is each kind of detector in the prose that lists them, is each value and route of the API described and given what it tells, has the page
a sentence for all that a calibration does and needs?"""
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


def detector_kinds():
    """In the order of their rows."""
    return re.findall(r'\{DetectorKind::k\w+, "(\w+)"', read("edge_app/tracking/detector_kinds.h"))


class DetectorKinds(unittest.TestCase):
    def setUp(self):
        self.kinds = detector_kinds()
        self.assertGreater(len(self.kinds), 2)

    def test_are_in_prose(self):
        headers = [(path, read(path).split("#include")[0]) for path in ("edge_app/tracking/built_in_detectors.h",
                                                                        "edge_app/config/detectors_config.h")]
        rows = [(path, "".join(line for line in read(path).splitlines() if line.startswith(begin))) for path, begin in
                (("edge_app/tracking/README.md", "| `built_in_detectors.h` |"), ("ARCHITECTURE.md", "| `core/detection/` |"),
                 ("core/README.md", "| [`detection/`]"), ("edge_app/config/README.md", "| built-in detectors"))]
        for path, text in headers + rows:
            for kind in self.kinds:
                self.assertRegex(text, rf"\b{kind}\b", f"{path}: where it lists the detectors, no {kind}")

    def test_are_in_the_order_in_which_they_look(self):
        """The last row looks first."""
        text = read("edge_app/tracking/built_in_detectors.h").split("#include")[0]
        told = re.findall(rf"\b({'|'.join(self.kinds)})\b", text)
        self.assertEqual(list(dict.fromkeys(told)), self.kinds[::-1], "edge_app/tracking/built_in_detectors.h, first lines")


WHERE_SECTIONS = "test/edge_app/config/config_test.cpp, `sections` of TheExamplesShowEveryKey"
SEEDS = "test/fuzz/corpus/config"


def sections_of_the_examples():
    text = read("test/edge_app/config/config_test.cpp")
    begin = text.index("TheExamplesShowEveryKey")
    return text[begin:text.index("\nTEST", begin)]


def seeds():
    return [path.read_text(encoding="utf-8", errors="replace") for path in sorted((TOP / SEEDS).iterdir())]


def keys_of_example(path):
    """(section, key) of each line, commented out or not, as TheExamplesShowEveryKey takes them: keys of a section within a section count
    as the outer one's."""
    keys, section = set(), ""
    for line in read(path).splitlines():
        line = line[2:] if line.startswith("# ") else line
        if match := re.match(r"([ #]*)([a-z_0-9]+):", line):
            section = section if match[1] else match[2]
            keys.update({(section, match[2])} if match[1] else ())
    return keys


def keys_of_seed(text):
    def within(section, content):
        pairs = content.items() if isinstance(content, dict) else ()
        return {(section, key) for key, _ in pairs}.union(*(within(section, inner) for _, inner in pairs))

    try:
        top = yaml.safe_load(text)
    except yaml.YAMLError:
        return set()  # a seed of what is no configuration
    return set().union(*(within(section, content) for section, content in top.items())) if isinstance(top, dict) else set()


class ConfiguredKeys(unittest.TestCase):
    def test_of_each_section_are_in_the_test_of_the_examples(self):
        """Which then shows that an example has each key of the section."""
        sections = re.findall(r'top\.section\("(\w+)"\)', read("edge_app/config/config.cpp"))
        self.assertGreater(len(sections), 8)
        for section in sections:
            self.assertTrue(f'{{"{section}", "{{' in sections_of_the_examples(), f"{WHERE_SECTIONS}: no {section}")

    def test_have_a_seed_of_the_fuzzer(self):
        shown = set().union(*(keys_of_example(path) for path in files("*.yaml", "edge_app/examples")))
        self.assertGreater(len(shown), 100)
        missing = shown - set().union(*map(keys_of_seed, seeds()))
        self.assertFalse(missing, f"{SEEDS}/every_key or another seed: no " + ", ".join(sorted(map(".".join, missing))))


class ConfiguredKinds(unittest.TestCase):
    def setUp(self):
        self.kinds = {
            "video": re.findall(r'\{VideoConfig::Type::k\w+, "(\w+)"', read("edge_app/config/video_config.cpp")),
            "pan_tilt": pan_tilt_types() + re.findall(r'\{HeadType::k\w+, "(\w+)"', read("platform/pan_tilt/heads.h")),
            "detectors": detector_kinds()}
        for section, kinds in self.kinds.items():
            self.assertGreater(len(kinds), 2, section)

    def assert_all(self, patterns, texts, where):
        """patterns: of a section whose kinds are values of `type`; of `detectors`, whose kinds are keys."""
        for section, kinds in self.kinds.items():
            for kind in kinds:
                pattern = patterns[section == "detectors"].replace("SECTION", section).replace("KIND", kind)
                self.assertTrue(any(re.search(pattern, text, re.MULTILINE) for text in texts), f"{where}: no {section} with {kind}")

    def test_have_a_line_in_the_test_of_the_examples(self):
        self.assert_all((r'\{"SECTION", "\{type: KIND\b', r'\{"SECTION", "\{KIND: '), [sections_of_the_examples()], WHERE_SECTIONS)

    def test_have_a_seed_of_the_fuzzer(self):
        self.assert_all((r"^SECTION:\s+\{?type: KIND\b", r"^SECTION:(\n  .*)*\n  KIND:|^SECTION: .*\bKIND: "), seeds(), SEEDS)


class PageWords(unittest.TestCase):
    """As StatusPage.SaysInWordsWhatEachStatusMeans asks of a record's status."""

    def test_for_what_a_calibration_does_and_needs(self):
        code, page = read("edge_app/record/published_calibration.cpp"), read("edge_app/output/page/words.js")
        for kind, constant in (("CalibrationActivity", "kActivities"), ("CalibrationNeed", "kNeeds")):
            told = set(re.findall(rf'case {kind}::\w+:\s+return "(.+)";', code))
            if kind == "CalibrationNeed":
                told |= set(re.findall(r'case HelpfulMotion::\w+:\s+return "(.+)";', read("core/calibration/calibration_goals.cpp")))
            begin = page.index(f"export const {constant} = {{")
            said = set(re.findall(r"^  '?(.+?)'?:(?:$| ')", page[begin:page.index("\n}", begin)], re.MULTILINE))
            self.assertGreater(len(told), 4)
            self.assertEqual(told, said, f"edge_app/output/page/words.js, {constant}, has not the words of published_calibration.cpp")


class Activities(unittest.TestCase):
    def test_are_in_the_metrics_and_in_the_list_of_fields(self):
        code = dict(re.findall(r'case CalibrationActivity::(\w+):\s+return "(.+)";', read("edge_app/record/published_calibration.cpp")))
        self.assertGreater(len(code), 4)
        metrics = set(re.findall(r"CalibrationActivity::(\w+)", read("edge_app/output/service_metrics.cpp")))
        self.assertEqual(set(code), metrics, "edge_app/output/service_metrics.cpp, alidade_calibration_activity")
        field = next(field for field in yaml.safe_load(read("edge_app/record/record_fields.yaml")) if field["name"] == "calibration")
        self.assertEqual(set(code.values()), {str(word) for word in field["enum"]}, "edge_app/record/record_fields.yaml, calibration")


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

    def test_routes_are_described(self):
        routes = {(method, path + ("{file}" if below else "")) for source in files("*.cpp", "edge_app/output")
                  for method, below, path in re.findall(r'server->(get|post)(_below)?\(\s*"(/[^"]*)"', read(source))}
        self.assertGreater(len(routes), 15)
        described = {(method, path) for path, methods in self.description["paths"].items() for method in methods}
        self.assertEqual(routes, described, "the routes of edge_app/output are not the paths of openapi.yaml")

    def test_what_they_come_from_is_handed_over(self):
        """A handler takes an empty member for something that is switched off."""
        struct = re.search(r"struct HttpApiSources \{(.*?)\n\};", read("edge_app/output/http_api.h"), re.DOTALL)[1]
        members = re.findall(r"(\w+)(?: = [^;]+)?;", re.sub(r"//.*", "", struct))
        self.assertGreater(len(members), 12)
        given = set(re.findall(r"\bsources\.(\w+) = ", read("edge_app/commands/run.cpp")))
        self.assertFalse(set(members) - given, "edge_app/commands/run.cpp: run_live() sets of HttpApiSources no " +
                         ", ".join(sorted(set(members) - given)))


if __name__ == "__main__":
    unittest.main()
