"""The tests of a program, read from its sources: no build is needed to see that a filter takes none of them."""
import fnmatch
import re

from .catalogue import ListError

COMMAND = re.compile(r"^[ \t]*(\w+)\s*\(([^()]*(?:\([^()]*\)[^()]*)*)\)", re.M)
TEST = re.compile(r"^(TEST|TEST_F|TEST_P|TYPED_TEST|TYPED_TEST_P)\(\s*(\w+)\s*,\s*(\w+)\s*\)", re.M)
INSTANCE = re.compile(r"^INSTANTIATE_TEST_SUITE_P\(\s*(\w*)\s*,\s*(\w+)", re.M)
TYPED_INSTANCE = re.compile(r"^INSTANTIATE_TYPED_TEST_SUITE_P\(\s*(\w+)\s*,\s*(\w+)", re.M)
INCLUDED = re.compile(r'^#include "(test/[^"]+)"', re.M)


def takes(wanted, name):
    """Whether a filter of gtest's form takes the test of that name."""
    take, _, leave = wanted.partition("-")
    return (any(fnmatch.fnmatchcase(name, one) for one in (take or "*").split(":"))
            and not (leave and any(fnmatch.fnmatchcase(name, one) for one in leave.split(":"))))


def words_of(text, variables):
    """The words of a CMake command, variables of its file replaced."""
    for word in re.sub(r"#[^\n]*", "", text).split():
        name = re.fullmatch(r"\$\{(\w+)\}", word)
        yield from variables.get(name[1], []) if name else [word]


def sources_of(top, cmake_lists):
    """Files by program, of alidade_test() and add_executable(); what stands under a condition is taken as there."""
    programs = {}
    for name in cmake_lists:
        variables = {}
        folder = (top / name).parent
        for command, text in COMMAND.findall((top / name).read_text(encoding="utf-8")):
            first, *words = list(words_of(text, variables)) or [""]
            if command == "set":
                variables[first] = words
            elif command == "list" and first == "APPEND" and words:
                variables.setdefault(words[0], []).extend(words[1:])
            elif command == "alidade_files_of_heads":
                # CMake refuses a file of that form which is of no head.
                prefix, suffix = (word.strip('"') for word in words)
                variables[first] = sorted(str(file.relative_to(folder)) for file in folder.glob(f"{prefix}*{suffix}"))
            elif command in ("alidade_test", "add_executable"):
                files = [folder / word.replace("${PROJECT_SOURCE_DIR}", str(top)) for word in words if word.endswith(".cpp")]
                programs.setdefault(first, []).extend(file for file in files if file.is_file())
    return programs


def tests_in(text):
    """Names as gtest gives them; the first of a test's parameters or types stands for all."""
    prefixes = {}
    for prefix, suite in INSTANCE.findall(text) + TYPED_INSTANCE.findall(text):
        prefixes.setdefault(suite, []).append(prefix)
    for kind, suite, case in TEST.findall(text):
        if kind in ("TEST", "TEST_F"):
            yield f"{suite}.{case}"
        elif kind == "TYPED_TEST":
            yield f"{suite}/0.{case}"
        else:
            for prefix in prefixes.get(suite, []):
                instance = f"{prefix}/{suite}" if prefix else suite
                yield f"{instance}.{case}/0" if kind == "TEST_P" else f"{instance}/0.{case}"


class Suites:
    """Tests by program, of a tree."""

    def __init__(self, top, names):
        self.top = top
        self.sources = sources_of(top, [name for name in names if name.rsplit("/", 1)[-1] == "CMakeLists.txt"])
        self.known = {}

    def tests(self, program):
        if program not in self.sources:
            raise ListError(f"{program}: no CMakeLists.txt has such a program")
        if program not in self.known:
            texts = [file.read_text(encoding="utf-8") for file in self.sources[program]]
            shared = {self.top / path for text in texts for path in INCLUDED.findall(text)}
            texts += [file.read_text(encoding="utf-8") for file in sorted(shared) if file.is_file()]
            self.known[program] = list(tests_in("\n".join(texts)))
        return self.known[program]

    def check(self, mutants):
        """Each part of each filter should take a test; raises one ListError that names all that take none."""
        problems = {}
        for mutant in mutants:
            programs = mutant.tests + mutant.then
            names = [name for program in programs for name in self.tests(program)]
            for part in mutant.filter.replace("-", ":").split(":"):
                if part and not any(takes(part, name) for name in names):
                    problems.setdefault(f"{mutant.room}.yaml: filter {part} takes no test of {', '.join(programs)}", []).append(mutant.id)
        if problems:
            raise ListError("\n".join(f"{problem} ({', '.join(ids)})" for problem, ids in problems.items()))
