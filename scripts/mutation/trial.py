"""Runs test programs with one mutant switched on, and tells whether they notice."""
import dataclasses
import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import tempfile
import time

from .instrument import VARIABLE
from .suites import takes

SLOWDOWN = 5  # times its normal time: a test that takes longer hangs
GRACE_S = 20  # and this besides: other programs run on this machine


class TrialError(Exception):
    """The tests cannot judge: they fail without any mutant, or are not there."""


@dataclasses.dataclass
class Outcome:
    failed: list  # names of tests that failed, or in which the program crashed or hung
    ended: str  # "passed", "failed", "crashed", "timed out"
    cpu_s: float = 0
    seconds: dict = dataclasses.field(default_factory=dict)  # of each test that ended

    @property
    def noticed(self):
        return self.ended != "passed"


class Programs:
    """The test programs of a build, started as ctest starts them."""

    def __init__(self, build):
        shown = subprocess.run(["ctest", "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=False)
        try:
            self.entries = json.loads(shown.stdout)["tests"]
        except (ValueError, KeyError):
            raise TrialError(f"ctest does not list the tests of {build}: {shown.stderr.strip()[-400:]}") from None
        self.prepared = set()
        self.scratch = pathlib.Path(build, "scratch")
        self.scratch.mkdir(exist_ok=True)

    def entry(self, program):
        """Its entry, with the command from the program on: what ctest puts before it only shares out the waiting."""
        named = [entry for entry in self.entries if any(pathlib.Path(word).name == program for word in entry.get("command", []))]
        for entry in sorted(named, key=lambda entry: entry["name"] != program):
            words = entry["command"]
            begin = [pathlib.Path(word).name for word in words].index(program)
            return {**entry, "command": words[begin:]}
        raise TrialError(f"{program}: ctest knows no such test program; the lists in test/mutants name it")

    def filter(self, program):
        """Which of its tests ctest runs under the program's name; others are for longer nights."""
        given = [word for word in self.entry(program)["command"] if word.startswith("--gtest_filter=")]
        return given[-1].split("=", 1)[1] if given and self.entry(program)["name"] == program else "*"

    def properties(self, entry):
        return {item["name"]: item["value"] for item in entry.get("properties", [])}

    def start(self, program, arguments, mutant):
        entry = self.entry(program)
        properties = self.properties(entry)
        self.prepare(properties.get("FIXTURES_REQUIRED", []))
        words = [word for word in entry["command"] if not word.startswith("--gtest_")]
        return words + arguments, self.environment(properties, mutant), properties.get("WORKING_DIRECTORY", ".")

    def environment(self, properties, mutant):
        return {**os.environ, **dict(line.split("=", 1) for line in properties.get("ENVIRONMENT", [])),
                VARIABLE: str(mutant.number if mutant else 0)}

    def prepare(self, fixtures):
        """What ctest runs before: films that the programs share."""
        for entry in self.entries:
            properties = self.properties(entry)
            if set(properties.get("FIXTURES_SETUP", [])) & set(fixtures) and entry["name"] not in self.prepared:
                self.prepared.add(entry["name"])
                self.prepare(properties.get("FIXTURES_REQUIRED", []))
                done = subprocess.run(entry["command"], env=self.environment(properties, None), capture_output=True, check=False,
                                      cwd=properties.get("WORKING_DIRECTORY", "."))
                if done.returncode != 0:
                    raise TrialError(f"{entry['name']} fails, and tests need what it makes")

    def run(self, program, cases, mutant, limit_s, stop_at_first=True):
        """Runs the tests of a program that a filter of gtest's form takes."""
        arguments = [f"--gtest_filter={cases}", "--gtest_color=no"] + (["--gtest_fail_fast"] if stop_at_first else [])
        words, environment, folder = self.start(program, arguments, mutant)
        with tempfile.TemporaryDirectory(prefix="run-", dir=self.scratch) as scratch:
            os.chmod(scratch, 0o755)  # tests become nobody now and then
            output = pathlib.Path(scratch, "output")
            with output.open("wb") as file:
                process = subprocess.Popen(words, env={**environment, "TMPDIR": scratch}, cwd=folder, stdout=file,
                                           stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, start_new_session=True)
                late = wait(process, limit_s)
            return read_outcome(output.read_text(errors="replace"), process, late)


def is_stopped(pid):
    """Whether a signal has put the process to sleep."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "T"
    except OSError:
        return False


def wait(process, limit_s):
    """Waits, and ends the program with all that it started when its time is over. Returns whether it was."""
    end = time.monotonic() + limit_s
    pause = 0.005
    late = False
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            process.cpu_s = usage.ru_utime + usage.ru_stime
            break
        if is_stopped(process.pid):
            end += pause  # somebody holds it, not the mutant
        if not late and time.monotonic() > end:
            late = True
            os.killpg(process.pid, signal.SIGKILL)
        time.sleep(pause)
        pause = min(0.1, 1.5 * pause)
    try:
        os.killpg(process.pid, signal.SIGKILL)  # what it started and left
    except (ProcessLookupError, PermissionError):
        pass
    return late


def read_outcome(output, process, late):
    begun = re.findall(r"^\[ RUN      \] (\S+)", output, re.M)
    ended = dict(re.findall(r"^\[ +(?:OK|FAILED|SKIPPED) +\] (\S+?)(?:,.*)? \((\d+) ms\)$", output, re.M))
    failed = list(dict.fromkeys(re.findall(r"^\[  FAILED  \] (\S+?)(?:,.*)? \(\d+ ms\)$", output, re.M)))
    open_ = [name for name in begun if name not in ended][-1:]
    if late:
        state, failed = "timed out", failed + open_
    elif process.returncode == 0:
        state = "passed"
    elif process.returncode < 0 or open_:
        state, failed = "crashed", failed + open_
    else:
        state = "failed"
    return Outcome(failed, state, process.cpu_s, {name: int(ms) / 1000 for name, ms in ended.items()})


class Baseline:
    """How long each test takes when nothing is wrong; kept beside the build until the program changes."""

    def __init__(self, programs, file):
        self.programs, self.file = programs, file
        try:
            self.kept = json.loads(file.read_text())
        except (OSError, ValueError):
            self.kept = {}

    def stamp(self, program):
        return hashlib.sha256(pathlib.Path(self.programs.entry(program)["command"][0]).read_bytes()).hexdigest()

    def measure(self, program, say):
        """Runs the program whole without a mutant; twice what fails, for a busy machine's sake."""
        stamp = self.stamp(program)
        if self.kept.get(program, {}).get("stamp") != stamp:
            say(f"without a mutant: {program}")
            outcome = self.programs.run(program, self.programs.filter(program), None, 3600, stop_at_first=False)
            again = outcome
            for _ in range(2):
                if again.noticed and again.failed:
                    again = self.programs.run(program, ":".join(again.failed), None, 600, stop_at_first=False)
            if again.noticed:
                raise TrialError(f"{program} {again.ended} without any mutant: {' '.join(again.failed)}")
            self.kept[program] = {"stamp": stamp, "seconds": outcome.seconds, "cpu_s": round(outcome.cpu_s, 2)}
            self.file.write_text(json.dumps(self.kept, indent=1))

    def cases(self, program, wanted):
        """Names of the program's tests that a filter of gtest's form takes."""
        return [name for name in self.kept[program]["seconds"] if takes(wanted, name)]

    def seconds(self, program, cases):
        return sum(self.kept[program]["seconds"][name] for name in cases)


@dataclasses.dataclass
class Verdict:
    mutant: object
    state: str  # "killed", "survived", "timed out", "not compiled"
    by: str = ""  # the test, or what the compiler said
    cpu_s: float = 0
    runs: int = 0

    @property
    def dead(self):
        return self.state in ("killed", "timed out")

    @property
    def as_it_should(self):
        """Killed, or alive with a reason; a mutant that does not compile says nothing about the tests."""
        return self.state != "not compiled" and self.dead != bool(self.mutant.survives)


class Judge:
    def __init__(self, programs, baseline, budget_s, likely_only=False):
        self.programs, self.baseline, self.budget_s, self.likely_only = programs, baseline, budget_s, likely_only

    def steps(self, mutant):
        """What to run, likeliest first: (program, its tests)."""
        own = [(program, self.baseline.cases(program, mutant.filter)) for program in mutant.tests + mutant.then]
        likely = [(program, cases) for program, cases in own if cases] if mutant.filter != "*" else []
        yield from likely
        if likely and self.likely_only:
            return
        tried = {program: set(cases) for program, cases in likely}
        spent = 0
        for program in mutant.tests + mutant.then:
            rest = [name for name in self.baseline.cases(program, "*") if name not in tried.get(program, ())]
            if program in mutant.then:
                spent += self.baseline.seconds(program, rest)
                if spent > self.budget_s:
                    continue
            if rest:
                yield program, rest

    def verdict(self, mutant):
        verdict = Verdict(mutant, "survived")
        for program, cases in self.steps(mutant):
            ended, by = self.noticed(program, cases, mutant, verdict)
            if ended:
                verdict.state, verdict.by = ("timed out" if ended == "timed out" else "killed"), by
                return verdict
        return verdict

    def noticed(self, program, cases, mutant, verdict):
        """How the mutant shows in these tests; a test that fails without it, too, is no witness."""
        cases = list(cases)
        for _ in range(3):
            outcome = self.run(program, cases, mutant, verdict)
            if not outcome.noticed:
                return None, ""
            witnesses = outcome.failed or cases
            if not self.run(program, witnesses, None, verdict).noticed:
                return outcome.ended, f"{outcome.failed[0] if outcome.failed else program} {outcome.ended}"
            cases = [name for name in cases if name not in outcome.failed]
            if not outcome.failed or not cases:
                return None, ""
        return None, ""

    def run(self, program, cases, mutant, verdict):
        limit_s = SLOWDOWN * self.baseline.seconds(program, cases) + GRACE_S
        outcome = self.programs.run(program, ":".join(cases), mutant, limit_s)
        verdict.cpu_s += outcome.cpu_s
        verdict.runs += 1
        return outcome
