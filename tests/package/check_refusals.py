"""An example says in one line what it wants, and what went wrong: no argument, no file, no server.

usage: check_refusals.py EXAMPLE
"""

import pathlib
import subprocess
import sys


def refused(*command):
    done = subprocess.run(command, capture_output=True, text=True, timeout=50)
    assert done.returncode == 2 and done.stderr.count("\n") == 1 and not done.stdout, done
    return done.stderr


def main():
    example = pathlib.Path(sys.argv[1])
    assert refused(example).startswith(f"usage: {example.name} ")
    wrong = {"consumer": ["/no/such/scene.json"], "station": ["127.0.0.1:9", "/no/such/motion.csv"], "own_device": ["127.0.0.1:9"]}[example.name]
    said = refused(example, *wrong)
    assert said.startswith(f"{example.name}: ") and wrong[0] in said, said


if __name__ == "__main__":
    main()
