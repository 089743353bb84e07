"""Cost of palpate-web with browsers that look at a hand on the organ: processor time, and data rate and shapes of each browser.

usage: browsers.py PROGRAMS SCENES [--browsers N] [--seconds S]

The browsers are WebSocket clients that read and count.
"""

import argparse
import base64
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import threading
import time


class Browser(threading.Thread):
    """Reads frames; counts bytes of the stream, and shapes (binary messages of kind 2)."""

    def __init__(self, address):
        super().__init__(daemon=True)
        self.socket = socket.create_connection(address)
        host = f"{address[0]}:{address[1]}"
        self.socket.sendall(f"GET /live HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                            f"Sec-WebSocket-Key: {base64.b64encode(os.urandom(16)).decode()}\r\n\r\n".encode())
        self.stream = self.socket.makefile("rb")
        while self.stream.readline() not in (b"\r\n", b""):
            pass
        self.bytes = self.shapes = 0

    def run(self):
        while head := self.stream.read(2):
            size, extra = head[1] & 127, 0
            if size >= 126:
                extra = 2 if size == 126 else 8
                size = struct.unpack(">H" if extra == 2 else ">Q", self.stream.read(extra))[0]
            message = self.stream.read(size)
            self.bytes += 2 + extra + size
            self.shapes += head[0] & 15 == 2 and message[0] == 2


def processor_s(process):
    """User and system time so far."""
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def begin(pattern, *command):
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    for line in process.stdout:
        if found := re.search(pattern, line):
            threading.Thread(target=process.stdout.read, daemon=True).start()
            return process, found.group(1)
    raise SystemExit(f"{command[0]} ended")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=pathlib.Path)
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("--browsers", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=20)
    asked = parser.parse_args()
    server, at = begin(r"at (127\.0\.0\.1:\d+), \d+ Hz", asked.programs / "palpate-server", "--scene", asked.scenes / "organ.json", "--listen", "127.0.0.1:0")
    hand = subprocess.Popen([str(part) for part in (
        asked.programs / "palpate-client", "--server", at, "--device", "sim", "--hand", "firm", "--motion", asked.scenes / "motions/organ-tour.csv",
        "--duration-s", asked.seconds + 10)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    web, page = begin(r"http://127\.0\.0\.1:(\d+)/", asked.programs / "palpate-web", "--server", at, "--listen", "127.0.0.1:0")
    time.sleep(4)
    idle_from = processor_s(web)
    time.sleep(2)
    idle = (processor_s(web) - idle_from) / 2
    browsers = [Browser(("127.0.0.1", int(page))) for _ in range(asked.browsers)]
    for browser in browsers:
        browser.start()
    time.sleep(1)
    first, bytes_first, shapes_first = processor_s(web), [b.bytes for b in browsers], [b.shapes for b in browsers]
    time.sleep(asked.seconds)
    used = (processor_s(web) - first) / asked.seconds
    kbit_s = [8e-3 * (b.bytes - n) / asked.seconds for b, n in zip(browsers, bytes_first)]
    shapes_s = [(b.shapes - n) / asked.seconds for b, n in zip(browsers, shapes_first)]
    memory_mb = int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{web.pid}/status").read_text()).group(1)) / 1024
    print(f"{asked.browsers} browsers, {asked.seconds:g} s: {100 * used:.1f} % of a core ({100 * idle:.1f} % without browsers), {memory_mb:.0f} MB")
    print(f"each: {min(shapes_s):.1f} to {max(shapes_s):.1f} shapes a second, {min(kbit_s):.0f} to {max(kbit_s):.0f} kbit/s")
    for process in (web, hand, server):
        process.send_signal(signal.SIGTERM)
        process.wait(30)


if __name__ == "__main__":
    main()
