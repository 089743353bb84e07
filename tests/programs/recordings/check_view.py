"""Plays a recording with palpate-view, without a display: the same pictures every time, and one line for what cannot be played.

usage: check_view.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES WORK
"""

import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

SKIPPED = 77
SIZE = ["--size", "320x200"]


def record(programs, scenes, work):
    """A server and a client that presses, for two seconds of frames."""
    server = subprocess.Popen(
        [programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", "--record", work / "room.rec"],
        stdout=subprocess.PIPE, text=True)
    address = re.search(r"at (127\.0\.0\.1:\d+)", server.stdout.readline()).group(1)
    client = subprocess.Popen(
        [programs / "palpate-client", "--server", address, "--device", "replay", "--motion", scenes / "motions" / "press.csv", "--realtime",
         "off", "--record", work / "hand.rec"],
        stdout=subprocess.PIPE, text=True)
    while "motion of" not in client.stdout.readline():
        assert client.poll() is None, "the client ended before its motion"
    time.sleep(2.5)
    for program in (client, server):
        program.send_signal(signal.SIGTERM)
        program.communicate()


def view(programs, *arguments, **options):
    return subprocess.run([programs / "palpate-view", *map(str, arguments)], capture_output=True, text=True, timeout=240, **options)


def picture(programs, file, to, *arguments):
    done = view(programs, "--recording", file, "--screenshot", to, *SIZE, *arguments)
    if done.returncode == 1 and ("EGL" in done.stderr or "OpenGL" in done.stderr):
        print("skipped:", done.stderr.strip())
        sys.exit(SKIPPED)
    assert done.returncode == 0, done.stderr
    data = pathlib.Path(to).read_bytes()
    assert data.startswith(b"\x89PNG"), "no PNG was written"
    return data, done.stderr


def refused(programs, *arguments, words):
    done = view(programs, *arguments)
    assert done.returncode == 2, f"{arguments}: exit {done.returncode}, {done.stderr}"
    assert done.stderr.count("\n") == 1 and words in done.stderr, f"{arguments}: {done.stderr!r} says nothing of {words!r}"


def check_pictures(programs, work):
    room = work / "room.rec"
    first, complaint = picture(programs, room, work / "a.png", "--at", "1.0")
    assert complaint == "", f"a whole recording is complained about: {complaint}"
    assert picture(programs, room, work / "b.png", "--at", "1.0")[0] == first, "the same moment makes another picture"
    assert picture(programs, room, work / "c.png", "--at", "2.0")[0] != first, "another moment makes the same picture"
    done = view(programs, "--recording", room, "--frames", work / "frames", "--at", "1.0", "--duration-s", "0.4", "--fps", "10", *SIZE)
    assert done.returncode == 0, done.stderr
    frames = sorted((work / "frames").iterdir())
    assert [f.name for f in frames] == [f"frame_{k:05d}.png" for k in range(5)]
    assert frames[0].read_bytes() == first, "a frame and a picture of one moment differ"


def check_damage(programs, work):
    whole, file = (work / "room.rec").read_bytes(), work / "damaged.rec"
    out = ["--screenshot", work / "no.png", *SIZE]

    def put(data):
        file.write_bytes(data)
        return file

    _, complaint = picture(programs, put(whole[:len(whole) * 3 // 4]), work / "cut.png")
    assert complaint.count("\n") == 1 and "from byte" in complaint and "what can be read is shown" in complaint, complaint
    refused(programs, "--recording", put(whole[:10]), *out, words="is no recording")
    refused(programs, "--recording", put(b"Dear diary, today nothing happened.\n"), *out, words="is no recording")
    refused(programs, "--recording", put(whole[:8] + b"\x02" + whole[9:]), *out, words="version 2")
    refused(programs, "--recording", put(whole[:100] + bytes([whole[100] ^ 4]) + whole[101:]), *out, words="head is damaged")
    refused(programs, "--recording", work / "nothing.rec", *out, words="nothing.rec")
    refused(programs, "--recording", work / "hand.rec", *out, words="of a station")
    refused(programs, "--recording", work / "room.rec", "--at", "99", *out, words="after the end")
    refused(programs, "--recording", work / "room.rec", "--at", "nan", *out, words="--at")
    refused(programs, "--recording", work / "room.rec", "--touch", words="--touch")
    refused(programs, "--recording", work / "room.rec", "--server", "127.0.0.1:9", words="both")
    refused(programs, words="both missing")
    refused(programs, "--recording", work / "room.rec", "--frames", work / "room.rec", *SIZE, words="--frames")
    assert not (work / "no.png").exists()


def main():
    programs, scenes, work = map(pathlib.Path, sys.argv[1:4])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    record(programs, scenes, work)
    check_pictures(programs, work)
    check_damage(programs, work)
    print("recordings play")


if __name__ == "__main__":
    main()
