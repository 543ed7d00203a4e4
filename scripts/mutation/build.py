"""A copy of the tree with all mutants in it, built once."""
import os
import re
import subprocess

from .catalogue import ListError
from .instrument import HEADER, HEADER_NAME, instrumented

CONFIGURATION = ["-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DALIDADE_BUILD_BENCHMARKS=OFF", "-DALIDADE_BUILD_EXPERIMENTS=OFF",
                 "-DALIDADE_BUILD_VIRTUAL_MACHINE=OFF", "-DALIDADE_BUILD_ROS=OFF"]


class BuildError(Exception):
    """What the compiler said."""


def files_of(source):
    """What git would keep of the tree, committed or not; all files, where there is no git."""
    listed = subprocess.run(["git", "-C", source, "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
                            capture_output=True, check=False)
    if listed.returncode == 0:
        names = [os.fsdecode(name) for name in listed.stdout.split(b"\0") if name]
    else:
        names = [path.relative_to(source).as_posix() for path in source.rglob("*")]
    return sorted(name for name in set(names) if (source / name).is_file())


def write_if_changed(file, content, mode=0o644):
    """A file that stays as it is keeps its date, and needs no compiler."""
    if not file.is_file() or file.read_bytes() != content:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(content)
    file.chmod(mode)


class Tree:
    """The copy, with the mutants of one list in it."""

    def __init__(self, source, work, mutants):
        self.source, self.mutants = source, mutants
        self.tree = work / "tree"
        # As the preset has it below the repository: where there is a cache of compiled files, most are in it.
        self.build = self.tree / "build/release"

    def mutants_of(self, name):
        return [mutant for mutant in self.mutants if mutant.file == name]

    def text_of(self, name, rebuilt=None):
        text = (self.source / name).read_text(encoding="utf-8")
        return instrumented(text, self.mutants_of(name), rebuilt)

    def check(self):
        """Finds each mutant's place; raises one ListError that names all that have none."""
        problems = []
        for mutant in self.mutants:
            try:
                instrumented((self.source / mutant.file).read_text(encoding="utf-8"), [mutant])
            except ListError as error:
                problems.append(str(error))
        if problems:
            raise ListError("\n".join(problems))
        for name in sorted({mutant.file for mutant in self.mutants}):
            self.text_of(name)

    def write(self):
        mutated = {mutant.file for mutant in self.mutants}
        names = files_of(self.source)
        for name in names:
            mode = (self.source / name).stat().st_mode & 0o777
            content = self.text_of(name).encode() if name in mutated else (self.source / name).read_bytes()
            write_if_changed(self.tree / name, content, mode)
        write_if_changed(self.tree / HEADER_NAME, HEADER.encode())
        wanted = {*names, HEADER_NAME}
        for file in self.tree.rglob("*"):
            name = file.relative_to(self.tree).as_posix()
            if not name.startswith("build/") and file.is_file() and name not in wanted:
                file.unlink()

    def write_one(self, name, rebuilt=None):
        write_if_changed(self.tree / name, self.text_of(name, rebuilt).encode())

    def configure(self):
        self.say(["cmake", "-S", self.tree, "-B", self.build, *CONFIGURATION])

    def make(self, programs, jobs):
        self.say(["cmake", "--build", self.build, "-j", str(jobs), "--target", *programs, "--", "-k", "0"])

    def say(self, command):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            said = (done.stdout + done.stderr).splitlines()
            errors = [line for line in said if re.search(r"\berror\b:? ", line, re.I) and "ccache" not in line]
            raise BuildError("\n".join(["the copy does not build", *(errors or said[-40:])]))
