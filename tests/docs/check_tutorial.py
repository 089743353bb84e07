"""The organ of docs/tutorials/your-own-organ.md, as it is written there, is a body that the server takes.

usage: check_tutorial.py SERVER
"""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile


def main():
    here = pathlib.Path(__file__).parent
    with tempfile.TemporaryDirectory() as folder:
        with open(f"{folder}/bean.stl", "w", encoding="utf-8") as stl:
            subprocess.run([sys.executable, here / "make_bean.py"], stdout=stl, check=True)
        shutil.copy(here / "bean.json", folder)
        run = subprocess.run([sys.argv[1], "--scene", f"{folder}/bean.json", "--print-scene"], capture_output=True, text=True, check=False)
        assert run.returncode == 0 and not run.stderr, run.stderr
        assert json.loads(run.stdout)["name"] == "bean"


if __name__ == "__main__":
    main()
