#!/usr/bin/env python3
"""The manual for users (docs/manual): is it plain, does it name only what there is, and has its reference all that there is?"""
import functools
import json
import pathlib
import re
import subprocess
import sys
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
MANUAL = TOP / "docs/manual"
sys.path.insert(0, str(TOP / "scripts"))
sys.dont_write_bytecode = True
from reference import commands, cpp, findings, http, keys, messages  # noqa: E402: after the line above

MOST_WORDS_IN_THE_MEAN = 18
MOST_WORDS = 35


def read(path):
    return (TOP / path).read_text(encoding="utf-8")


def pages():
    """{path below the manual: text}, without what is for its writers."""
    found = {path.relative_to(MANUAL).as_posix(): path.read_text(encoding="utf-8") for path in sorted(MANUAL.rglob("*.md"))}
    del found["README.md"]
    return found


def blocks(text):
    """(language, class, content) of each block of code, in order."""
    for fence in re.finditer(r"^```(?:\{code-block\} )?(\w*)\n(?::class: (\w+)\n)?(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        yield fence[1], fence[2] or "", fence[3]


def without_blocks(text):
    return re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL)


@functools.lru_cache(None)
def said_by_the_program():
    """What a cell may quote whatever its length: lines of the log, findings, and what --help says of an option."""
    helps = {commands.plain(text.strip()) for _, _, rows in commands.all_commands() for _, text, _ in rows}
    return helps | set(messages.log_lines()) | {text for _, texts in findings.sites() for _, text in texts}


def passages(text):
    """(whether it is running text, text) of what is read in one go: a paragraph, an item of a list; a cell of a table, a heading."""
    text = re.sub(r"<!--.*?-->\n?", "", without_blocks(text), flags=re.DOTALL)
    for paragraph in re.split(r"\n\s*\n", text):
        lines = paragraph.strip().split("\n")
        if lines[0].startswith("|"):
            for line in lines:
                cells = (cell.strip() for cell in re.split(r"(?<!\\)\|", line))
                yield from ((False, cell) for cell in cells if not re.fullmatch(r"[-: ]*", cell) and cell not in said_by_the_program())
            continue
        item = ""
        for line in lines:
            if re.match(r"\s*(?:[-*]|\d+\.) |#", line):
                yield not item.strip().startswith("#"), item
                item = ""
            item += " " + line.strip()
        yield not item.strip().startswith("#"), item


def sentences(text):
    """(whether it is running text, sentence, its words)"""
    for running, passage in passages(text):
        passage = re.sub(r"\{\w+\}`([^<`]*)<[^>]*>`", r"\1", passage)
        passage = re.sub(r"`[^`]*`", "code", passage)
        passage = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", passage)
        for sentence in re.split(r"(?<=[.!?])\s+", passage):
            words = re.findall(r"[\w'./%+-]*\w[\w'./%+-]*", sentence)
            if words:
                yield running, sentence.strip(), len(words)


# Keys of which the example shows another value than the default; and what says the default of one that no `value_or()` has.
SHOWN_OTHERWISE = {("output", "csv")}
SAID_ELSEWHERE = {("output", "json"): ("edge_app/config/config.h", "stdout_format = OutputFormat::kJson;", "true")}


def of_examples():
    """((section, key), value, remark) of each line of the example that shows the defaults, commented out or not."""
    sections = {section.rsplit(".", 1)[1]: section for section, _ in keys.said() if "." in section}
    top = inner = ""
    for line in read("edge_app/examples/alidade.yaml").splitlines():
        line = line[2:] if line.startswith("# ") else line
        match = re.match(r"( *)(?:# )?( *)([a-z_0-9]+):(?: +(\[[^]]*\]|[^#]*?))?(?: +#\s*(.*))?$", line)
        if not match:
            continue
        depth, name, value, remark = len(match[1] + match[2]), match[3], (match[4] or "").strip(), match[5] or ""
        if depth == 0:
            top = inner = name
        elif not value:
            inner = sections.get(name, inner)
        else:
            yield (inner if depth > 2 else top, name), value, remark


