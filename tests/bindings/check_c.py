"""libpalpate.so as a C program uses it: the test program and the examples, compiled by a C compiler with all warnings, and run.

usage: check_c.py SOURCES BUILD WORK
"""

import os
import re
import subprocess

import numpy as np
from running import Places, serving

places = Places()
SCENE = "touch-stiffening"
ENVIRONMENT = {**os.environ, "LD_LIBRARY_PATH": str(places.build / "lib")}


def compiled(source, compiler="cc", standard="-std=c11"):
    program = places.work / source.stem
    subprocess.run([compiler, standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-O1", "-I", places.sources / "bindings/c", source,
                    "-L", places.build / "lib", "-lpalpate", "-lm", "-o", program], check=True)
    return program


def said_by(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True, env=ENVIRONMENT, timeout=300).stdout


def check_symbols():
    """The library shows the names of palpate.h, each with its version, and no others."""
    named = set(re.findall(r"^[a-z][a-z*_0-9 ]*\b(palpate_\w+)\(", (places.sources / "bindings/c/palpate.h").read_text(), re.M))
    shown = said_by("nm", "--dynamic", "--defined-only", places.build / "lib/libpalpate.so").split("\n")
    names = {line.split()[-1] for line in shown if line and " A " not in line}
    assert names == {f"{name}@@PALPATE_1" for name in named}, names ^ {f"{name}@@PALPATE_1" for name in named}


def check_press():
    lines = said_by(compiled(places.sources / "examples/c/press.c"), places.scene(SCENE)).splitlines()
    forces = [re.fullmatch(r" *(\d+) ms: (-?[\d.]+) N(?:, felt (-?[\d.]+) N)?", line) for line in lines]
    assert len(lines) == 20 and all(forces), lines
    full = np.array([float(force.group(2)) for force in forces])
    felt = np.array([float(force.group(3) or 0) for force in forces])
    assert full[0] == 0 and full[-1] > 0.5 and np.all(np.diff(full) >= 0), full
    late = full > 0.2  # a patch of 50 ms before, on the hand's own path
    assert late.sum() > 5 and np.abs(felt - full)[late][1:].max() < 0.1 * full.max(), (full, felt)


def check_station():
    program = compiled(places.sources / "examples/c/station.c")
    with serving(places, "cube6") as address:
        said = said_by(program, address)
    parts = re.fullmatch(r'felt at most ([\d.]+) N; (\d+) triangles over (\d+) vertices; 1 tool, "c", ([\d.]+) mm above its start\n', said)
    assert parts and 0.3 < float(parts.group(1)) < 10 and int(parts.group(2)) == 2 * int(parts.group(3)) - 4, said
    assert abs(float(parts.group(4)) - 10) < 1, said


subprocess.run([places.build / "bin/bindings_runs", places.scene(SCENE), places.work, "press"], check=True)
check_symbols()
subprocess.run([compiled(places.sources / "tests/bindings/check_c.c"), places.scene(SCENE), places.work], check=True, env=ENVIRONMENT)
check_press()
check_station()
