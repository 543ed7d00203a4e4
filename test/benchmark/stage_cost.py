#!/usr/bin/env python3
"""What the real-time stages cost in instructions and memory traffic, and what that makes of them on boards nobody has here.

  stage_cost.py count BUILD -o COUNTS.json           by valgrind's callgrind, of this machine's build
  stage_cost.py count BUILD --cross BUILD --sysroot DIR -o COUNTS.json
                                                     by qemu-aarch64 and a plugin, of the ARM64 build
  stage_cost.py check BUILD -o COUNTS.json           counts, and compares with stage_costs.json beside this file
  stage_cost.py accept COUNTS.json                   takes what was counted into stage_costs.json
  stage_cost.py compare BEFORE.json AFTER.json       counts as ratios
  stage_cost.py predict [-o FILE.json] [--time BUILD]
                                                     times on boards from stage_costs.json; --time: and this machine's,
                                                     beside what it needs

Exit: 0; 1: a stage costs over 5 % more, or something went wrong (one line); 77: there is nothing to compare with.
Counts are the same from run to run. docs/costs.md says what they depend on.
"""
import argparse
import json
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

import cost_model

REFERENCE = pathlib.Path(__file__).resolve().parent / "stage_costs.json"
FORMAT = "alidade stage costs 1"
ALLOWED = 0.05  # of a stage's instructions
NOTHING_TO_COMPARE = 77  # ctest: skipped
LINE = 64  # bytes of a cache line
# A Cortex-A53's with the least second-level cache that boards have. Fixed, so that the host's play no part.
CACHES = {"I1": "32768,2,64", "D1": "32768,4,64", "LL": "524288,16,64"}
# No processor is to choose other functions of the C library, nor libjpeg-turbo others of its own, than another would.
ENVIRONMENT = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX,-FMA,-FMA4,-AVX512F,-ERMS,-FSRM", "LD_BIND_NOW": "1",
               "JSIMD_FORCESSE2": "1", "LC_ALL": "C"}


class CostError(Exception):
    """One line for the user: what, where, what would be right."""


def read_pieces(text):
    """Of stage_cost's output: (compiler, [[stage, calls, seconds or None]])."""
    lines = text.splitlines()
    if not lines or not lines[0].startswith("compiler "):
        raise CostError("stage_cost: its first line names no compiler; build the target stage_cost anew")
    pieces = []
    for line in lines[1:]:
        words = line.split()
        if len(words) not in (2, 3):
            raise CostError(f"stage_cost: line '{line}' is not STAGE CALLS [SECONDS]; build the target stage_cost anew")
        pieces.append([words[0], int(words[1]), float(words[2]) if len(words) == 3 else None])
    return lines[0].removeprefix("compiler "), pieces


def read_callgrind(text):
    """Of the dumps in callgrind's output: one {event: count} each; the last, at the program's end, is left out."""
    events = re.search(r"^events: (.+)$", text, re.MULTILINE)
    totals = re.findall(r"^totals: (.+)$", text, re.MULTILINE)
    if not events or not totals:
        raise CostError("callgrind: no events or no totals in its output; valgrind 3.19 writes both")
    names = events[1].split()
    return [dict(zip(names, map(int, line.split()))) for line in totals[:-1]]


def costs_of_callgrind(counts):
    """One dump's counts as what is kept."""
    misses = sum(counts.get(name, 0) for name in ("ILmr", "DLmr", "DLmw"))
    written_back = sum(counts.get(name, 0) for name in ("ILdmr", "DLdmr", "DLdmw"))
    return {"instructions": counts["Ir"], "accesses": counts["Dr"] + counts["Dw"],
            "l1_misses": counts["I1mr"] + counts["D1mr"] + counts["D1mw"], "memory_bytes": LINE * (misses + written_back)}


def read_plugin(text):
    """Of what stage_count_plugin wrote, one dict a piece of work."""
    return [{"instructions": int(i), "accesses": int(a)} for i, a in re.findall(r"^counted (\d+) (\d+)$", text, re.MULTILINE)]


def gather(pieces, costs):
    """{stage: {cost: a call's mean}}, and as `most` the instructions of the dearest call, where calls were counted alone."""
    if len(pieces) != len(costs):
        raise CostError(f"{len(pieces)} pieces of work, but {len(costs)} were counted; build stage_cost and the plugin anew")
    stages = {}
    for (stage, calls, _), cost in zip(pieces, costs):
        stages.setdefault(stage, []).append((calls, cost))
    out = {}
    for stage, parts in stages.items():
        calls = sum(n for n, _ in parts)
        out[stage] = {name: round(sum(c[name] for _, c in parts) / calls, 1) for name in parts[0][1]}
        if all(n == 1 for n, _ in parts):
            out[stage]["most"] = max(c["instructions"] for _, c in parts)
    return out


