#!/usr/bin/env python3
"""scripts/benchmark-history must show no difference where there is none, find one that is there, say how sure it is, and refuse
bad files in one line."""
import contextlib
import importlib.machinery
import importlib.util
import io
import itertools
import json
import pathlib
import random
import tempfile
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
LOADER = importlib.machinery.SourceFileLoader("benchmark_history", str(TOP / "scripts/benchmark-history"))
history = importlib.util.module_from_spec(importlib.util.spec_from_loader("benchmark_history", LOADER))
LOADER.exec_module(history)


def row(p50_s):
    return {"samples": 1000, **{key: p50_s * factor for key, factor in zip(history.QUANTILES, (1, 1.2, 2, 4, 9))}}


def table(**p50_s):
    return {"format": history.TABLE_FORMAT, "benchmark": "stage_latency", "rows": {name: row(value) for name, value in p50_s.items()}}


def run(name, date="2026-01-01", processor="2 x test", **p50_s):
    return {"format": history.RUN_FORMAT, "date": date, "name": name, "processor": processor, "tables": {"stage_latency": table(**p50_s)}}


def noisy(name, count, p50_s, seed):
    """Runs whose medians vary by some percent."""
    source = random.Random(seed)
    return [run(name, pt=p50_s * source.lognormvariate(0, 0.03)) for _ in range(count)]


class Compares(unittest.TestCase):
    def test_ratio_and_interval_of_a_build_twice_as_slow(self):
        lines = history.compared(noisy("a", 5, 1e-6, 1), noisy("b", 5, 2e-6, 2), "")
        words = next(line for line in lines if line.startswith("| stage_latency: pt")).split("|")
        ratio, interval = words[2].split("(")
        self.assertAlmostEqual(float(ratio), 2, delta=0.1)
        least, most = (float(w) for w in interval.rstrip(" )").split(" to "))
        self.assertTrue(1.8 < least < float(ratio) < most < 2.2, words[2])
        self.assertIn("p50 slower", words[-2])
        self.assertIn("p50 faster", "".join(history.compared(noisy("b", 5, 2e-6, 2), noisy("a", 5, 1e-6, 1), "")))

    def test_gives_no_interval_of_three_runs(self):
        lines = history.compared(noisy("a", 3, 1e-6, 1), noisy("b", 3, 2e-6, 2), "")
        self.assertIn("(?)", lines[2])
        self.assertNotIn("slower", lines[2])
        self.assertIn("they take four runs of each", "".join(lines))

    def test_interval_misses_the_truth_as_seldom_as_it_says(self):
        # A build against itself, 1000 times: beyond four standard deviations from the exact share is no chance.
        source = random.Random(1)
        missed = 0
        for _ in range(1000):
            before, after = ([source.lognormvariate(0, 0.03) for _ in range(5)] for _ in range(2))
            _, least, most = history.ratio_of(before, after)
            missed += least > 1 or most < 1
        share = 8 / 252  # of all orders of five and five values: those with two or fewer pairs the other way round, twice
        self.assertLess(abs(missed - 1000 * share), 4 * (1000 * share * (1 - share)) ** 0.5)

    def test_does_not_speak_of_small_differences(self):
        source = random.Random(1)
        before, after = ([run(name, pt=p50_s * source.lognormvariate(0, 1e-4)) for _ in range(5)] for name, p50_s in (("a", 1e-6), ("b", 1.01e-6)))
        line = history.compared(before, after, "")[2]
        self.assertRegex(line, r"\| 1\.010 \(1\.010 to 1\.010\)")
        self.assertNotIn("slower", line)

    def test_interval_is_exact(self):
        # By counting: in how many of all orders of 5 and 5 values is the u-th ratio from the end on the wrong side?
        for m, n in ((3, 3), (4, 4), (5, 5), (4, 6)):
            below = [sum(1 for i in chosen for j in set(range(m + n)) - set(chosen) if i < j)
                     for chosen in itertools.combinations(range(m + n), m)]
            outside = history.rank_of_bound(m, n)
            self.assertLessEqual(sum(u < outside for u in below) / len(below), 0.025)
            self.assertGreater(sum(u <= outside for u in below) / len(below), 0.025)
        self.assertEqual([history.rank_of_bound(n, n) for n in (2, 3, 4, 5)], [0, 0, 1, 3])

    def test_refuses_what_cannot_be_compared(self):
        before = noisy("a", 4, 1e-6, 1)
        with self.assertRaisesRegex(history.HistoryError, "different processors"):
            history.compared(before, [run("b", processor="4 x other", pt=1e-6)], "")
        with self.assertRaisesRegex(history.HistoryError, "no row is in all runs"):
            history.compared(before, [run("b", other=1e-6)], "")
        with self.assertRaisesRegex(history.HistoryError, "no row that contains 'oe'"):
            history.compared(before, before, "oe")

    def test_finds_runs_by_the_beginning_of_their_name(self):
        runs = [run("abc1", pt=1), run("abc1", pt=1), run("abd2", pt=1)]
        self.assertEqual(len(history.named(runs, "abc")), 2)
        with self.assertRaisesRegex(history.HistoryError, "ab may be abc1 or abd2"):
            history.named(runs, "ab")
        with self.assertRaisesRegex(history.HistoryError, "no run is named x; there are abc1, abd2"):
            history.named(runs, "x")


