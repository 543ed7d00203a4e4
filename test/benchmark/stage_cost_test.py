#!/usr/bin/env python3
"""stage_cost.py must say which stage costs more and by how much, refuse what is malformed in one line, and predict
times whose two ends are what they claim to be."""
import contextlib
import io
import json
import pathlib
import tempfile
import unittest

import cost_model
import stage_cost

COMPILER = "x86_64 GNU 12.2.0 Release"
STAGES = {"pt": {"instructions": 1000.0, "memory_bytes": 0.0}, "oe-720/process": {"instructions": 2e6, "memory_bytes": 3e6}}


def scaled(**factors):
    """STAGES with the instructions of one stage times a factor."""
    return {stage: {**cost, "instructions": cost["instructions"] * factors.get(stage, 1)} for stage, cost in STAGES.items()}


def judged(counts, known=None):
    """(exit code, what was printed) of counts against the reference."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = stage_cost.judge({"x86_64 GNU 12 Release": {"stages": STAGES}} if known is None else known,
                                {"compiler": COMPILER, "stages": counts}, "counts.json")
    return code, out.getvalue()


class Judges(unittest.TestCase):
    def test_passes_the_same_and_a_little_more(self):
        for factor in (1, 1.049, 0.951):
            with self.subTest(factor=factor):
                code, said = judged(scaled(pt=factor))
                self.assertEqual(code, 0, said)
                self.assertNotIn("WRONG", said)

    def test_fails_where_one_stage_costs_over_five_percent_more(self):
        code, said = judged(scaled(pt=1.06))
        self.assertEqual(code, 1)
        self.assertIn("WRONG: stage pt: 1,060 instructions, 6.0% more than 1,000; 5% more is allowed", said)
        self.assertIn("stage_cost.py accept counts.json", said)
        self.assertEqual(said.count("WRONG"), 1)

    def test_tells_what_got_better_and_passes(self):
        code, said = judged(scaled(pt=0.5))
        self.assertEqual(code, 0)
        self.assertIn("better: stage pt: 500 instructions, 50.0% less than 1,000", said)
        self.assertIn("stage_cost.py accept", said)

    def test_fails_where_a_stage_is_missing_or_new(self):
        code, said = judged({"pt": STAGES["pt"]})
        self.assertEqual(code, 1)
        self.assertIn("stage oe-720/process was not counted any more", said)
        code, said = judged({**STAGES, "tail": {"instructions": 1.0}})
        self.assertEqual(code, 1)
        self.assertIn("stage tail is new", said)

    def test_skips_another_compiler(self):
        code, said = judged(STAGES, {"x86_64 GNU 9 Release": {"stages": STAGES}})
        self.assertEqual(code, 77)
        self.assertIn("no reference for x86_64 GNU 12 Release", said)

    def test_takes_another_patch_level_for_the_same_compiler(self):
        self.assertEqual(stage_cost.key_of("x86_64 GNU 12.9.1 Release"), "x86_64 GNU 12 Release")


class Refuses(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.file = pathlib.Path(folder.name, "costs.json")

    def refused(self, text, words, read):
        self.file.write_text(text)
        with self.assertRaises(stage_cost.CostError) as refused:
            read(self.file)
        said = str(refused.exception)
        self.assertIn(words, said)
        self.assertIn(str(self.file), said)
        self.assertNotIn("\n", said)

    def test_counts_that_are_none(self):
        for text, words in (("", "not JSON"), ("{", "not JSON"), ("[]", "holds no counts"), ("{}", "holds no counts"),
                            ('{"compiler": "c", "stages": {}}', "holds no counts"),
                            ('{"compiler": "c", "stages": {"pt": 3}}', "stage pt: instructions is None"),
                            ('{"compiler": "c", "stages": {"pt": {"instructions": "many"}}}', "stage pt: instructions is 'many'"),
                            ('{"compiler": "c", "stages": {"pt": {"instructions": 0}}}', "stage pt: instructions is 0"),
                            ('{"compiler": "c", "stages": {"pt": {"instructions": NaN}}}', "stage pt: instructions is nan")):
            with self.subTest(text=text):
                self.refused(text, words, stage_cost.read_counts)

    def test_a_reference_of_another_format(self):
        for text in ('{"counts": {}}', '{"format": "alidade stage costs 2", "counts": {}}', '{"format": "alidade stage costs 1"}', "[]"):
            with self.subTest(text=text):
                self.refused(text, "not of the format", stage_cost.read_reference)
        self.refused('{"format": "alidade stage costs 1", "counts": {"k": {"stages": {}}}}', "holds no counts", stage_cost.read_reference)

    def test_a_file_that_is_not_there(self):
        with self.assertRaisesRegex(stage_cost.CostError, "No such file"):
            stage_cost.read_counts(self.file)

    def test_output_of_other_programs(self):
        for text in ("", "pt 3\n"):
            with self.assertRaisesRegex(stage_cost.CostError, "names no compiler"):
                stage_cost.read_pieces(text)
        with self.assertRaisesRegex(stage_cost.CostError, "line 'pt' is not STAGE CALLS"):
            stage_cost.read_pieces("compiler c\npt\n")
        with self.assertRaisesRegex(stage_cost.CostError, "no events or no totals"):
            stage_cost.read_callgrind("Segmentation fault\n")

    def test_counts_that_belong_to_other_pieces(self):
        with self.assertRaisesRegex(stage_cost.CostError, "2 pieces of work, but 1 were counted"):
            stage_cost.gather([["pt", 1, None], ["pt", 1, None]], [{"instructions": 1}])


class Reads(unittest.TestCase):
    def test_dumps_of_callgrind(self):
        dumps = ("events: Ir Dr Dw I1mr D1mr D1mw ILmr DLmr DLmw ILdmr DLdmr DLdmw\nsummary: 9 9 9\n"
                 "totals: 100 20 10 1 2 3 4 5 6 0 1 2\nevents: Ir Dr Dw\ntotals: 300 1 1 0 0 0 0 0 0\ntotals: 0\n")
        costs = [stage_cost.costs_of_callgrind(counts) for counts in stage_cost.read_callgrind(dumps)]
        self.assertEqual(costs[0], {"instructions": 100, "accesses": 30, "l1_misses": 6, "memory_bytes": 64 * (4 + 5 + 6 + 1 + 2)})
        self.assertEqual(len(costs), 2)

    def test_means_of_calls_and_the_dearest(self):
        pieces = [["pt", 1000, None], ["oe", 1, None], ["oe", 1, None]]
        costs = stage_cost.read_plugin("counted 5000 1000\nqemu: whatever\ncounted 10 4\ncounted 30 8\n")
        self.assertEqual(stage_cost.gather(pieces, costs),
                         {"pt": {"instructions": 5, "accesses": 1}, "oe": {"instructions": 20, "accesses": 6, "most": 30}})


class Accepts(unittest.TestCase):
    def test_adds_to_what_is_there(self):
        with tempfile.TemporaryDirectory() as folder:
            reference = pathlib.Path(folder, "reference.json")
            for compiler, instructions in ((COMPILER, 1), ("aarch64 GNU 12.2.0 Release", 2), (COMPILER, 3)):
                counts = pathlib.Path(folder, "counts.json")
                counts.write_text(json.dumps({"compiler": compiler, "stages": {"pt": {"instructions": instructions}}}))
                with contextlib.redirect_stdout(io.StringIO()):
                    stage_cost.main(["accept", str(counts), "--reference", str(reference)])
            known = stage_cost.read_reference(reference)
        self.assertEqual({key: counts["stages"]["pt"]["instructions"] for key, counts in known.items()},
                         {"x86_64 GNU 12 Release": 3, "aarch64 GNU 12 Release": 2})


class Predicts(unittest.TestCase):
    def test_both_ends_of_a_range(self):
        board = cost_model.Board("board", (1, 2), (0.5, 2), (1, 4), "a test")
        least, longest = cost_model.seconds(board, 4e6, 1e6)
        self.assertAlmostEqual(least, 1e-3)  # 4e6 instructions at 4e9 a second; the memory needs less
        self.assertAlmostEqual(longest, 8e-3 + 1e-3)
        least, _ = cost_model.seconds(board, 4e6, 1e7)
        self.assertAlmostEqual(least, 2.5e-3)  # the memory's

    def test_from_the_counts_that_are_kept(self):
        known = {key.split()[0]: counts["stages"] for key, counts in stage_cost.read_reference(stage_cost.REFERENCE).items()}
        report = cost_model.predict(known["x86_64"], known["aarch64"], {stage: 1.0 for stage in known["x86_64"]})
        for name in cost_model.SUMS:
            for least, longest in report["rows"][name]["seconds"].values():
                self.assertLess(0, least)
                self.assertLess(least, longest)
        self.assertEqual(len(report["paper"]), 2)
        table = cost_model.markdown(report)
        self.assertIn(f"0 of {len(report['rows'])} measured times lie in the range", table)
        self.assertEqual(table.count("outside"), len(report["rows"]))


if __name__ == "__main__":
    unittest.main()
