"""What is left of a run that is ended, hung up on, or stopped and continued.

usage: check_safety.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy

PATIENCE_S = 120
TICK_S = 1e-3
STEP_MOST_N = 0.3  # in ordinary use of this motion: a tenth of it
COLUMNS = 9
ATTEMPTS = 12


class Server:
    def __init__(self, programs, scene):
        self.process = subprocess.Popen([programs / "palpate-server", "--scene", scene, "--listen", "127.0.0.1:0"], stdout=subprocess.PIPE,
                                        text=True)
        self.address = re.search(r"at (127\.0\.0\.1:\d+)", self.process.stdout.readline()).group(1)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.communicate()


class Hand:
    """A hand whose motion has begun."""

    def __init__(self, programs, server, motion, device, folder):
        self.folder = folder
        self.recording = folder / "hand.rec"
        self.process = subprocess.Popen([programs / "palpate-client", "--server", server.address, "--device", device, "--motion", motion,
                                         "--realtime", "off", "--report", folder, "--record", self.recording], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        for line in self.process.stdout:
            if line.startswith("motion of"):
                break

    def end(self):
        """What it said; it ended well and left everything."""
        said, complaint = self.process.communicate(timeout=PATIENCE_S)
        assert self.process.returncode == 0, f"{self.process.returncode}: {said}{complaint}"
        return said

    def forces(self):
        """Rows of t and force; the file is whole."""
        text = (self.folder / "forces.csv").read_text()
        assert text.endswith("\n") and not list(self.folder.glob("*.part"))
        rows = [line.split(",") for line in text.splitlines()[1:]]
        assert rows and all(len(row) == COLUMNS for row in rows), rows[-1:]
        return numpy.array(rows, dtype=float)[:, [0, 4, 5, 6]]

    def summary(self):
        return json.loads((self.folder / "summary.json").read_text())


def when_it_holds(attempt, needed):
    """The first of several attempts whose circumstances are the needed ones: on a busy machine ticks and patches come late."""
    for k in range(ATTEMPTS):
        result = attempt(k)
        if needed(result):
            return result
    raise AssertionError(f"{ATTEMPTS} attempts, and never what is needed")


def largest_step(rows, halts):
    """Between ticks that follow each other, but for one step to zero for each time that the watchdog took the force away."""
    together = numpy.diff(rows[:, 0]) < 1.5 * TICK_S
    steps = numpy.linalg.norm(numpy.diff(rows[:, 1:], axis=0), axis=1)
    to_zero = together & ~rows[1:, 1:].any(axis=1)
    excused = numpy.flatnonzero(to_zero)[numpy.argsort(-steps[to_zero])[:halts]]
    together[excused] = False
    return steps[together].max()


def check_ending_signals(programs, server, motion, work):
    for which in (signal.SIGHUP, signal.SIGQUIT, signal.SIGABRT, signal.SIGTERM, signal.SIGINT):

        def end_by_signal(attempt):
            hand = Hand(programs, server, motion, "replay", work / f"{which.name}-{attempt}")
            time.sleep(0.6 * (1 + attempt))
            hand.process.send_signal(which)
            hand.end()
            return hand

        hand = when_it_holds(end_by_signal, lambda hand: hand.summary()["ticks"] > 50)
        assert hand.forces().shape[0] > 50, which
        assert hand.recording.stat().st_size > 0, which


def check_pipes(programs, server, motion, work):
    """Nobody reads what it says, and somebody sends PIPE: it goes on to the end of the motion."""
    hand = Hand(programs, server, motion, "replay", work / "pipe")
    hand.process.send_signal(signal.SIGPIPE)
    hand.process.stdout.close()
    hand.process.stderr.close()
    assert hand.process.wait(timeout=PATIENCE_S) == 0
    assert hand.forces()[-1, 0] > 3.5, "the motion takes 4 s"


def check_stop(programs, server, motion, work):
    """Stopped while it moves and continued 3 s later."""
    for device in ("replay", "sim"):

        def stop_for_a_while(attempt):
            hand = Hand(programs, server, motion, device, work / f"{device}-{attempt}")
            time.sleep(1.2)
            hand.process.send_signal(signal.SIGSTOP)
            time.sleep(3)
            hand.process.send_signal(signal.SIGCONT)
            hand.end()
            rows = hand.forces()
            return hand, rows, numpy.diff(rows[:, 0]).argmax()

        # Something was felt just before the stop.
        hand, rows, gap = when_it_holds(stop_for_a_while, lambda run: numpy.linalg.norm(run[1][run[2], 1:]) > 0.1)
        assert rows[gap + 1, 0] - rows[gap, 0] > 2.9, device
        # The device showed what it was given before the stop, or zero where the watchdog acted, in this gap or in another one.
        halts = hand.summary()["watchdog_halts"]
        over_gap = numpy.linalg.norm(rows[gap + 1, 1:] - rows[gap, 1:])
        if halts > 0:
            over_gap = min(over_gap, numpy.linalg.norm(rows[gap + 1, 1:]))
        assert over_gap < STEP_MOST_N, f"{device}: {over_gap} N from what the device showed to the first tick after the stop"
        step = largest_step(rows, halts)
        assert step < STEP_MOST_N, f"{device}: a step of {step} N"
        assert hand.summary()["guard"]["restarts"] >= 1, device


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:])
    motion = scenes / "motions" / "press.csv"
    with tempfile.TemporaryDirectory() as name, Server(programs, scenes / "cube6.json") as server:
        work = pathlib.Path(name)
        check_ending_signals(programs, server, motion, work)
        check_pipes(programs, server, motion, work)
        check_stop(programs, server, scenes / "motions" / "base-excursion.csv", work)


if __name__ == "__main__":
    main()
