"""The binary interface of libpalpate.so beside the recorded one (bindings/c/palpate.abi): names may be added; none may change or leave,
nor may a struct or a parameter.

usage: check_abi.py SOURCES BUILD WORK             exit 77 without abidiff (Debian package abigail-tools)
       check_abi.py SOURCES BUILD WORK --record    after an addition: writes the record anew
"""

import os
import shutil
import subprocess
import sys

from running import Places

record = sys.argv[-1] == "--record" and sys.argv.pop()
places = Places()
if shutil.which("abidiff") is None:
    print("abidiff is not installed")
    sys.exit(77)
library, recorded = places.build / "lib/libpalpate.so", places.sources / "bindings/c/palpate.abi"
HEADER = places.sources / "bindings/c/palpate.h"
# The debug information has the header's path as the compiler was given it: absolute, or relative to the build folder where ccache is told of a base folder.
SPELLINGS = [argument for path in (HEADER, os.path.relpath(HEADER, places.build)) for argument in ("--header-file", path)]


def write(file):
    subprocess.run(["abidw", *SPELLINGS, "--drop-private-types", "--exported-interfaces-only", "--no-corpus-path", "--no-comp-dir-path",
                    "--no-show-locs", "--no-elf-needed", "--no-architecture", library, "--out-file", file], cwd=places.build, check=True)
    file.write_text(file.read_text().replace(str(places.build) + "/", ""))


def differences(old, new):
    """What abidiff says of changes and removals; empty when there are none."""
    compared = subprocess.run(["abidiff", "--no-added-syms", "--no-architecture", old, new], capture_output=True, text=True)
    assert compared.returncode & 3 == 0, compared.stderr + compared.stdout  # 1, 2: abidiff itself failed
    return compared.stdout if compared.returncode else ""


if record:
    write(recorded)
    sys.exit(0)
present = places.work / "present.abi"
write(present)
assert "name='palpate_tick' size-in-bits=" in present.read_text(), "the debug information of libpalpate.so has no struct of palpate.h"
assert differences(recorded, present) == "", differences(recorded, present)

# Planted changes are found: a name that left, a struct that grew, a parameter that is another one.
text = recorded.read_text()
for old, new in (("palpate_body_reset", "palpate_body_restart"), ("name='palpate_tick' size-in-bits='640'", "name='palpate_tick' size-in-bits='384'"),
                 ("name='ticks'/>", "name='ticks'/><parameter type-id='type-id-1' name='more'/>")):
    assert old in text, old
    planted = places.work / "planted.abi"
    planted.write_text(text.replace(old, new))
    assert differences(planted, present), f"not found: {old} became {new}"