def first_word(default):
    return re.split(r"[ ,;(]", default)[0]


def same(one, other):
    try:
        return float(one) == float(other)
    except ValueError:
        return one == other


class Language(unittest.TestCase):
    def setUp(self):
        self.assertGreater(len(pages()), 40)

    def test_is_plain(self):
        wrong = []
        for page, text in pages().items():
            found = list(sentences(text))
            lengths = [length for running, _, length in found if running]
            mean = sum(lengths) / max(1, len(lengths))
            if mean >= MOST_WORDS_IN_THE_MEAN:
                wrong.append(f"{page}: {mean:.1f} words in the mean sentence; expected less than {MOST_WORDS_IN_THE_MEAN}")
            wrong += [f"{page}: {length} words, at most {MOST_WORDS}: {sentence[:70]}..." for _, sentence, length in found if length > MOST_WORDS]
        self.assertFalse(wrong, "\n".join(wrong))


class Links(unittest.TestCase):
    """Those of Markdown are shown by manual_names_test.py; here those of MyST."""

    def test_of_contents_lead_to_all_pages(self):
        listed = {"index.md"}
        for page, text in pages().items():
            for contents in re.findall(r"^```\{toctree\}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
                for line in contents.splitlines():
                    if line and not line.startswith(":"):
                        listed.add((pathlib.PurePosixPath(page).parent / (line + ".md")).as_posix())
        self.assertEqual(set(pages()), listed, "the contents and the pages differ")

    def test_of_files_lead_somewhere(self):
        seen = 0
        for page, text in pages().items():
            for target in re.findall(r"\{download\}`[^<]*<([^>]*)>`|^```\{literalinclude\} (\S+)", text, re.MULTILINE):
                seen += 1
                self.assertTrue((MANUAL / page).parent.joinpath(target[0] or target[1]).is_file(), f"{page}: {target}")
        self.assertGreater(seen, 2)


class Reference(unittest.TestCase):
    def test_is_as_the_code_has_it(self):
        """Keys with type, unit and range, commands and options, endpoints, metrics, words and lines that users meet."""
        done = subprocess.run([TOP / "scripts/generate-manual", "--check"], capture_output=True, text=True, check=False)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_has_each_status(self):
        words = set(re.findall(r'case RecordStatus::\w+:\s+return "(.+?)";', read("edge_app/record/record_status.h")))
        self.assertGreater(len(words), 15)
        said = set(re.findall(r"^\| `([^`]+)` \| (?:OE|PT|none)", pages()["reference/statuses.md"], re.MULTILINE))
        modes = {"OE", "PT", "none"}
        self.assertEqual(words, said - modes, "reference/statuses.md has not the statuses of record_status.h")

    def test_has_each_field(self):
        for lists, page in ((("edge_app/record/record_fields.yaml",), "records"),
                            (("edge_app/tracking/target_fields.yaml", "edge_app/tracking/target_list_fields.yaml"), "targets")):
            for one in lists:
                for name in re.findall(r"^- name: (\w+)", read(one), re.MULTILINE):
                    self.assertIn(f"| `{name}` |", pages()[f"reference/{page}.md"], f"{one}: {name}")

    def test_has_each_topic(self):
        listed = re.search(r"kTopics> kNames = \{(.*?)\};", read("edge_app/output/mqtt_publisher.cpp"))[1]
        topics = re.findall(r'"(\w+)"', listed)
        self.assertGreater(len(topics), 2)
        for topic in topics:
            self.assertIn(f"`PREFIX/{topic}`", pages()["reference/mqtt.md"])

    def test_has_each_kind_of_link_and_detector(self):
        text = pages()["reference/links.md"] + pages()["reference/configuration.md"]
        for section in ("video", "pan_tilt"):
            for word in re.findall(r"`(\w+)`", keys.tables()[section].split("| `type` |")[1].splitlines()[0]):
                self.assertRegex(pages()["reference/links.md"], rf"(?m)^## {section}: .*\b{word}\b", word)
        for word in re.findall(r'\{DetectorKind::k\w+, "(\w+)"', read("edge_app/tracking/detector_kinds.h")):
            self.assertIn(f"### {word}\n", text)

    def test_has_the_defaults_of_the_examples(self):
        """Numbers, words, true and false. The examples' values are held against the code by ConfigTest. A remark that begins with a bracket
        says in it what holds without the key; in others a bracket may say it."""
        listed, seen, wrong = keys.said(), 0, []
        kinds = keys.read_by_code()
        for where, value, remark in of_examples():
            if where not in listed or where in SHOWN_OTHERWISE:
                continue
            default = first_word(listed[where][0])
            said = re.match(r"\((?:none: )?([\w.%'-]+)", remark) or re.match(r"[\w/:, ]*\(([a-z-]+)[;)]", remark) or \
                re.search(r"left out: (\w+)$", remark)
            if said and kinds[where][0] == "text":  # what holds without it is told in words
                continue
            plain = re.fullmatch(r"-?[\d.]+(?:e-?\d+)?", value) or kinds[where][0] in ("word", "true or false")
            without = said[1] if said else value if plain else None
            if without is None or said is None and default in ("required", "none") and "none" in remark[:40]:
                continue
            seen += 1
            if not same(default, without):
                wrong.append(f"{'.'.join(where)}: {listed[where][0]} in keys.yaml, {without} in the example")
        self.assertGreater(seen, 80)
        self.assertFalse(wrong, "\n".join(wrong))

    def test_has_the_defaults_of_the_code(self):
        listed, kinds, code, seen, wrong = keys.said(), keys.read_by_code(), keys.defaults(), 0, []
        for where, (default, _, _) in listed.items():
            first, kind = first_word(default), kinds[where][0]
            words = re.findall(r"`(.*?)`", kinds[where][2])
            if kind == "word" and first not in (*words, "required"):
                wrong.append(f"{'.'.join(where)}: {default}; the code takes {', '.join(words)}")
            values = code.get(where, set()) - {""}
            if where in SAID_ELSEWHERE:
                file, text, value = SAID_ELSEWHERE[where]
                values = {value} if text in read(file) else set()
            if kind == "true or false" and not values and first != "required":
                wrong.append(f"{'.'.join(where)}: the code does not show its default")
            if not values or not (kind in ("word", "true or false") or re.match(r"-?[\d.]", first)):
                continue
            seen += 1
            if not any(same(first, value) for value in values):
                wrong.append(f"{'.'.join(where)}: {default} in keys.yaml, {' or '.join(sorted(values))} in the code")
        self.assertGreater(seen, 50)
        self.assertFalse(wrong, "\n".join(wrong))


class Findings(unittest.TestCase):
    """Of `alidade check`, and lines of the log: whole messages, and all that the code has."""

    def test_are_whole(self):
        rows = [text for _, texts in findings.sites() for _, text in texts] + list(messages.log_lines())
        self.assertGreater(len(rows), 90)
        wrong = [text for text in rows if not re.match(r"[\w…]", text) or re.search(r"[;,:(]$", text) or text.count("(") != text.count(")")]
        wrong += [text for text in rows if not re.search(r"[a-z]{3}", text)]
        self.assertFalse(wrong, "fragments: " + "; ".join(wrong))

    def test_are_as_many_as_the_code_adds(self):
        """Counted by their bare names, in all of the program."""
        there = 0
        for path in sorted((TOP / "edge_app").rglob("*")):
            if path.suffix in (".h", ".cpp") and path.name != "finding.h":
                text = cpp.text_of(path.relative_to(TOP).as_posix())
                there += len(re.findall(r"\badd_problem\b|\badd_advice\b|\bfindings(?:\.|->)(?:push|emplace)_back\b", text))
        found = list(findings.sites())
        self.assertGreater(there, 40)
        self.assertEqual(there, len(found), "scripts/reference/findings.py does not see each place")
        self.assertEqual([], [file for file, texts in found if not texts], "places without a text")

    def test_have_all_of_a_picture(self):
        said = pages()["reference/check-report.md"]
        for word in re.findall(r'"(the picture is [a-z]+)', read("edge_app/check/image_check.cpp")):
            self.assertIn(f"video …: {word}", said)


class Commands(unittest.TestCase):
    def test_have_only_options_that_there_are(self):
        known = {name: {one for option, _, _ in rows for one in option.split(",") if one.startswith("-")}
                 for name, _, rows in commands.all_commands()}
        self.assertGreater(len(known), 10)
        seen, wrong = 0, []
        for page, text in pages().items():
            lines = [line for language, _, content in blocks(text) if language == "sh" for line in content.splitlines()]
            lines += re.findall(r"`(alidade(?:-simulate)? [^`]+)`", without_blocks(text))
            for line in lines:
                match = re.match(r"(?:sudo )?(?:alidade (map \w+|[\w-]+)|(alidade-simulate))(.*)", line)
                if not match or match[1] in ("map",):
                    continue
                seen += 1
                name, rest = match[1] or match[2], re.sub(r"\s[|>#].*", "", match[3])
                if name not in known:
                    wrong.append(f"{page}: alidade {name}")
                    continue
                for option in re.findall(r"(?<=\s)(--?[a-z][\w-]*)", rest):
                    if option not in known[name] | {"--help"}:
                        wrong.append(f"{page}: alidade {name} {option}")
        self.assertGreater(seen, 50)
        self.assertFalse(wrong, "no such command or option: " + ", ".join(wrong))

    def test_has_the_virtual_camera_with_all_its_options(self):
        """Those that its --help shows; CLI11 adds -h and --help by itself."""
        there = re.findall(r'add_option\(\s*"([^"]+)"|set_version_flag\("([^"]+)"', read("test/simulator/main.cpp"))
        there = [one or version for one, version in there]
        self.assertGreater(len(there), 5)
        section = re.search(r"^## alidade-simulate\n(.*?)(?=^## |\Z)", pages()["reference/commands.md"], re.MULTILINE | re.DOTALL)[1]
        said = re.findall(r"^\| (`-.*?`) \|", section, re.MULTILINE)
        self.assertEqual(sorted(f"`{name.replace(',', '`, `')}`" for name in there), sorted(said))

    def test_says_which_options_are_required(self):
        text = r'"(?:[^"\\]|\\.)*"'
        needed = re.findall(rf'add_option\(\s*"(-[^"]+)"(?:[^;"]|{text})*->required\(\)', read("edge_app/commands/command_line.cpp"))
        said = re.findall(r"^\| (`-.*?`) \| yes \|", pages()["reference/commands.md"], re.MULTILINE)
        self.assertGreater(len(needed), 4)
        self.assertEqual(sorted(f"`{name.replace(',', '`, `')}`" for name in needed), sorted(said))

    def test_of_shells_can_be_read(self):
        for page, text in pages().items():
            for language, _, content in blocks(text):
                if language == "sh":
                    done = subprocess.run(["sh", "-n"], input=content, capture_output=True, text=True, check=False)
                    self.assertEqual(done.returncode, 0, f"{page}: {done.stderr}{content}")
                elif language == "python":
                    compile(content, page, "exec")


class Dashboard(unittest.TestCase):
    def test_asks_for_metrics_that_there_are(self):
        dashboard = json.loads((MANUAL / "files/alidade-dashboard.json").read_text(encoding="utf-8"))
        asked = [target["expr"] for panel in dashboard["panels"] for target in panel["targets"]]
        self.assertGreater(len(asked), 20)
        asked.append(pages()["how-to/grafana.md"])
        known = {name for name, _, _ in http.metrics()}
        for text in asked:
            for name in re.findall(r"\b(?:alidade|process)_[a-z_]+(?=[{\[ ])", text):
                self.assertIn(re.sub(r"_(bucket|sum|count)$", "", name) if name not in known else name, known, text)


if __name__ == "__main__":
    unittest.main()
