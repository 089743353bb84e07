"""A server as its operator sees it: metrics, health, log, and the ways it ends.

usage: check_operation.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import fcntl
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time

from running import PATIENCE_S, Program, WatchedServer, run, site_keys


def watched(programs, scenes, *arguments, **more):
    return WatchedServer(programs, scenes / "touch-cube.json", *arguments, **more)


def hand(programs, scenes, server, name, *arguments, motion="press"):
    client = Program(programs / "palpate-client", "--server", server.address, "--station", name, "--motion",
                     scenes / "motions" / f"{motion}.csv", "--realtime", "off", "--duration-s", "300", *arguments)
    return client


def check_figures(programs, scenes):
    with watched(programs, scenes) as server:
        server.reach(lambda: server.get("/readyz"), (200, "ok\n"))
        assert server.get("/healthz") == (200, "ok\n")
        assert server.get("/nothing")[0] == 404
        of = '{room="touch-cube",role="hand"}'
        assert server.value("palpate_stations" + of) == 0
        with hand(programs, scenes, server, "first") as client:
            client.wait_for("^joined")
            server.reach(lambda: server.value("palpate_stations" + of), 1)
            server.reach(lambda: server.value('palpate_frame_seconds_count{room="touch-cube"}') > 20, True)
            server.reach(lambda: server.value('palpate_round_trip_seconds_count{room="touch-cube"}') > 1, True)
            assert server.value('palpate_joins_total{room="touch-cube"}') == 1
            ratio = server.value('palpate_stranger_bytes_total{direction="out"}') / server.value(
                'palpate_stranger_bytes_total{direction="in"}')
            assert 0 < ratio <= 1, ratio
            client.process.send_signal(signal.SIGINT)
            assert client.ended() == 0
        server.reach(lambda: server.value('palpate_leaves_total{room="touch-cube",reason="said"}'), 1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            host, port = server.address.split(":")
            stranger.sendto(b"noise" * 20, (host, int(port)))
        server.reach(lambda: server.value('palpate_datagrams_dropped_total{room="touch-cube",reason="not_palpate"}'), 1)
        # Who asks and does not listen keeps nobody else waiting, nor the server.
        host, port = server.metrics.split(":")
        with socket.create_connection((host, int(port))) as slow:
            slow.sendall(b"GET /metrics HTTP/1.1\r\n")
            assert server.get("/healthz") == (200, "ok\n")
        os.kill(server.process.pid, signal.SIGTERM)
        assert server.ended() == 0


def check_log(programs, scenes):
    with watched(programs, scenes, "--log", "json") as server:
        with hand(programs, scenes, server, "first") as first, hand(programs, scenes, server, "second", "--room", "nowhere"):
            first.wait_for("^joined")
            server.wait_for('"event":"refused"')
            first.process.send_signal(signal.SIGINT)
            first.ended()
        server.wait_for('"event":"left"')
        os.kill(server.process.pid, signal.SIGTERM)
        assert server.ended() == 0
        said = [json.loads(line) for line in server.lines]
    for line in said:
        assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", line["time"]), line
        assert line["level"] in ("info", "warning", "error") and line["event"] and line["text"], line
    joined = next(line for line in said if line["event"] == "joined")
    assert joined["station"] == "first" and joined["role"] == "hand" and joined["room"] == "touch-cube", joined
    assert re.fullmatch(r"127\.0\.0\.1:\d+", joined["from"]), joined
    assert "nowhere" in next(line for line in said if line["event"] == "refused")["reason"], said


def check_drain(programs, scenes, work):
    recording = work / "drained.rec"
    with watched(programs, scenes, "--drain-s", "100", "--record", recording) as server:
        with hand(programs, scenes, server, "first") as first:
            first.wait_for("^joined")
            os.kill(server.process.pid, signal.SIGTERM)
            server.wait_for("new sessions are refused")
            server.reach(lambda: server.get("/readyz"), (503, "draining\n"))
            assert server.get("/healthz")[0] == 200
            with hand(programs, scenes, server, "late") as late:
                late.wait_for("refused late: the server is shutting down; the client keeps trying")
            patches = server.value('palpate_patches_total{room="touch-cube"}')
            server.reach(lambda: server.value('palpate_frame_seconds_count{room="touch-cube"}') > 30, True)
            assert server.value('palpate_patches_total{room="touch-cube"}') >= patches
            assert server.process.poll() is None, "it did not wait for its hand"
            first.process.send_signal(signal.SIGINT)
            assert first.ended() == 0
        assert server.ended() == 0
    done = subprocess.run([programs / "palpate-lab", "summary", "--recording", recording, "--out", work / "summary"], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0 and "first" in done.stdout, done.stdout + done.stderr


def check_full_disk(programs, scenes, work):
    """The session goes on, and who watches hears why nothing is recorded any more."""
    disk = work / "disk"
    disk.mkdir()
    tiny = ["unshare", "-rm", "sh", "-c", 'mount -t tmpfs -o size=128k none "$0" && exec "$@"', str(disk)]
    may_mount = subprocess.run([*tiny, "true"], capture_output=True).returncode == 0
    under, why = (tiny, "No space left on device") if may_mount else (["prlimit", "--fsize=131072"], "File too large")
    with watched(programs, scenes, "--record", disk / "session.rec", under=under) as server, hand(programs, scenes, server, "first", motion="tremor-hold") as client:  # it stays on the body
        client.wait_for("^joined")
        said = server.wait_for("warning: .*")
        assert said.group(0) == f"warning: {disk / 'session.rec'}: the recording ends here, the session goes on: {why}", said.group(0)
        server.reach(lambda: server.value('palpate_recording_failed{room="touch-cube"}'), 1)
        patches = server.value('palpate_patches_total{room="touch-cube"}')
        server.reach(lambda: server.value('palpate_patches_total{room="touch-cube"}') > patches, True)
        assert sum("the recording ends here" in line for line in server.lines) == 1, server.lines
        if not may_mount:
            # A limit on files ends each of them.
            server.wait_for("the recording goes on in .*session.2.rec")
        os.kill(server.process.pid, signal.SIGTERM)
        assert server.ended() == 0


def check_recording_goes_on(programs, scenes, work):
    """A recording whose file was removed, as by a disk that was cleared, goes on in a new one, with who is there and all of the body."""
    folder = work / "cleared"
    with watched(programs, scenes, "--record", folder / "session.rec", "--resume") as server, hand(programs, scenes, server, "first", motion="tremor-hold") as client:
        client.wait_for("^joined")
        (folder / "session.rec").unlink()
        folder.rmdir()
        server.wait_for("the recording ends here, the session goes on: the file was removed")
        server.reach(lambda: server.value('palpate_recording_failed{room="touch-cube"}'), 1)
        server.wait_for(f"the recording goes on in {folder / 'session.rec'}")
        server.reach(lambda: server.value('palpate_recording{room="touch-cube"}'), 1)
        written = server.value('palpate_recorded_bytes_total{room="touch-cube"}')
        server.reach(lambda: server.value('palpate_recorded_bytes_total{room="touch-cube"}') > written + 20000, True)
        os.kill(server.process.pid, signal.SIGKILL)
        server.ended()
    done = subprocess.run([programs / "palpate-lab", "summary", "--recording", folder / "session.rec", "--out", work / "cleared-summary"],
                          capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0 and "first" in done.stdout, done.stdout + done.stderr
    with watched(programs, scenes, "--record", folder / "session.rec", "--resume") as server:
        server.wait_for(f"the body is as {folder / 'session.rec'} had it")
        os.kill(server.process.pid, signal.SIGTERM)
        assert server.ended() == 0


def check_goodbye(programs, scenes, flags, signals, of_client=()):
    """Whoever is there when the time is over, or at a second signal, is told at once, and goes on trying."""
    with watched(programs, scenes, *flags) as server, hand(programs, scenes, server, "first", *of_client) as client:
        client.wait_for("^joined")
        for number in signals:
            os.kill(server.process.pid, number)
            time.sleep(0.2)
        assert server.ended() == 0
        client.wait_for("server lost: the force fades to zero")
        assert any("left: the server is shutting down" in line for line in server.lines), server.lines


def check_service(programs, scenes, work):
    """What systemd would hear."""
    path = work / "notify"
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(path))
        manager.settimeout(PATIENCE_S)
        environment = {"NOTIFY_SOCKET": str(path), "WATCHDOG_USEC": "10000000"}
        with watched(programs, scenes, "--drain-s", "7", environment=environment) as server:
            assert manager.recv(4096).decode().startswith("READY=1\nSTATUS=1 room at 127.0.0.1:")
            for _ in range(3):
                assert manager.recv(4096) == b"WATCHDOG=1"
            os.kill(server.process.pid, signal.SIGTERM)
            while (word := manager.recv(4096)) == b"WATCHDOG=1":
                pass
            assert word == b"STOPPING=1\nSTATUS=draining\nEXTEND_TIMEOUT_USEC=17000000", word
            assert server.ended() == 0


def check_log_that_nobody_reads(programs, scenes):
    """A reader of the log that stalls, or goes, holds up neither hands nor the end."""
    for gone in (False, True):
        server = subprocess.Popen([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0"],
                                  stdout=subprocess.PIPE, text=True)
        try:
            fcntl.fcntl(server.stdout, 1031, 4096)  # F_SETPIPE_SZ
            while not (found := re.search(r"at (127\.0\.0\.1:\d+), ", server.stdout.readline())):
                pass
            if gone:
                server.stdout.close()
            for _ in range(300):
                server.send_signal(signal.SIGHUP)  # a line each
                time.sleep(0.002)
            with tempfile.TemporaryDirectory() as report:
                done = run(programs, "palpate-client", "--server", found.group(1), "--motion", scenes / "motions" / "press.csv",
                           "--report", report, "--realtime", "off", "--duration-s", "2")
                assert done.returncode == 0, done.stdout + done.stderr
                assert json.loads((pathlib.Path(report) / "summary.json").read_text())["patches_received"] > 0
            server.send_signal(signal.SIGTERM)
            assert server.wait(PATIENCE_S) == 0
        finally:
            server.kill()
            server.wait()


def check_flags(programs, scenes):
    for flags, said in ((("--metrics", "nowhere"), "--metrics"), (("--metrics", ""), "--metrics: is empty"), (("--log", "xml"), "text, json"),
                        (("--drain-s", "-1"), "0 to 86400")):
        done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", *flags],
                              capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 2 and said in done.stderr and done.stderr.count("\n") == 1, done.stderr
    # An address that this machine has not got yet: bad input for a person, for systemd a start that may succeed later.
    for service, code in ((False, 2), (True, 1)):
        environment = {**os.environ, "NOTIFY_SOCKET": "/nowhere"} if service else None
        done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--insecure", "--listen", "192.0.2.1:0"],
                              capture_output=True, text=True, timeout=PATIENCE_S, env=environment)
        assert done.returncode == code and "cannot listen at 192.0.2.1:0" in done.stderr, (done.returncode, done.stderr)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", "--metrics",
                               address], capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 2 and f"--metrics {address}: cannot be listened at" in done.stderr, done.stderr


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:3])
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        check_flags(programs, scenes)
        check_figures(programs, scenes)
        check_log(programs, scenes)
        check_log_that_nobody_reads(programs, scenes)
        check_drain(programs, scenes, work)
        check_full_disk(programs, scenes, work)
        check_recording_goes_on(programs, scenes, work)
        check_goodbye(programs, scenes, (), [signal.SIGTERM])
        check_goodbye(programs, scenes, ("--drain-s", "1"), [signal.SIGTERM])
        check_goodbye(programs, scenes, ("--drain-s", "3600"), [signal.SIGTERM, signal.SIGTERM])
        check_goodbye(programs, scenes, ("--drain-s", "3600"), [signal.SIGINT])
        site, keys = site_keys(programs, work, "first")
        check_goodbye(programs, scenes, ("--keys", site), [signal.SIGTERM], ("--key", keys["first"]))
        check_service(programs, scenes, work)
    print("figures, log and ends are as an operator expects them")


if __name__ == "__main__":
    main()
