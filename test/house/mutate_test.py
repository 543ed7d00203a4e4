#!/usr/bin/env python3
"""scripts/mutate must find what is planted: a mutant that a test kills, one that none notices, one that hangs, and lists that
do not fit the code."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOP / "scripts"))
from mutation import catalogue, instrument, suites  # noqa: E402: the path is set above

CMAKE = """
cmake_minimum_required(VERSION 3.18)
project(planted LANGUAGES CXX)
set(CMAKE_CXX_STANDARD 17)
enable_testing()
find_package(GTest REQUIRED)
add_executable(planted_test planted_test.cpp)
target_include_directories(planted_test PRIVATE ${CMAKE_SOURCE_DIR})
target_compile_options(planted_test PRIVATE -Wall -Wextra -Wconversion -Werror)
target_link_libraries(planted_test GTest::gtest_main)
add_test(NAME planted_test COMMAND planted_test)
"""
CODE = """
#pragma once
constexpr int kLegs = 4;
inline int area(int width, int height) {
  int sum = 0;
  for (int i = 0; i < height; ++i) {
    sum += width;
  }
  return sum;
}
inline int twice(int x) { return x + x; }
"""
TEST = """
#include <gtest/gtest.h>
#include <cstdlib>
#include "code/shape.h"
TEST(Area, IsTheProduct) { EXPECT_EQ(area(3, 2), std::getenv("SPOILED") == nullptr ? 6 : 7); }
TEST(Legs, AreFour) { EXPECT_EQ(kLegs, 4); }
"""
LIST = """
folder: code
tests: [planted_test]
files:
  shape.h:
    filter: Area.*
    mutants:
      killed: {original: sum += width;, mutated: sum += height;, breaks: a product has two factors}
      left-out: {original: sum += width;, mutated: "", breaks: it is summed}
      hangs: {original: ++i, mutated: i += 0, breaks: it ends}
      alive: {original: x + x, mutated: x - x, breaks: twice is a sum}
      explained-away: {original: sum += width;, mutated: sum -= width;, breaks: it adds, survives: nobody looks}
      explained: {original: x + x, mutated: 2 * x, breaks: twice, survives: it is the same}
      rebuilt: {original: constexpr int kLegs = 4, mutated: constexpr int kLegs = 3, breaks: legs, rebuild: true}
      not-code: {original: constexpr int kLegs = 4, mutated: constexpr inch kLegs = 4, breaks: legs, rebuild: true}
