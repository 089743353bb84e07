"""Programs that run beside a check: what they say, as it comes, and how they end."""

import contextlib
import http.client
import os
import re
import signal
import socket
import subprocess
import threading
import time

PATIENCE_S = 120


class Program:
    """Its lines as they come, those of both streams."""

    def __init__(self, *arguments, environment=None):
        self.process = subprocess.Popen([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                        env={**os.environ, **(environment or {})})
        self.lines, self.there, self.silent = [], threading.Condition(), False
        self.reader = threading.Thread(target=self.read, daemon=True)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            with self.there:
                self.lines.append(line)
                self.there.notify_all()
        with self.there:
            self.silent = True
            self.there.notify_all()

    def wait_for(self, pattern):
        """The first line with it, of those before too."""

        def found():
            return next((found for line in self.lines if (found := re.search(pattern, line))), None)

        with self.there:
            self.there.wait_for(lambda: found() or self.silent, PATIENCE_S)
            assert found(), f"no line {pattern} in {self.lines}"
            return found()

    def send(self, number):
        self.process.send_signal(number)

    def ended(self):
        code = self.process.wait(PATIENCE_S)
        self.reader.join(PATIENCE_S)
        return code

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.ended()


class Server(Program):
    """Listens when it is there."""

    def __init__(self, programs, scene, *arguments, listen="127.0.0.1:0", environment=None, under=()):
        super().__init__(*under, programs / "palpate-server", "--scene", scene, "--listen", listen, *arguments, environment=environment)
        self.address = self.wait_for(r"at (127\.0\.0\.1:\d+), \d+ Hz").group(1)


class WatchedServer(Server):
    """One with metrics."""

    def __init__(self, programs, scene, *arguments, **more):
        super().__init__(programs, scene, "--metrics", "127.0.0.1:0", *arguments, **more)
        self.metrics = self.wait_for(r"metrics at http://(127\.0\.0\.1:\d+)/metrics").group(1)

    def get(self, path):
        connection = http.client.HTTPConnection(self.metrics, timeout=PATIENCE_S)
        with contextlib.closing(connection):
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()

    def value(self, series):
        status, text = self.get("/metrics")
        assert status == 200, text
        values = [float(line.rsplit(" ", 1)[1]) for line in text.splitlines() if line.startswith(series + " ")]
        assert len(values) < 2, f"{series} is there {len(values)} times"
        return values[0] if values else None

    def reach(self, what, wanted):
        """Within our patience; what is published is up to half a second old."""
        end = time.monotonic() + PATIENCE_S
        while (is_now := what()) != wanted:
            assert time.monotonic() < end, f"{is_now}, expected {wanted}"
            time.sleep(0.05)


def at_last(check, *arguments):
    """Tries again within our patience: a machine that stands still for tens of milliseconds has the watchdog take a force away."""
    end = time.monotonic() + PATIENCE_S
    while True:
        try:
            return check(*arguments)
        except AssertionError:
            if time.monotonic() > end:
                raise


def run(programs, name, *arguments, patience_s=PATIENCE_S):
    return subprocess.run([programs / name, *map(str, arguments)], capture_output=True, text=True, timeout=patience_s)


def key(programs, *arguments):
    """What palpate-key prints."""
    done = run(programs, "palpate-key", *arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def site_keys(programs, work, *stations):
    """A server's key file that knows these stations, and theirs by name."""
    site = work / "site.key"
    public = key(programs, "new", site)
    files = {name: work / f"{name}.key" for name in stations}
    for name, file in files.items():
        key(programs, "admit", site, key(programs, "new", file, "--trust", public), name)
    return site, files


def free_port():
    with contextlib.closing(socket.socket(socket.AF_INET, socket.SOCK_DGRAM)) as anybody:
        anybody.bind(("127.0.0.1", 0))
        return anybody.getsockname()[1]


def end(program, number=signal.SIGTERM):
    """In order; all that it said."""
    program.send(number)
    code = program.ended()
    assert code == 0, f"{code}: {program.lines[-5:]}"
    return "".join(program.lines)