class Keeps(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def call(self, *arguments):
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            history.main([str(a) for a in arguments])
        return out.getvalue()

    def write(self, name, content):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content if isinstance(content, str) else json.dumps(content))
        return file

    def test_keeps_shows_and_draws_runs(self):
        self.write("build/benchmark-results/stage_latency.json", table(pt=1e-6))
        self.write("build/benchmark-results/pt_mode_benchmark.json", {"context": {}, "benchmarks": []})
        for name in ("first", "second"):
            self.call("keep", self.folder / "build", self.folder / "kept", "--name", name)
        said = self.call("show", self.folder / "kept", "--svg", self.folder / "history.svg")
        self.assertRegex(said, r"\| p50, p99 \| .* first \| .* second \|")
        self.assertIn("| stage_latency: pt | 1 us, 2 us | 1 us, 2 us |", said)
        self.assertIn("<svg", (self.folder / "history.svg").read_text())

    def test_refuses_bad_tables_and_runs(self):
        falling = table(pt=1.0)
        falling["rows"]["pt"]["p99_s"] = 0.5
        lacking = table(pt=1.0)
        del lacking["rows"]["pt"]["p90_s"]
        good = run("n", pt=1.0)
        for content, words in (("{", "not JSON"), ("\x00", "not JSON"), ([], "not of the format"),
                               ({"format": "alidade kept run 2", "tables": {}}, "not of the format"),
                               ({**good, "name": 3}, "name is 3"), ({**good, "date": None}, "date is None"),
                               ({**good, "tables": {"t": {}}}, "holds no rows"),
                               ({**good, "tables": {"t": {**table(pt=1.0), "rows": {}}}}, "holds no rows"),
                               ({**good, "tables": {"t": {**table(pt=1.0), "rows": {"pt": 3}}}}, "row pt"),
                               ({**good, "tables": {"t": table(pt=0.0)}}, "row pt: .* positive"),
                               ({**good, "tables": {"t": table(pt=float("nan"))}}, "row pt: .* positive"),
                               ({**good, "tables": {"t": lacking}}, "row pt: .* must be there"),
                               ({**good, "tables": {"t": falling}}, "row pt: quantiles must not fall")):
            with self.subTest(words=words):
                file = self.write("kept/run.json", content)
                with self.assertRaisesRegex(history.HistoryError, words) as refused:
                    history.read_folder(self.folder / "kept")
                self.assertIn(str(file), str(refused.exception))
                self.assertNotIn("\n", str(refused.exception))

    def test_says_what_is_missing(self):
        with self.assertRaisesRegex(history.HistoryError, "no such folder"):
            history.read_folder(self.folder / "nowhere")
        (self.folder / "empty").mkdir()
        with self.assertRaisesRegex(history.HistoryError, "holds no runs"):
            history.read_folder(self.folder / "empty")
        with self.assertRaisesRegex(history.HistoryError, "holds no latency tables; ctest"):
            self.call("keep", self.folder, self.folder / "kept", "--name", "n")
        with self.assertRaisesRegex(history.HistoryError, "no build folder of CMake"):
            self.call("turns", self.folder, self.folder, self.folder / "kept")


if __name__ == "__main__":
    unittest.main()