"""


class Project:
    """A tree with one header, one test program and one list."""

    def __init__(self, folder, mutants=LIST):
        self.top = pathlib.Path(folder)
        for path, text in {"CMakeLists.txt": CMAKE, "code/shape.h": CODE, "planted_test.cpp": TEST,
                           "test/mutants/planted.yaml": mutants}.items():
            file = self.top / "tree" / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(text)

    def mutate(self, *arguments, environment=None):
        done = subprocess.run([sys.executable, TOP / "scripts/mutate", "--source", self.top / "tree", "--work", self.top / "work",
                               *arguments], env={**os.environ, **(environment or {})}, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    def states(self):
        report = json.loads((self.top / "work/report.json").read_text())
        return {mutant["id"]: mutant["state"] for mutant in report["mutants"]}


class PlantedMutants(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def test_are_told_apart(self):
        project = Project(self.folder.name)
        code, output, errors = project.mutate()
        self.assertEqual(code, 1, output + errors)
        self.assertEqual(project.states(), {
            "killed": "killed", "left-out": "killed", "hangs": "timed out", "alive": "survived", "explained": "survived",
            "explained-away": "killed", "rebuilt": "killed", "not-code": "not compiled"})
        self.assertIn("planted/killed: Area.IsTheProduct failed", output)
        self.assertIn("SURVIVED     planted/alive: unexplained: twice is a sum", output)
        self.assertIn("survived     planted/explained: it is the same", output)
        self.assertIn("KILLED       planted/explained-away: Area.IsTheProduct failed, but", output)
        self.assertIn("NOT COMPILED planted/not-code: ", output)

        # Two of them alone are as they should be; the copy needs no compiler any more.
        code, output, errors = project.mutate("--only", "killed", "explained")
        self.assertEqual(code, 0, output + errors)
        self.assertIn("2 mutants: 1 killed (50 %), 1 survived (1 of them explained)", output)

        code, output, errors = project.mutate("--list", "--only", "shape.h")
        self.assertEqual(len(output.splitlines()), 8, output + errors)
        code, output, errors = project.mutate("--list", "--only", "form.h")
        self.assertIn("form.h: neither a mutant nor a list nor a file", errors)

        # One that dies though the list says why it lives is a mistake, too.
        code, output, errors = project.mutate("--only", "explained-away")
        self.assertEqual(code, 1, output + errors)

        # Tests that fail by themselves judge nothing.
        (project.top / "work/baseline.json").unlink()
        code, output, errors = project.mutate("--only", "killed", environment={"SPOILED": "1"})
        self.assertEqual(code, 2, output)
        self.assertIn("planted_test failed without any mutant: Area.IsTheProduct", errors)


class Lists(unittest.TestCase):
    def error_of(self, *replaced):
        mutants = LIST
        for old, new in replaced:
            self.assertIn(old, mutants)
            mutants = mutants.replace(old, new)
        with tempfile.TemporaryDirectory() as folder:
            code, output, errors = Project(folder, mutants).mutate("--check")
        self.assertEqual(code, 2 if errors else 0, output)
        return errors

    def test_fit_the_code(self):
        self.assertEqual(self.error_of(), "")

    def test_name_a_mutant_whose_original_is_gone(self):
        self.assertIn("hangs: its original is not in code/shape.h: ++j", self.error_of(("original: ++i", "original: ++j")))

    def test_name_a_mutant_whose_original_is_no_longer_unique(self):
        self.assertIn("hangs: its original stands 2 times in code/shape.h: sum",
                      self.error_of(("original: ++i", "original: sum, within: \"sum += width; } return sum;\"")))

    def test_refuse_what_they_do_not_know(self):
        for replaced, said in ((("breaks: it ends", "braeks: it ends"), "braeks is unknown"),
                               (("mutated: i += 0, breaks: it ends", "mutated: i += 0"), "breaks should be a text"),
                               (("      hangs:", "      alive:"), "alive stands there twice"),
                               (("shape.h:", "form.h:"), "code has 0 files form.h")):
            self.assertIn(said, self.error_of(replaced))

    def test_name_a_filter_that_takes_no_test(self):
        self.assertIn("planted.yaml: filter Surface.* takes no test of planted_test (killed, left-out, hangs",
                      self.error_of(("filter: Area.*", "filter: Area.*:Surface.*")))
        self.assertIn("planted_tests: no CMakeLists.txt has such a program",
                      self.error_of(("tests: [planted_test]", "tests: [planted_tests]")))

    def test_of_this_tree_fit_its_code(self):
        done = subprocess.run([sys.executable, TOP / "scripts/mutate", "--check"], capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)


class Sources(unittest.TestCase):
    """Of tests: what gtest will call them."""

    def test_of_a_program_are_those_of_its_command(self):
        with tempfile.TemporaryDirectory() as folder:
            top = pathlib.Path(folder)
            (top / "room").mkdir()
            (top / "room/CMakeLists.txt").write_text("""
set(sources a_test.cpp b_test.cpp)  # of one
if(MORE)
  list(APPEND sources c_test.cpp)
endif()
alidade_test(one_test SOURCES ${sources} ${unknown}
  SUPPORT ${PROJECT_SOURCE_DIR}/support.cpp
  DEFINITIONS FILE="$<TARGET_FILE:other>")
set(sources d_test.cpp)
alidade_test(other_test SOURCES ${sources} missing_test.cpp)
alidade_files_of_heads(protocols "" _protocol_test.cpp)
alidade_test(heads_test SOURCES ${protocols})
""")
            (top / "room/foo_protocol_test.cpp").write_text("TEST(Foo, Works) {}\n")
            for name in "abcd":
                (top / f"room/{name}_test.cpp").write_text(f'#include "test/shared.h"\nTEST({name.upper()}, Works) {{}}\n')
            (top / "test").mkdir()
            (top / "test/shared.h").write_text("TEST(Shared, Works) {}\n")
            found = suites.Suites(top, ["room/CMakeLists.txt", "README.md"])
            self.assertEqual(found.tests("one_test"), ["A.Works", "B.Works", "C.Works", "Shared.Works"])
            self.assertEqual(found.tests("other_test"), ["D.Works", "Shared.Works"])
            self.assertEqual(found.tests("heads_test"), ["Foo.Works"])
            with self.assertRaises(catalogue.ListError):
                found.tests("third_test")

    def test_with_parameters_and_types_have_long_names(self):
        text = """
