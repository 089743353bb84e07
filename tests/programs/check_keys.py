"""A server with keys and its stations, as they are set up and typed.

usage: check_keys.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import csv
import json
import os
import pathlib
import re
import signal
import socket
import stat
import subprocess
import sys
import tempfile
import time

from running import Program, Server, end, key, run


def hand(programs, scenes, address, report, *arguments):
    return run(programs, "palpate-client", "--server", address, "--motion", scenes / "motions" / "press.csv", "--report", report,
               "--realtime", "off", *arguments)


def check_files(programs, work):
    secret = work / "a.key"
    public = key(programs, "new", secret)
    assert stat.S_IMODE(secret.stat().st_mode) == 0o600, oct(secret.stat().st_mode)
    assert key(programs, "show", secret) == public and len(public) == 44
    before = secret.read_text()
    assert run(programs, "palpate-key", "new", secret).returncode == 2 and secret.read_text() == before
    key(programs, "trust", secret, public)
    key(programs, "trust", secret, public)
    assert secret.read_text() == before + f"server {public}\n" and stat.S_IMODE(secret.stat().st_mode) == 0o600
    assert [path.name for path in work.iterdir()] == ["a.key"], "something is left behind"
    secret.chmod(0o644)
    done = run(programs, "palpate-key", "show", secret)
    assert done.returncode == 2 and f"chmod 600 {secret}" in done.stderr, done.stderr


def check_admitted_together(programs, work):
    """Several at once, through a link: nobody's line is lost, and owner and link stay."""
    site, link = work / "real" / "site.key", work / "site.key"
    site.parent.mkdir()
    key(programs, "new", site)
    link.symlink_to(site)
    if os.geteuid() == 0:
        os.chown(site, 64321, 64322)
    stations = [key(programs, "new", work / f"{k}.key") for k in range(8)]
    at_once = [subprocess.Popen([programs / "palpate-key", "admit", link, station, f"OR {k}"]) for k, station in enumerate(stations)]
    assert [one.wait() for one in at_once] == [0] * len(stations)
    text = site.read_text()
    assert all(station in text for station in stations), text
    assert link.is_symlink() and [path.name for path in site.parent.iterdir()] == ["site.key"]
    if os.geteuid() == 0:
        assert (site.stat().st_uid, site.stat().st_gid) == (64321, 64322), site.stat()
    with open("/dev/full", "w") as full:
        done = subprocess.run([programs / "palpate-key", "show", work / "0.key"], stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 2 and "standard output: cannot be written; expected room on the disk" in done.stderr, done.stderr


def check_named(programs, work):
    """A name is a name: nothing in it becomes another word or line of the key file, whatever it is."""
    site = work / "site.key"
    key(programs, "new", site)
    site.chmod(0o640)
    before, stranger = site.read_text(), key(programs, "new", work / "evil.key")
    station = key(programs, "new", work / "a.key")
    for name in (f'a" hand\nstation {stranger} "evil', 'b" hand #', 'OR "4', "two\nlines", "", "n" * 65):
        done = run(programs, "palpate-key", "admit", site, station, name, "--role", "viewer")
        assert done.returncode == 2 and done.stderr.startswith("palpate-key: NAME: ") and done.stderr.count("\n") == 1, done.stderr
        done = run(programs, "palpate-key", "admit", site, station, "a", "--room", name)
        assert done.returncode == 2 and "--room: " in done.stderr, done.stderr
    done = run(programs, "palpate-key", "admit", site, key(programs, "show", site), "OR 4")
    assert done.returncode == 2 and done.stderr.startswith("palpate-key: STATION: ") and "the server's" in done.stderr, done.stderr
    assert site.read_text() == before
    done = run(programs, "palpate-key", "admit", site, station, "OR 4", "--role", "viewer")
    assert f'station {station} "OR 4" viewer' in done.stdout and "SIGHUP" in done.stdout, done.stdout
    assert stat.S_IMODE(site.stat().st_mode) == 0o640 and site.read_text() == before + f'station {station} "OR 4" viewer\n'
    written = site.read_text()
    for who, name, words in ((station, "b", f'STATION: is in {site} already, as "OR 4"; expected another key'),
                             (stranger, "OR 4-2", f'NAME: "OR 4-2" and "OR 4" of {site} could have the same name')):
        done = run(programs, "palpate-key", "admit", site, who, name)
        assert done.returncode == 2 and words in done.stderr and site.read_text() == written, done.stderr
    theirs, issuer = work / "evil.key", work / "issuer.key"
    key(programs, "trust", theirs, station)
    key(programs, "new", "--issuer", issuer)
    for file, words in ((theirs, "is a station's key file: it has a line server"), (issuer, "has no key of a server: no line self")):
        before = file.read_text()
        done = run(programs, "palpate-key", "admit", file, station, "OR 4")
        assert done.returncode == 2 and f"{file}: {words}" in done.stderr and file.read_text() == before, done.stderr
    mine = work / "a.key"
    mine.write_text(mine.read_text() + f"\tserver\t{stranger}\n")
    key(programs, "trust", mine, station)
    assert mine.read_text().count("server") == 1 and f"server {station}\n" in mine.read_text()
    for odd in (work, "/dev/null"):
        done = run(programs, "palpate-key", "show", odd)
        assert done.returncode == 2 and "is no regular file" in done.stderr, done.stderr
    if os.geteuid() == 0:  # who starts a service makes its keys, too
        service = work / "service"
        service.mkdir()
        os.chown(service, 64321, 64322)
        key(programs, "new", service / "site.key")
        made = (service / "site.key").stat()
        assert (made.st_uid, made.st_gid, stat.S_IMODE(made.st_mode)) == (64321, 64322, 0o600), made


def check_listening(programs, scene, work):
    done = run(programs, "palpate-server", "--scene", scene, "--listen", "0.0.0.0:0", "--duration-s", "1")
    assert done.returncode == 2 and "--keys FILE" in done.stderr and done.stderr.count("\n") == 1, done.stderr
    done = run(programs, "palpate-server", "--scene", scene, "--listen", "0.0.0.0:0", "--duration-s", "1", "--insecure")
    assert done.returncode == 0 and "warning: --insecure" in done.stdout, done.stdout + done.stderr
    for loopback in ("[::1]:0", "[::ffff:127.0.0.1]:0"):
        done = run(programs, "palpate-server", "--scene", scene, "--listen", loopback, "--duration-s", "0.1")
        assert done.returncode == 0, done.stderr
    wrong = work / "wrong.keys"
    wrong.write_text("self nothing\n")
    wrong.chmod(0o600)
    done = run(programs, "palpate-server", "--scene", scene, "--keys", wrong)
    assert done.returncode == 2 and f"{wrong}:1: the secret is no key; expected" in done.stderr, done.stderr


def check_hang_up(programs, scenes, scene, work):
    """A server without keys has none to read again, and goes on."""
    with Server(programs, scene) as server:
        for _ in range(2):
            server.send(signal.SIGHUP)
        done = hand(programs, scenes, server.address, work / "after")
        assert done.returncode == 0 and json.loads((work / "after" / "summary.json").read_text())["patches_received"] > 0, done.stderr
        server.send(signal.SIGHUP)
        end(server)


def check_resets(programs, scene):
    """Who resets more often than a room permits is told that, and not that nobody answers."""
    with Server(programs, scene) as server:
        for _ in range(8):
            done = run(programs, "palpate-client", "--server", server.address, "--reset")
            if done.returncode != 0:
                break
        assert done.returncode == 1 and "resets a body a few times a minute at most" in done.stderr, done.stdout + done.stderr
        end(server)


def check_touch(programs, scenes, server, work, keys):
    done = hand(programs, scenes, server.address, work / "felt", "--key", keys["station"])
    assert done.returncode == 0, done.stderr
    felt = json.loads((work / "felt" / "summary.json").read_text())
    assert felt["patches_received"] > 0, felt
    done = run(programs, "palpate-client", "--server", server.address, "--key", keys["station"], "--check-link", "--duration-s", "1")
    assert "round trip" in done.stdout, done.stdout + done.stderr
    done = run(programs, "palpate-client", "--server", server.address, "--key", keys["station"], "--reset")
    assert done.returncode == 0, done.stderr


def check_strangers(programs, scenes, server, work, keys):
    for arguments, said in (([], "a key is needed"), (["--key", keys["stranger"]], "no answer"), (["--key", keys["misled"]], "no answer")):
        done = hand(programs, scenes, server.address, work / "nothing", "--duration-s", "1.5", *arguments)
        assert done.returncode == 1 and said in done.stderr, done.stdout + done.stderr
    server.wait_for(r"no session for 127\.0\.0\.1:\d+: key not known \(key " + re.escape(key(programs, "show", keys["stranger"])))
    done = hand(programs, scenes, server.address, work / "nothing", "--key", keys["station"], "--station", "OR 4", "--duration-s", "1.5")
    assert done.returncode == 1 and 'this key\'s stations are "OR 3"' in done.stderr, done.stdout + done.stderr
    done = run(programs, "palpate-client", "--server", server.address, "--key", keys["onlooker"], "--reset")
    assert done.returncode == 1 and "this key may not touch, so it may not reset the body" in done.stderr, done.stdout + done.stderr


def check_token(programs, scenes, server, work, keys):
    token = work / "token"
    token.write_text(key(programs, "issue", "--issuer", keys["issuer"], "--server", keys["public"], "--station",
                         key(programs, "show", keys["stranger"]), "--name", "guest", "--role", "hand"))
    for returncode in (0, 1):  # once
        done = hand(programs, scenes, server.address, work / "guest", "--key", keys["stranger"], "--token", token, "--duration-s", "5")
        assert done.returncode == returncode, done.stdout + done.stderr
    server.wait_for("token used already")


def check_passed_on(programs, scenes, server, work, keys):
    """What goes through a relay is not to be read there, and where that goes on from another port in the middle, so does the session."""

    def way_to_server():
        on = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        host, port = server.address.split(":")
        on.connect((host, int(port)))
        on.settimeout(0.001)
        return on

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as seen:
        seen.bind(("127.0.0.1", 0))
        on = way_to_server()
        client = subprocess.Popen([programs / "palpate-client", "--server", f"127.0.0.1:{seen.getsockname()[1]}", "--key",
                                   keys["station"], "--duration-s", "6", "--realtime", "off"], stdout=subprocess.PIPE, text=True)
        passed, back, moves_at = [], None, time.monotonic() + 1.5
        seen.settimeout(0.01)
        while client.poll() is None:
            if moves_at and time.monotonic() > moves_at:
                on.close()
                on, moves_at = way_to_server(), None
            for way_in, way_out in ((seen, "up"), (on, "down")):
                try:
                    datagram, source = way_in.recvfrom(2048)
                except (socket.timeout, ConnectionError):
                    continue
                passed.append(datagram)
                if way_out == "up":
                    back = source
                    on.send(datagram)
                elif back:
                    seen.sendto(datagram, back)
        said = client.communicate()[0]
        on.close()
    assert "joined scene" in said and "joined once" in said and "lost" not in said.replace("% lost", "") and len(passed) > 100, said
    assert all(b"PLPT" not in datagram and b"OR 3" not in datagram for datagram in passed)


def check_started_again(programs, server, keys):
    """A program that was killed has its own name when it is started again, another that runs beside it has not."""

    def station(*arguments):
        return Program(programs / "palpate-client", "--server", server.address, "--key", keys["station"], "--duration-s", "60", "--realtime",
                       "off", *arguments)

    with station("--station", "OR 3") as first:
        first.wait_for("^joined")
    with station("--station", "OR 3") as again:
        again.wait_for("^joined scene touch-cube:")
        server.wait_for('"OR 3" silent: its successor takes its name')
        with station("--station", "OR 3") as beside:
            beside.wait_for('"OR 3" is in the room already')
        with station() as beside:
            beside.wait_for("^joined .* as OR 3-2:")


def check_taken_out(programs, server, keys):
    """A key that is taken out of the file is out, and its station told so; a file that is wrong changes nothing. tests/bench/world says
    within which time."""
    with Program(programs / "palpate-client", "--server", server.address, "--key", keys["station"], "--duration-s", "20", "--realtime",
                 "off") as client:
        client.wait_for("^joined")
        text = keys["site"].read_text()
        keys["site"].write_text(text + "nonsense\n")
        server.send(signal.SIGHUP)
        server.wait_for(r"the keys are unchanged: .*nonsense")
        keys["site"].rename(keys["site"].with_suffix(".aside"))
        os.mkfifo(keys["site"], 0o600)
        server.send(signal.SIGHUP)
        server.wait_for(r"the keys are unchanged: .*is no regular file; expected a file that palpate-key new made")
        keys["site"].unlink()
        keys["site"].with_suffix(".aside").rename(keys["site"])
        keys["site"].write_text("".join(line for line in text.splitlines(True) if '"OR 3"' not in line))
        server.send(signal.SIGHUP)
        server.wait_for("the keys were read again")
        server.wait_for("left: its key is not valid any more")
        client.wait_for("server lost.*this station's key is not valid any more")
        end(client, signal.SIGINT)


def check_attributed(programs, recording, out, keys):
    """Who was it, says the recording."""
    done = run(programs, "palpate-lab", "export", "--recording", recording, "--out", out)
    assert done.returncode == 0, done.stderr
    joined = [row for row in csv.DictReader((out / "events.csv").open()) if row["event"] == "joined"]
    whose = {"OR 3": key(programs, "show", keys["station"]), "guest": key(programs, "show", keys["stranger"])}
    joined = [row for row in joined if row["station"] != "gallery"]
    assert {row["station"] for row in joined} == {"OR 3", "OR 3-2", "guest"}, joined
    assert all(row["text"] == f"key {whose[row['station'].removesuffix('-2')]}" for row in joined), joined


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:3])
    os.umask(0o022)
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        (work / "files").mkdir()
        check_files(programs, work / "files")
        (work / "together").mkdir()
        check_admitted_together(programs, work / "together")
        (work / "named").mkdir()
        check_named(programs, work / "named")
        scene = scenes / "touch-cube.json"
        check_listening(programs, scene, work)
        check_hang_up(programs, scenes, scene, work)
        check_resets(programs, scene)
        keys = {name: work / f"{name}.key" for name in ("site", "station", "stranger", "misled", "issuer", "onlooker")}
        keys["public"] = key(programs, "new", keys["site"])
        station = key(programs, "new", keys["station"], "--trust", keys["public"])
        key(programs, "new", keys["stranger"], "--trust", keys["public"])
        key(programs, "new", keys["misled"], "--trust", station)
        key(programs, "admit", keys["site"], station, "OR 3")
        onlooker = key(programs, "new", keys["onlooker"], "--trust", keys["public"])
        key(programs, "admit", keys["site"], onlooker, "gallery", "--role", "viewer")
        keys["site"].write_text(keys["site"].read_text() + "issuer " + key(programs, "new", keys["issuer"], "--issuer") + "\n")
        recording = work / "session.rec"
        with Server(programs, scene, "--keys", keys["site"], "--record", recording) as server:
            check_touch(programs, scenes, server, work, keys)
            check_strangers(programs, scenes, server, work, keys)
            check_token(programs, scenes, server, work, keys)
            check_started_again(programs, server, keys)
            check_passed_on(programs, scenes, server, work, keys)
            check_taken_out(programs, server, keys)
            end(server)
        check_attributed(programs, recording, work / "events", keys)
    print("keys let in whom they should, and nobody else")


if __name__ == "__main__":
    main()