def run(command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["said nothing"])[-1]
        raise CostError(f"{pathlib.Path(command[0]).name} failed ({done.returncode}): {last}")
    return done


def program(build, name):
    file = pathlib.Path(build) / "test/benchmark" / name
    if not file.exists():
        raise CostError(f"{file} is missing; build it: cmake --build {build} --target {name.removesuffix('.so').removeprefix('lib')}")
    return file


def tool(name, package):
    found = shutil.which(name)
    if found is None:
        raise CostError(f"{name} is not installed; apt-get install {package}")
    return found


def count(build, cross=None, sysroot=None):
    """{"compiler", "counter", "stages"} of a build."""
    with tempfile.TemporaryDirectory(dir=pathlib.Path(build)) as folder:
        run([program(build, "stage_frames"), folder])
        if cross is None:
            valgrind = tool("valgrind", "valgrind")
            out = pathlib.Path(folder, "callgrind")
            done = run([valgrind, "--tool=callgrind", "--instr-atstart=no", "--collect-atstart=no", "--combine-dumps=yes",
                        "--dump-line=no", "--cache-sim=yes", "--simulate-wb=yes", f"--callgrind-out-file={out}",
                        *(f"--{name}={size}" for name, size in CACHES.items()),
                        program(build, "stage_cost"), "callgrind", folder], env=ENVIRONMENT)
            compiler, pieces = read_pieces(done.stdout)
            costs = [costs_of_callgrind(counts) for counts in read_callgrind(out.read_text())]
            counter = run([valgrind, "--version"]).stdout.strip()
        else:
            qemu = tool("qemu-aarch64", "qemu-user")
            plugin = program(build, "libstage_count_plugin.so")
            done = run([qemu, "-cpu", "cortex-a72", "-L", sysroot, "-plugin", plugin,
                        program(cross, "stage_cost"), "mark", folder], env={"LD_BIND_NOW": "1", "LC_ALL": "C"})
            compiler, pieces = read_pieces(done.stdout)
            costs = read_plugin(done.stderr)
            counter = run([qemu, "-version"]).stdout.split(" (")[0]
    return {"compiler": compiler, "counter": counter, "stages": gather(pieces, costs)}


def measured_times(build):
    """{stage: median seconds of a call} on this machine."""
    with tempfile.TemporaryDirectory(dir=pathlib.Path(build)) as folder:
        run([program(build, "stage_frames"), folder])
        _, pieces = read_pieces(run([program(build, "stage_cost"), "time", folder]).stdout)
    times = {}
    for stage, calls, seconds in pieces:
        times.setdefault(stage, []).append(seconds / calls)
    return {stage: statistics.median(of_stage) for stage, of_stage in times.items()}


def key_of(compiler):
    """Counts of one key can be compared: processor and compiler without its patch level."""
    words = compiler.split()
    if len(words) != 4:
        raise CostError(f"stage_cost was built as '{compiler}', not 'PROCESSOR COMPILER VERSION BUILD-TYPE'; use a CMake preset")
    return " ".join([words[0], words[1], words[2].split(".")[0], words[3]])


def read_json(file):
    """What a file of counts holds, or a line that says what is wrong with it."""
    try:
        content = json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
    except OSError as error:
        raise CostError(f"{file}: {error.strerror}; stage_cost.py count -o makes such a file") from None
    except ValueError as error:
        raise CostError(f"{file}: not JSON: {error}; stage_cost.py count -o makes such a file") from None
    return content


def check_counts(file, counts):
    """Of one build: every stage has a positive number of instructions."""
    stages = counts.get("stages") if isinstance(counts, dict) else None
    if not isinstance(stages, dict) or not stages or not isinstance(counts.get("compiler"), str):
        raise CostError(f'{file}: holds no counts; {{"compiler": ..., "stages": {{STAGE: {{"instructions": N}}}}}} would be right')
    for stage, cost in stages.items():
        value = cost.get("instructions") if isinstance(cost, dict) else None
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
            raise CostError(f"{file}: stage {stage}: instructions is {value!r}; a positive number would be right")
    return counts


def read_counts(file):
    return check_counts(file, read_json(file))


def read_reference(file):
    """{key: counts}."""
    content = read_json(file)
    if not isinstance(content, dict) or content.get("format") != FORMAT or not isinstance(content.get("counts"), dict):
        raise CostError(f'{file}: not of the format "{FORMAT}"; stage_cost.py accept COUNTS.json writes it')
    for counts in content["counts"].values():
        check_counts(file, counts)
    return content["counts"]


