"""Servers and hands through an evening's worth of trouble: loss, floods, kills, stops and clocks that are set.

usage: check_soak.py FOLDER_OF_PROGRAMS FLOOD WALL_CLOCK FOLDER_OF_SCENES [--minutes N] [--out FOLDER]

Two servers with keys and recordings, each behind a link that delays, loses, doubles and reorders:

    lasting   runs from the beginning to the end and is flooded once a minute. A hand is on it all the time; another one comes and
              goes once a minute: ended, killed, or stopped for a while and then ended.
    killed    is killed once a minute and started again by the same command line (--resume), each time with another CLOCK_MONOTONIC
              (a time namespace, `unshare --time`), as after a move to another machine. A hand is on it all the time.

The clock on the wall of all of them is set once a minute, forwards and backwards by up to a year, under the running programs
(tests/programs/soak/wall_clock.cpp). CLOCK_MONOTONIC of a running process cannot be set, on no system: the simulated worlds do that to both
ends (palpate-lab world).

What has to hold: each end in order leaves a whole report; each recording can be read, with nothing damaged but the end of those
that were killed; both lasting hands feel each press but those in which their server was away, and no force steps by more than a
ramp (docs/safety.md) does; memory of what lasts stays flat.
"""

import argparse
import contextlib
import datetime
import json
import os
import pathlib
import random
import re
import signal
import struct
import subprocess
import tempfile
import threading
import time

import numpy

from running import PATIENCE_S, Program, WatchedServer, end, free_port, run, site_keys

CYCLE_S = 60
PRESS_S = 4  # a press: down, hold, up
PRESSED_M, ABOVE_M, ASIDE_M = 0.008, 0.010, 0.025
TOP_M, MIDDLE_M = 0.075, 0.0525  # of touch-cube.json
TICK_S = 1e-3
RAMP_TICKS = 20  # docs/safety.md: a force that comes or goes takes 50 ticks, one that ends because the machine stood still 20
AWAY_S = 10      # a server that is back has its hand again within
SAMPLE_S = 5
READ_S = 1200    # a recording of an hour
FLAT_MB = 2.0    # second half over first half, after the warm-up, in an hour
FLOOD_HZ, FLOOD_PORTS, FLOOD_S = 20_000, 2_000, 8
LINK = ("--rtt-ms", 60, "--jitter-ms", 5, "--loss-pct", 3, "--burst", 2, "--duplicate-pct", 1, "--reorder-pct", 1)
YEAR_S = 365 * 86400


def write_motion(file, seconds, x_m):
    """Presses on the cube's top, one after the other; the tool is in it for half of each."""
    rows = ["t_s,x_m,y_m,z_m"]
    for k in range(int(seconds / PRESS_S) + 1):
        for share, height in ((0, ABOVE_M), (0.15, ABOVE_M), (0.4, -PRESSED_M), (0.6, -PRESSED_M), (0.85, ABOVE_M)):
            rows.append(f"{(k + share) * PRESS_S:.3f},{x_m:.6f},{MIDDLE_M:.6f},{TOP_M + height:.6f}")
    file.write_text("\n".join(rows) + "\n")


class WallClock:
    """One for all programs (tests/programs/soak/wall_clock.cpp)."""

    def __init__(self, file, library):
        self.file, self.set_s = file, []
        self.environment = {"LD_PRELOAD": str(library), "PALPATE_WALL_CLOCK": str(file)}
        file.write_bytes(struct.pack("=q", 0))

    def set(self, ahead_s):
        with self.file.open("r+b") as mapped:
            mapped.write(struct.pack("=q", ahead_s))
        self.set_s.append(ahead_s)


def can_move_monotonic():
    return subprocess.run(["unshare", "-r", "--time", "--fork", "--monotonic", "1000", "true"], capture_output=True).returncode == 0


def child_of(pid):
    """Of a program that runs under another one; itself where it has none."""
    children = pathlib.Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return int(children[0]) if children else pid


def resident_mb(pid):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmRSS:\s+(\d+) kB", status).group(1)) / 1024


