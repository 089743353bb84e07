"""The examples of examples/python and of the tutorial, as a reader runs them.

usage: check_examples.py SOURCES BUILD WORK      exit 77 without matplotlib
"""

import importlib.util
import os
import re
import subprocess
import sys

from running import Places, serving

places = Places()
if importlib.util.find_spec("matplotlib") is None:
    print("matplotlib is not installed")
    sys.exit(77)
picture = places.work / "press.png"
picture.unlink(missing_ok=True)
subprocess.run([sys.executable, places.sources / "examples/python/press.py", places.scene("organ"), picture], check=True, cwd=places.work,
               env={**os.environ, "PYTHONPATH": str(places.build / "python")})
assert picture.read_bytes().startswith(b"\x89PNG")

# The tutorial's other blocks, one after the other, with a server of the scene and what it records.
import numpy as np  # noqa: E402
import palpate  # noqa: E402
import palpate.env  # noqa: E402

os.chdir(places.sources)
file = places.work / "session.rec"
file.unlink(missing_ok=True)
names = {"np": np, "palpate": palpate}
blocks = re.findall(r"^```python\n(.*?)^```", (places.sources / "docs/tutorials/python.md").read_text(), re.M | re.S)[1:]
assert len(blocks) == 4, len(blocks)
body, _, recorded, task = (compile(block.replace("session.rec", str(file)), "python.md", "exec") for block in blocks)
exec(body, names)
assert names["contact"].all() and names["forces"].shape == (100, 3)
with serving(places, "touch-cube", "--record", file) as address:
    exec(compile(blocks[1].replace("127.0.0.1:47800", address), "python.md", "exec"), names)
assert names["felt"].force.shape == (500, 3) and names["view"].positions.shape == (len(names["viewer"].rest), 3)
names["scene"] = palpate.Scene(places.scene("touch-cube"))
exec(recorded, names)
assert len(names["again"].felt) > 400
exec(task, names)
assert names["observation"].shape == (7,)
