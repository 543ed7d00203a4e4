"""Whether the compiler made vector instructions of core/realtime's vectors: where it cannot, it makes loops over lanes,
which are right, and ten times slower.

    vector_instructions.py OBJDUMP PROCESSOR LIBRARY
"""
import re
import subprocess
import sys

# Of bytes (fast_corners, pyramid) and of floats (patch_alignment), as objdump writes them.
WANTED = {
    "x86_64": {"fast_corners.cpp.o": (r"\bpmaxub\b", r"\bpminub\b"), "pyramid.cpp.o": (r"\bpackuswb\b|\bpshufb\b|\bpand\b",),
               "patch_alignment.cpp.o": (r"\bmulps\b", r"\baddps\b")},
    "aarch64": {"fast_corners.cpp.o": (r"\bumax\s+v\d+\.16b", r"\bumin\s+v\d+\.16b"), "pyramid.cpp.o": (r"\buzp1\s+v\d+\.16b",),
                "patch_alignment.cpp.o": (r"\bfmla\s+v\d+\.4s|\bfmul\s+v\d+\.4s",)},
    "armv7l": {"fast_corners.cpp.o": (r"\bvmax\.u8\s+q", r"\bvmin\.u8\s+q"), "pyramid.cpp.o": (r"\bvuzp\.8\s+q",)},
}


def main():
    objdump, processor, library = sys.argv[1:]
    if processor not in WANTED:
        sys.exit(f"vector_instructions: no instructions are known of '{processor}', only of {', '.join(WANTED)}")
    listing = subprocess.run([objdump, "-d", "--no-show-raw-insn", library], check=True, stdout=subprocess.PIPE, text=True).stdout
    members = dict(re.findall(r"^(\S+\.o): +file format.*?\n(.*?)(?=^\S+\.o: |\Z)", listing, re.M | re.S))
    missing = [f"{member}: {pattern}" for member, patterns in WANTED[processor].items() for pattern in patterns
               if not re.search(pattern, members.get(member, ""))]
    if missing:
        sys.exit("no such vector instruction in\n" + "\n".join(missing))
    for member, patterns in WANTED[processor].items():
        print(member, ", ".join(f"{len(re.findall(p, members[member]))} {p}" for p in patterns))


if __name__ == "__main__":
    main()