TEST_F(Plain, Works) {
TEST_P(Each,
       Works) {
INSTANTIATE_TEST_SUITE_P(
    Some, Each, testing::Values(1));
INSTANTIATE_TEST_SUITE_P(More, Each, testing::Values(2));
INSTANTIATE_TEST_SUITE_P(, Bare, testing::Values(3));
TEST_P(Bare, Works) {
TYPED_TEST(Typed, Works) {
TEST_P(Forgotten, Works) {
// TEST(Comment, IsNone)
"""
        names = list(suites.tests_in(text))
        self.assertEqual(names, ["Plain.Works", "Some/Each.Works/0", "More/Each.Works/0", "Bare.Works/0", "Typed/0.Works"])
        for wanted, taken in (("*", names), ("Each.*", []), ("*/Each.*", names[1:3]), ("Bare.*", names[3:4]), ("Typed/*", names[4:]),
                              ("Plain.*:More/*", [names[0], names[2]]), ("*-*/*", names[:1]), ("-Plain.*", names[1:])):
            self.assertEqual([name for name in names if suites.takes(wanted, name)], taken, wanted)


class Instrument(unittest.TestCase):
    def text_of(self, text, *mutants):
        made = [catalogue.Mutant(id=f"m{i}", room="r", file="f", original=original, mutated=mutated, breaks="b", tests=(), then=(),
                                 within=within)
                for i, (original, mutated, within) in enumerate(mutants)]
        changed = instrument.instrumented(text, made)
        for i, mutant in enumerate(made):
            changed = changed.replace(f"::alidade_mutant == {mutant.number}UL", f"M{i}")
        return changed.split("\n", 1)[1]

    def test_switches_expressions_and_statements(self):
        self.assertEqual(self.text_of("a = b * c;", ("b * c", "b", "")), "a = (M0 ? (b) : (b * c));")
        self.assertEqual(self.text_of("f();\ng();", ("g();", "", "")), "f();\n{ if (M0) {  } else { g(); } }")

    def test_has_many_at_one_place_and_one_in_another(self):
        self.assertEqual(self.text_of("a = b + c;", ("b + c", "b", ""), ("b + c", "c", "")), "a = (M0 ? (b) : M1 ? (c) : (b + c));")
        self.assertEqual(self.text_of("a = b + c;", ("b + c", "b", ""), ("c", "d", "")),
                         "a = (M0 ? (b) : (b + (M1 ? (d) : (c))));")

    def test_finds_an_original_over_line_ends_and_by_what_it_is_within(self):
        self.assertEqual(self.text_of("f(a +\n  b); g(a + b)", ("a + b", "b", "f(a + b)")), "f((M0 ? (b) : (a +\n  b))); g(a + b)")

    def test_takes_no_part_of_a_name_for_the_original(self):
        self.assertEqual(self.text_of("x = pan_deg * per; y = pan_deg;", ("pan_deg", "tilt_deg", "y = pan_deg;")),
                         "x = pan_deg * per; y = (M0 ? (tilt_deg) : (pan_deg));")
        self.assertEqual(self.text_of("x = a * per_turn; y = a * per;", ("a * per", "per", "")),
                         "x = a * per_turn; y = (M0 ? (per) : (a * per));")

    def test_refuses_brackets_that_would_change_the_original(self):
        for text, original in (("x = a - b + c;", "b + c"), ("x = -a * b;", "a * b"), ("x = a + b * c;", "a + b"),
                               ("x = y * a + b;", "a + b"), ("x = p.a + b;", "a + b"), ("x = !a == b;", "a == b"),
                               ("x = f(a);", "f(a"), ("x = a.b;", "b"), ("x = a * b.c;", "a * b"), ("x = f(a, b);", "a, b")):
            with self.assertRaises(catalogue.ListError, msg=text):
                self.text_of(text, (original, "m", ""))
        for text, original in (("x = a - b + c;", "a - b"), ("x = f(-a * b);", "-a * b"), ("return a + b;", "a + b"),
                               ("x = static_cast<int>(a) + b;", "static_cast<int>(a)"), ("x = c ? a + b : d;", "a + b"),
                               ("x += a + b;", "a + b"), ("x = a + b * c;", "b * c"), ("x = 1e-3 * a;", "1e-3 * a")):
            self.text_of(text, (original, "m", ""))

    def test_refuses_a_declaration(self):
        for declaration in ("const double x = 2;", "constexpr double kX = 2;", "auto x = 2;"):
            with self.assertRaises(catalogue.ListError, msg=declaration):
                self.text_of(f"f(); {declaration}", (declaration, declaration.replace("2", "3"), ""))
        self.text_of("f(); constant(2);", ("constant(2);", "", ""))

    def test_refuses_what_is_neither_an_expression_nor_a_statement(self):
        for text, original, mutated in (("if (a || b) f();", "a ||", "b ||"), ("x = a + b;", "a + b", ""),
                                        ("if (a) f(); else if (b) g();", "else if (b)", "else"), ("x = f(a);", "f", "g"),
                                        ("switch (a) { case 1: f(); }", "case 1: f();", "case 1:;")):
            with self.assertRaises(catalogue.ListError, msg=text):
                self.text_of(text, (original, mutated, ""))

    def test_refuses_mutants_that_overlap(self):
        with self.assertRaises(catalogue.ListError):
            self.text_of("x = a + b + c;", ("a + b", "a", ""), ("x = a", "y = a", ""))


if __name__ == "__main__":
    unittest.main()
