#!/usr/bin/env python3
"""The program and the libraries of a build are hardened: their own code is looked at, not notes that say so.

    hardening_test.py PROCESSOR BUILD TOOLS     CMake's name of the processor; its build folder; the prefix of its nm and readelf
"""
import pathlib
import re
import struct
import subprocess
import sys
import unittest

PROCESSOR, BUILD, TOOLS = "", pathlib.Path(), ""
# What a function may begin with, where indirect calls land nowhere else: endbr64; bti c, bti jc, paciasp. 32-bit ARM has no such thing.
LANDINGS = {"x86_64": {b"\xf3\x0f\x1e\xfa"},
            "aarch64": {struct.pack("<I", word) for word in (0xd503245f, 0xd50324df, 0xd503233f)}}
# What each of them does too little for a canary or a checked call, or none at all.
ROOMS = ("core", "platform", "edge_app")


def asked(tool, *arguments):
    return subprocess.run([TOOLS + tool, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


class Hardening(unittest.TestCase):
    def setUp(self):
        self.program = BUILD / "edge_app/alidade"

    def functions(self):
        """Name and address of those that another source could call: they are never left out as unreachable by a pointer."""
        found = re.findall(r"^([0-9a-f]+) T (_ZNK?7alidade\S+)$", asked("nm", self.program), re.M)
        return {name: int(address, 16) for address, name in found if not re.search(r"\.(cold|part|isra|constprop)", name)}

    def test_calls_land_where_the_compiler_meant_them_to(self):
        landings = LANDINGS.get(PROCESSOR)
        if landings is None:
            self.skipTest(f"{PROCESSOR} has no such instruction")
        text = re.search(r" \.text +PROGBITS +([0-9a-f]+) ([0-9a-f]+) ", asked("readelf", "-SW", self.program))
        batch = re.search(r" \.text\.batch +PROGBITS +([0-9a-f]+) ([0-9a-f]+) ", asked("readelf", "-SW", self.program))
        shifts = {int(at, 16) - int(offset, 16) for at, offset in (found.groups() for found in (text, batch) if found)}
        self.assertEqual(len(shifts), 1)
        shift = shifts.pop()
        code = self.program.read_bytes()
        functions = self.functions()
        self.assertGreater(len(functions), 1000)
        bare = [name for name, address in functions.items() if code[address - shift:address - shift + 4] not in landings]
        self.assertEqual(bare, [])

    def test_each_room_has_canaries_and_some_have_checked_calls(self):
        checked = set()
        for room in ROOMS:
            libraries = sorted((BUILD / room).rglob("libalidade_*.a"))
            self.assertGreaterEqual(len(libraries), 1)
            for library in libraries:
                undefined = re.findall(r" U (\S+)", asked("nm", "-u", library))
                self.assertIn("__stack_chk_fail", undefined, library)
                checked |= {name for name in undefined if re.fullmatch(r"__\w+_chk", name)}
        # Of the libraries' own code: what is linked statically from Debian has some, too.
        self.assertGreaterEqual(len(checked), 3, checked)

    def test_the_program_is_laid_out_anew_and_its_tables_are_read_only(self):
        said = asked("readelf", "-hldW", self.program)
        self.assertRegex(said, r"Type: +DYN ")
        self.assertRegex(said, r"FLAGS_1\) +Flags: NOW PIE")
        self.assertRegex(said, r"BIND_NOW")
        self.assertRegex(said, r"GNU_RELRO ")
        self.assertRegex(said, r"GNU_STACK .* RW +0x")
        self.assertNotIn("TEXTREL", said)
        self.assertNotRegex(said, r"LOAD .* RWE ")


if __name__ == "__main__":
    PROCESSOR, BUILD, TOOLS = sys.argv[1], pathlib.Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else ""
    unittest.main(argv=[sys.argv[0], "-v"])