def write_json(file, content):
    pathlib.Path(file).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def compare(reference, counted):
    """(lines of a table, what is wrong, what is better), of two {stage: cost}."""
    table = ["| stage | before | now | ratio |", "|---|---|---|---|"]
    wrong, better = [], []
    for stage in list(reference) + [s for s in counted if s not in reference]:
        if stage not in counted:
            wrong.append(f"stage {stage} was not counted any more")
        elif stage not in reference:
            wrong.append(f"stage {stage} is new")
        else:
            before, now = reference[stage]["instructions"], counted[stage]["instructions"]
            ratio = now / before
            table.append(f"| {stage} | {before:,.0f} | {now:,.0f} | {ratio:.3f} |")
            said = f"stage {stage}: {now:,.0f} instructions, {abs(ratio - 1):.1%} {'more' if ratio > 1 else 'less'} than {before:,.0f}"
            if ratio > 1 + ALLOWED:
                wrong.append(said)
            elif ratio < 1 - ALLOWED:
                better.append(said)
    return table, wrong, better


def judge(known, counts, counts_file):
    """Prints how counts compare with the reference of their key; returns the exit code."""
    key = key_of(counts["compiler"])
    if key not in known:
        print(f"no reference for {key} (there is {', '.join(known)}): nothing to compare with; "
              f"to have one: stage_cost.py accept {counts_file}")
        return NOTHING_TO_COMPARE
    table, wrong, better = compare(known[key]["stages"], counts["stages"])
    print("\n".join(table))
    for line in better:
        print(f"better: {line}")
    for line in wrong:
        print(f"WRONG: {line}; {ALLOWED:.0%} more is allowed")
    if wrong or better:
        print(f"if that is wanted: stage_cost.py accept {counts_file}, and commit stage_costs.json")
    return 1 if wrong else 0


def check(arguments):
    known = read_reference(arguments.reference)
    counts = count(arguments.build)
    write_json(arguments.output, counts)
    return judge(known, counts, arguments.output)


def accept(arguments):
    counts = read_counts(arguments.counts)
    known = read_reference(arguments.reference) if arguments.reference.exists() else {}
    known[key_of(counts["compiler"])] = counts
    write_json(arguments.reference, {"format": FORMAT, "counts": known})
    print(f"{arguments.reference}: has what was counted for {key_of(counts['compiler'])}")
    return 0


def predict(arguments):
    known = read_reference(arguments.reference)
    by_processor = {key.split()[0]: counts["stages"] for key, counts in known.items()}
    for processor in ("x86_64", "aarch64"):
        if processor not in by_processor:
            raise CostError(f"{arguments.reference}: no counts of {processor}; stage_cost.py count makes them")
    times = measured_times(arguments.time) if arguments.time else None
    report = cost_model.predict(by_processor["x86_64"], by_processor["aarch64"], times)
    print(cost_model.markdown(report))
    if arguments.output:
        write_json(arguments.output, report)
    return 0


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("count", "check"):
        command = commands.add_parser(name)
        command.add_argument("build", type=pathlib.Path)
        command.add_argument("-o", "--output", type=pathlib.Path, required=True)
    commands.choices["count"].add_argument("--cross", type=pathlib.Path)
    commands.choices["count"].add_argument("--sysroot", type=pathlib.Path)
    command = commands.add_parser("accept")
    command.add_argument("counts", type=pathlib.Path)
    command = commands.add_parser("compare")
    command.add_argument("before", type=pathlib.Path)
    command.add_argument("after", type=pathlib.Path)
    command = commands.add_parser("predict")
    command.add_argument("-o", "--output", type=pathlib.Path)
    command.add_argument("--time", type=pathlib.Path, metavar="BUILD")
    for name in ("check", "accept", "predict"):
        commands.choices[name].add_argument("--reference", type=pathlib.Path, default=REFERENCE)
    arguments = parser.parse_args(argv)
    if arguments.command == "count":
        if (arguments.cross is None) != (arguments.sysroot is None):
            raise CostError("count: --cross and --sysroot go together: the ARM64 build and what it was linked against")
        write_json(arguments.output, count(arguments.build, arguments.cross, arguments.sysroot))
        return 0
    if arguments.command == "compare":
        table, wrong, better = compare(read_counts(arguments.before)["stages"], read_counts(arguments.after)["stages"])
        print("\n".join(table + wrong + better))
        return 1 if wrong else 0
    return {"check": check, "accept": accept, "predict": predict}[arguments.command](arguments)


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except CostError as problem:
        print(f"stage_cost.py: {problem}", file=sys.stderr)
        sys.exit(1)
