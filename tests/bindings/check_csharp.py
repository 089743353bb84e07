"""The example in C# says what the example in C says, line by line, and an error has the library's text.

usage: check_csharp.py SOURCES BUILD WORK      exit 77 without mcs and mono (Debian packages mono-mcs, mono-runtime)
"""

import os
import shutil
import subprocess
import sys

from running import Places

places = Places()
if not (shutil.which("mcs") and shutil.which("mono")):
    print("mcs and mono are not installed")
    sys.exit(77)
environment = {**os.environ, "LD_LIBRARY_PATH": str(places.build / "lib")}
program, in_c = places.work / "press.exe", places.work / "press"
subprocess.run(["mcs", "-warnaserror", f"-out:{program}", places.sources / "examples/csharp/press.cs"], check=True)
subprocess.run(["cc", "-I", places.sources / "bindings/c", places.sources / "examples/c/press.c", "-L", places.build / "lib", "-lpalpate", "-o", in_c],
               check=True)


def said_by(*command):
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)


scene = places.scene("touch-stiffening")
sharp, c = said_by("mono", program, scene), said_by(in_c, scene)
assert sharp.returncode == 0 and c.returncode == 0, sharp.stderr + c.stderr
assert len(c.stdout.splitlines()) == 20 and sharp.stdout.replace("-0.000", "0.000") == c.stdout.replace("-0.000", "0.000"), (sharp.stdout, c.stdout)
missing = said_by("mono", program, "/no/such/scene.json")
assert missing.returncode == 2 and missing.stderr == said_by(in_c, "/no/such/scene.json").stderr, missing.stderr
assert "/no/such/scene.json" in missing.stderr and missing.stderr.count("\n") == 1, missing.stderr
alone = said_by("mono", program)
assert alone.returncode == 2 and alone.stderr == "usage: press.exe SCENE\n", alone.stderr
