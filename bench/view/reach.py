"""What drawing costs, and whether it disturbs a haptic loop beside it: rounds with and without a window, in turn.

usage: reach.py FOLDER_OF_PROGRAMS [--rounds N] [--seconds S] [--recording FILE] [--scene FILE] [--motion FILE]

Server and client run in every round. With --recording the window plays that instead of watching the server, for example the body
of 20,000 triangles that `fine_recording out/fine.rec` writes. Without a display the window opens in Xvfb.
"""

import argparse
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def options():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=10)
    parser.add_argument("--recording", type=pathlib.Path)
    parser.add_argument("--scene", type=pathlib.Path, default=ROOT / "scenes" / "touch-cube.json")
    parser.add_argument("--motion", type=pathlib.Path, default=ROOT / "scenes" / "motions" / "base-excursion.csv")
    return parser.parse_args()


def window(asked, address):
    what = ["--recording", asked.recording] if asked.recording else ["--server", address]
    program = [asked.programs / "palpate-view", *what, "--duration-s", str(asked.seconds)]
    if not os.environ.get("DISPLAY"):
        if not shutil.which("xvfb-run"):
            sys.exit("reach.py: no display and no xvfb-run")
        program = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", *program]
    return subprocess.Popen(program, stdout=subprocess.PIPE, text=True)


def one_round(asked, with_view):
    """Ticks, late ticks, and what the window said."""
    server = subprocess.Popen([asked.programs / "palpate-server", "--scene", asked.scene, "--listen", "127.0.0.1:0"],
                              stdout=subprocess.PIPE, text=True)
    address = re.search(r"at (127\.0\.0\.1:\d+)", server.stdout.readline()).group(1)
    view = window(asked, address) if with_view else None
    client = subprocess.run([asked.programs / "palpate-client", "--server", address, "--device", "replay", "--motion", asked.motion,
                             "--duration-s", str(asked.seconds)], stdout=subprocess.PIPE, text=True, check=True)
    said = view.communicate()[0].strip() if view else ""
    server.send_signal(signal.SIGTERM)
    server.communicate()
    ticks, late = map(int, re.search(r"(\d+) ticks, (\d+) late", client.stdout).groups())
    return ticks, late, said


def main():
    asked = options()
    total = {False: [0, 0], True: [0, 0]}
    for k in range(asked.rounds):
        for with_view in (False, True):
            ticks, late, said = one_round(asked, with_view)
            total[with_view][0] += ticks
            total[with_view][1] += late
            print(f"round {k + 1}, {'with' if with_view else 'without'} a window: {late} of {ticks} ticks late by more than 0.2 ms")
            if said:
                print("  " + said)
    for with_view, (ticks, late) in total.items():
        print(f"{'with' if with_view else 'without'} a window: {late} of {ticks} ticks late, {100 * late / ticks:.2f} %")


if __name__ == "__main__":
    main()
