"""Reads what the linker made of each program: position-independent, relocations read-only and bound at start, canaries on the
stack, the C library's checked functions.

usage: check_hardening.py PROGRAM...
"""

import pathlib
import re
import subprocess
import sys


def read(program, *what):
    return subprocess.run(["readelf", "--wide", *what, program], capture_output=True, text=True, check=True).stdout


def faults_of(program):
    header, segments, dynamic, symbols = (read(program, what) for what in ("--file-header", "--program-headers", "--dynamic", "--dyn-syms"))
    expected = {
        "is not position-independent": re.search(r"Type:\s+DYN", header) and re.search(r"FLAGS_1\).*\bPIE\b", dynamic),
        "has no relocations that become read-only": "GNU_RELRO" in segments,
        "binds its symbols while it runs": re.search(r"\((FLAGS\).*BIND_NOW|FLAGS_1\).*\bNOW\b|BIND_NOW\))", dynamic),
        "has no canaries on its stack": "__stack_chk_fail" in symbols,
        "calls no function of the C library that checks sizes": re.search(r"\s__\w+_chk\b", symbols),
        "has a stack that can be executed": re.search(r"GNU_STACK.*\sRW\s", segments),
        "has a segment that can be both written and executed": not re.search(r"LOAD.*\sRWE\s", segments),
    }
    return [fault for fault, fine in expected.items() if not fine]


def main():
    assert len(sys.argv) > 1, __doc__
    rc = 0
    for program in map(pathlib.Path, sys.argv[1:]):
        for fault in faults_of(program):
            print(f"{program.name}: {fault}")
            rc = 1
    return rc


sys.exit(main())
