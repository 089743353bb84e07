"""What a flood of datagrams leaves of a server: frames for the hand that is there, a way in for another, and an end when asked.

usage: check_flood.py FOLDER_OF_PROGRAMS FLOOD FOLDER_OF_SCENES [RATE PORTS SECONDS [CASE...]]

A CASE is a kind of flood, as tests/programs/flood/main.cpp has them; with `+keys` against a server with keys, of which the hand and the
newcomer each have one and the flood has the server's public key; `=RATE` gives it a rate of its own. The hand comes over IPv6, so
that the newcomer is nobody's neighbour but the flood's. Prints what it measured; it
fails where somebody does not get in at all, or the server does not end in order.
"""

import contextlib
import pathlib
import re
import sys
import tempfile
import time
import urllib.request

from running import PATIENCE_S, Program, end, key, site_keys

RATE_HZ = 20
CASES = ("noise", "hello", "beat", "noise+keys", "init+keys", "handshake+keys", "handshake+keys=500", "neighbour+keys=500")


def hand(programs, address, name, seconds, keys):
    arguments = ("--key", keys[name]) if keys else ()
    return Program(programs / "palpate-client", "--server", address, "--station", name, "--duration-s", seconds, *arguments)


def frames_of(metrics):
    with urllib.request.urlopen(f"http://{metrics}/metrics") as page:
        return int(re.search(r"^palpate_frame_seconds_count\S* (\d+)", page.read().decode(), re.MULTILINE).group(1))


def measure(programs, flood, scenes, case, rate, ports, seconds, work):
    kind, _, own_rate = case.partition("=")
    kind, _, keyed = kind.partition("+")
    rate = int(own_rate or rate)
    site, keys = site_keys(programs, work, "first", "newcomer") if keyed else (None, None)
    with contextlib.ExitStack() as programs_that_run:
        run = programs_that_run.enter_context
        server = run(Program(programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "[::]:0", "--metrics",
                             "127.0.0.1:0", *(("--keys", site) if keyed else ("--insecure",))))
        port = server.wait_for(r"at \[::\]:(\d+), \d+ Hz").group(1)
        metrics = server.wait_for(r"metrics at http://(127\.0\.0\.1:\d+)/metrics").group(1)
        address = f"127.0.0.1:{port}"
        public = (key(programs, "show", site),) if kind in ("init", "handshake", "neighbour") else ()
        run(hand(programs, f"[::1]:{port}", "first", seconds + PATIENCE_S, keys)).wait_for("joined")
        run(Program(flood, address, kind, rate, min(ports, rate), seconds + PATIENCE_S, *public)).wait_for("begins")
        begin = time.monotonic()
        before = frames_of(metrics)
        time.sleep(seconds / 2)
        asked = time.monotonic()
        run(hand(programs, address, "newcomer", seconds, keys)).wait_for("joined")
        joined_s = time.monotonic() - asked
        time.sleep(max(0, begin + seconds - time.monotonic()))
        lasted_s = time.monotonic() - begin
        frames = frames_of(metrics) - before
        asked = time.monotonic()
        end(server)
        ended_s = time.monotonic() - asked
    print(f"{case:20} {rate:7} a second, {100 * frames / (RATE_HZ * lasted_s):5.1f} % of the frames, joined after {joined_s:.2f} s, "
          f"ended after {ended_s:.2f} s", flush=True)


def main():
    programs, flood, scenes = map(pathlib.Path, sys.argv[1:4])
    rate, ports, seconds = map(int, sys.argv[4:7] or (100_000, 5_000, 30))
    for case in sys.argv[7:] or CASES:
        with tempfile.TemporaryDirectory() as work:
            measure(programs, flood, scenes, case, rate, ports, seconds, pathlib.Path(work))


main()
