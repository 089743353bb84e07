"""What a flood of datagrams leaves of a server: frames for the hand that is there, a way in for another, and an end when asked.

usage: check_flood.py FOLDER_OF_PROGRAMS FLOOD FOLDER_OF_SCENES [RATE PORTS SECONDS]

Prints what it measured; it fails where somebody does not get in at all, or the server does not end in order.
"""

import pathlib
import re
import sys
import time

from running import PATIENCE_S, Program, Server, end

RATE_HZ = 20


def hand(programs, address, name, seconds):
    return Program(programs / "palpate-client", "--server", address, "--station", name, "--duration-s", seconds)


def measure(programs, flood, scenes, kind, rate, ports, seconds):
    server = Server(programs, scenes / "touch-cube.json")
    address = server.address
    first = hand(programs, address, "first", seconds + PATIENCE_S)
    first.wait_for("joined")
    begin = time.monotonic()
    sender = Program(flood, address, kind, rate, ports, seconds + PATIENCE_S)
    time.sleep(seconds / 2)
    asked = time.monotonic()
    newcomer = hand(programs, address, "newcomer", seconds)
    newcomer.wait_for("joined")
    joined_s = time.monotonic() - asked
    time.sleep(max(0, begin + seconds - time.monotonic()))
    lasted_s = time.monotonic() - begin
    asked = time.monotonic()
    said = end(server)
    ended_s = time.monotonic() - asked
    frames = int(re.search(r"in all .* (\d+) frames", said).group(1))
    received = int(re.search(r"(\d+) datagrams in", said).group(1))
    for program in (sender, first, newcomer):
        program.process.kill()
        program.ended()
    print(f"{kind:6} {received / lasted_s:8.0f} datagrams a second taken, {100 * frames / (RATE_HZ * lasted_s):5.1f} % of the frames, "
          f"joined after {joined_s:.2f} s, ended after {ended_s:.2f} s", flush=True)


def main():
    programs, flood, scenes = map(pathlib.Path, sys.argv[1:4])
    rate, ports, seconds = map(int, sys.argv[4:7] or (100_000, 5_000, 30))
    for kind in ("noise", "hello", "beat"):
        measure(programs, flood, scenes, kind, rate, ports, seconds)


main()