class Memory:
    """Of what lasts, sampled in a thread of its own."""

    def __init__(self, pids):
        self.rows, self.over = {name: [] for name in pids}, threading.Event()
        self.begin, self.pids = time.monotonic(), pids
        self.thread = threading.Thread(target=self.sample, daemon=True)
        self.thread.start()

    def sample(self):
        while not self.over.wait(SAMPLE_S):
            for name, pid in self.pids.items():
                with contextlib.suppress(OSError, AttributeError):  # it has just ended
                    self.rows[name].append((time.monotonic() - self.begin, resident_mb(pid)))

    def figures(self):
        """Megabytes; both halves of what follows a warm-up of a tenth, five minutes at most."""
        self.over.set()
        self.thread.join()
        said = {}
        for name, rows in self.rows.items():
            t, size = numpy.array(rows).T
            late = t > min(300, t[-1] / 10)
            t, size = t[late], size[late]
            halves = numpy.array_split(size, 2)
            said[name] = {"first_half_mb": halves[0].mean(), "second_half_mb": halves[1].mean(), "most_mb": size.max(),
                          "slope_kb_min": 60 * 1024 * numpy.polyfit(t, size, 1)[0]}
        return said


class Soak:
    def __init__(self, options, work):
        self.programs, self.flood, self.scenes, self.minutes, self.work = options.programs, options.flood, options.scenes, options.minutes, work
        self.wall = WallClock(work / "wall_clock", options.wall_clock.resolve())
        self.moves_monotonic = can_move_monotonic()
        self.random = random.Random(self.minutes)
        self.site, self.keys = site_keys(self.programs, work, "lasting", "visitor", "survivor")
        for name, x_m in (("lasting", MIDDLE_M - ASIDE_M), ("survivor", MIDDLE_M), ("visitor", MIDDLE_M + ASIDE_M)):
            write_motion(work / f"{name}.csv", 60 * self.minutes + 2 * PATIENCE_S, x_m)
        self.counts = {"floods": 0, "kills": 0, "visits": 0, "visits killed": 0, "visits stopped": 0}
        self.back_s, self.away_s, self.killed_visits, self.faults, self.ends = [], [], [], [], contextlib.ExitStack()

    def expect(self, holds, what):
        """What does not hold is said at once and fails the whole at its end: an hour goes on."""
        if holds:
            return
        print(f"fault: {what}", flush=True)
        self.faults.append(what)

    def server(self, name, port, under=()):
        return self.ends.enter_context(WatchedServer(
            self.programs, self.scenes / "touch-cube.json", "--keys", self.site, "--record", self.work / f"{name}.rec", "--resume", "--log",
            "json", listen=f"127.0.0.1:{port}", environment=self.wall.environment, under=under))

    def relay(self, to):
        relay = self.ends.enter_context(Program(self.programs / "palpate-relay", "--listen", "127.0.0.1:0", "--to", to, *LINK))
        relay.address = relay.wait_for(r"(127\.0\.0\.1:\d+)").group(1)
        return relay

    def hand(self, name, relay, *arguments):
        hand = self.ends.enter_context(Program(
            self.programs / "palpate-client", "--server", relay.address, "--key", self.keys[name], "--motion", self.work / f"{name}.csv",
            "--realtime", "off", "--duration-s", 60 * self.minutes + 2 * PATIENCE_S, *arguments, environment=self.wall.environment))
        return hand

    # --- what happens once a minute -------------------------------------------------------------------------------------

    def flood_it(self, cycle):
        kind = ("noise", "hello", "beat")[cycle % 3]
        with Program(self.flood, self.lasting.address, kind, FLOOD_HZ, FLOOD_PORTS, FLOOD_S) as flood:
            assert flood.ended() == 0, flood.lines
        self.counts["floods"] += 1

    def kill_server(self):
        os.kill(child_of(self.killed.process.pid), signal.SIGKILL)
        self.killed.ended()
        self.counts["kills"] += 1
        pause_s = self.random.uniform(0.2, 4)
        time.sleep(pause_s)
        began = time.monotonic()
        self.start_killed()
        self.killed.wait_for('"event":"resumed"')
        self.killed.wait_for('"event":"joined".*"survivor"')
        back_s = time.monotonic() - began
        self.expect(back_s < AWAY_S, f"the hand was back {back_s:.1f} s after its server")
        self.back_s.append(back_s)
        self.away_s.append(pause_s + back_s)

    def start_killed(self):
        away = ["unshare", "-r", "--time", "--fork", "--kill-child", "--monotonic", str(self.random.randrange(10**7))]
        self.killed = self.server("killed", self.killed_port, away if self.moves_monotonic else ())

    def set_clock(self):
        self.wall.set(self.random.choice((-1, 1)) * self.random.choice((60, 3600, 86400, 30 * 86400, YEAR_S)))

    def visit(self, cycle):
        """The visitor that is there goes, and comes again."""
        how = ("ended", "killed", "stopped")[cycle % 3]
        if how == "stopped":
            self.visitor.send(signal.SIGSTOP)
            time.sleep(self.random.uniform(0.5, 6))
            self.visitor.send(signal.SIGCONT)
            time.sleep(3)
        if how == "killed":
            self.visitor.send(signal.SIGKILL)
            self.visitor.ended()
            self.killed_visits.append(self.work / f"visit_{self.counts['visits']}.rec")
        else:
            end(self.visitor, signal.SIGINT)
            self.check_report(self.work / f"visit_{self.counts['visits']}")
        self.counts["visits"] += 1
        self.counts["visits killed"] += how == "killed"
        self.counts["visits stopped"] += how == "stopped"
        self.start_visitor()

    def start_visitor(self):
        name = f"visit_{self.counts['visits']}"
        self.visitor = self.hand("visitor", self.to_lasting, "--report", self.work / name, "--record", self.work / f"{name}.rec",
                                 "--device", "sim")
        self.visitor.wait_for("^motion of")

    # --- what has to hold -----------------------------------------------------------------------------------------------

    def check_report(self, folder):
        rows = numpy.loadtxt(folder / "forces.csv", delimiter=",", skiprows=1)
        summary = json.loads((folder / "summary.json").read_text())
        whole = 0 < len(rows) == summary["recorded_ticks"] and numpy.isfinite(rows).all() and not list(folder.glob("*.part"))
        self.expect(whole and summary["unrecorded_ticks"] == 0, f"{folder}: {len(rows)} rows, {summary['unrecorded_ticks']} ticks left out")
        (folder / "forces.csv").unlink()  # an hour has many

    def check_recordings(self, killed):
        """Nothing is damaged but the ends of those that were killed."""
        recordings = sorted(self.work.glob("*.rec"))
        for recording in recordings:
            out = self.work / "summary"
            done = run(self.programs, "palpate-lab", "summary", "--recording", recording, "--out", out, patience_s=READ_S)
            if done.returncode != 0:
                self.expect(False, f"{recording}: {done.stderr}")
                continue
            said = json.loads((out / "summary.json").read_text())
            self.expect(said["damaged_places"] == 0 and (said["complete"] or recording in killed), f"{recording}: {done.stderr}")
        return len(recordings)

    def felt(self, name):
        """Of a lasting hand: t, |F| and largest step of the force in a tick."""
        done = run(self.programs, "palpate-lab", "export", "--recording", self.work / f"{name}_hand.rec", "--out", self.work / name,
                   patience_s=READ_S)
        assert done.returncode == 0, done.stderr
        rows = numpy.loadtxt(next((self.work / name).glob("**/forces.csv")), delimiter=",", skiprows=1, usecols=(0, 1, 2, 3))
        together = numpy.diff(rows[:, 0]) < 1.5 * TICK_S
        step = numpy.linalg.norm(numpy.diff(rows[:, 1:], axis=0), axis=1)[together].max()
        return rows[:, 0], numpy.linalg.norm(rows[:, 1:], axis=1), step

    def check_hand(self, name, away_s):
        t, size, step = self.felt(name)
        usual = numpy.median([part.max() for part in numpy.array_split(size, max(1, int((t[-1] - t[0]) / PRESS_S)))])
        pauses = numpy.diff(t[size > usual / 2]).max()
        figures = {"minutes": (t[-1] - t[0]) / 60, "ticks": len(t), "usual_n": usual, "most_n": size.max(), "largest_step_n": step,
                   "longest_without_force_s": pauses}
        print(f"{name}: {json.dumps(figures)}", flush=True)
        self.expect(step < 1.1 * size.max() / RAMP_TICKS, f"{name}: a step of {step:.3f} N of {size.max():.2f}")
        self.expect(pauses < away_s + 2 * PRESS_S, f"{name}: {pauses:.1f} s without a force")

    def check_clock(self):
        """The largest jump between two lines of the lasting server."""
        times = [datetime.datetime.fromisoformat(found.group(1)) for line in self.lasting.lines
                 if (found := re.search(r'"time":"([^"]+)Z"', line))]
        jump_s = max(abs((b - a).total_seconds()) for a, b in zip(times, times[1:]))
        self.expect(jump_s > 0.4 * max(map(abs, self.wall.set_s)), f"the clock jumped by {jump_s} s only")
        return jump_s

    # --- the whole ------------------------------------------------------------------------------------------------------

    def begin(self):
        self.killed_port = free_port()
        self.lasting = self.server("lasting", 0)
        self.start_killed()
        self.to_lasting, self.to_killed = self.relay(self.lasting.address), self.relay(self.killed.address)
        self.first = self.hand("lasting", self.to_lasting, "--device", "replay", "--record", self.work / "lasting_hand.rec")
        self.survivor = self.hand("survivor", self.to_killed, "--device", "replay", "--record", self.work / "survivor_hand.rec")
        self.start_visitor()
        for hand in (self.first, self.survivor):
            hand.wait_for("^motion of")
        self.memory = Memory({"server": self.lasting.process.pid, "hand": self.first.process.pid, "relay": self.to_lasting.process.pid,
                              "hand of the killed server": self.survivor.process.pid, "its relay": self.to_killed.process.pid})

    def cycle(self, number):
        began = time.monotonic()
        for at_s, act in ((5, lambda: self.flood_it(number)), (18, self.kill_server), (34, self.set_clock), (38, lambda: self.visit(number))):
            time.sleep(max(0, began + at_s - time.monotonic()))
            act()
        time.sleep(max(0, began + CYCLE_S - time.monotonic()))
        for program in (self.lasting, self.killed, self.to_lasting, self.to_killed, self.first, self.survivor, self.visitor):
            assert program.process.poll() is None, f"ended by itself: {program.lines[-5:]}"
        self.expect(self.lasting.get("/healthz")[0] == 200, "the lasting server is not well")

    def finish(self):
        memory = self.memory.figures()
        for hand in (self.visitor, self.first, self.survivor):
            end(hand, signal.SIGINT)
        self.check_report(self.work / f"visit_{self.counts['visits']}")
        pid = child_of(self.killed.process.pid)
        os.kill(pid, signal.SIGTERM)
        assert self.killed.ended() == 0, self.killed.lines[-5:]
        end(self.lasting)
        return memory

    def go(self):
        with self.ends:
            self.begin()
            for number in range(self.minutes * 60 // CYCLE_S):
                self.cycle(number)
                print(f"{number + 1} of {self.minutes * 60 // CYCLE_S} minutes: {self.counts}", flush=True)
            memory = self.finish()
        print(f"what lasts, in memory: {json.dumps(memory, indent=1)}", flush=True)
        print(f"hand back {numpy.mean(self.back_s):.1f} s after its server in the mean, {max(self.back_s):.1f} at most", flush=True)
        print(f"clock on the wall: ahead by {self.wall.set_s} s, largest jump in the log {self.check_clock():.0f} s; "
              f"CLOCK_MONOTONIC of each new server another one: {self.moves_monotonic}")
        killed = sorted(self.work.glob("killed*.rec"), key=lambda file: file.stat().st_mtime)[:-1] + self.killed_visits
        print(f"{self.check_recordings(killed)} recordings can be read", flush=True)
        self.check_hand("lasting", 0)
        self.check_hand("survivor", max(self.away_s))
        for name, size in memory.items():
            grown = size["second_half_mb"] - size["first_half_mb"]
            self.expect(grown < FLAT_MB, f"{name}: {grown:.2f} MB more in the second half")
        assert not self.faults, self.faults
        print("nothing was lost")


def main():
    parser = argparse.ArgumentParser()
    for name in ("programs", "flood", "wall_clock", "scenes"):
        parser.add_argument(name, type=pathlib.Path)
    parser.add_argument("--minutes", type=int, default=3)
    parser.add_argument("--out", type=pathlib.Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = options.out or pathlib.Path(folder)
        work.mkdir(parents=True, exist_ok=True)
        Soak(options, work).go()


if __name__ == "__main__":
    main()
