"""A server that is killed with a hand on its body, started again by the same command line: what hand and body notice.

usage: check_restart.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

import numpy

from running import PATIENCE_S, Program, free_port

PRESSED_M, TOP_M, MIDDLE_M = 0.008, 0.075, 0.0525  # of touch-cube.json
# What friction held under the tool settles anew; a step of the recording is 2 um. Without a checkpoint the body would be off by the depth.
SAME_M = PRESSED_M / 40
RAMP_TICKS = 20  # docs/safety.md: a force that comes or goes takes 50 ticks, one that ends because the machine stood still 20
TICK_S = 1e-3


def write_motion(file):
    """From 20 mm above the cube to PRESSED_M in it, and there for a minute."""
    rows = ["t_s,x_m,y_m,z_m"]
    for t in numpy.arange(0, 60, 0.01):
        s = min(1.0, t / 2)
        z = TOP_M + 0.020 - (0.020 + PRESSED_M) * s**3 * (10 - 15 * s + 6 * s * s)
        rows.append(f"{t:.3f},{MIDDLE_M:.6f},{MIDDLE_M:.6f},{z:.6f}")
    file.write_text("\n".join(rows) + "\n")


def server(programs, scenes, port, recording, *more):
    return Program(programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", f"127.0.0.1:{port}", "--record",
                   recording, "--resume", "--log", "json", *more)


def shapes(programs, recording, out):
    done = subprocess.run([programs / "palpate-lab", "export", "--recording", recording, "--out", out, "--format", "ply", "--frames-hz",
                           "20"], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stderr
    found = []
    for file in sorted((out / "shapes").glob("*.ply")):
        head, _, body = file.read_bytes().partition(b"end_header\n")
        vertices = int(re.search(rb"element vertex (\d+)", head).group(1))
        found.append(numpy.frombuffer(body, "<f4", 6 * vertices).reshape(vertices, 6)[:, :3])
    return found


def farthest(a, b):
    return numpy.linalg.norm(a - b, axis=1).max()


def forces(report):
    rows = numpy.genfromtxt(report / "forces.csv", delimiter=",", names=True)
    return numpy.stack([rows[name] for name in rows.dtype.names], axis=1)[:, [0, 4, 5, 6]]


def check_killed(programs, scenes, work):
    port, recording, motion, report = free_port(), work / "session.rec", work / "press.csv", work / "report"
    write_motion(motion)
    client = Program(programs / "palpate-client", "--server", f"127.0.0.1:{port}", "--station", "hand", "--device", "replay", "--motion",
                     motion, "--realtime", "off", "--duration-s", "300", "--report", report)
    with client:
        with server(programs, scenes, port, recording) as first:
            client.wait_for("^motion of")
            time.sleep(6)
            os.kill(first.process.pid, signal.SIGKILL)
            first.ended()
        client.wait_for("server lost")
        with server(programs, scenes, port, recording) as second:
            back = time.monotonic()
            resumed = second.wait_for(r'"event":"resumed".*')
            assert '"tools":1' in resumed.group(0), resumed.group(0)
            second.wait_for('"event":"joined"')
            took = time.monotonic() - back  # said, not judged: where tools are let go before, the body is off
            time.sleep(4)
            client.process.send_signal(signal.SIGINT)
            assert client.ended() == 0
            os.kill(second.process.pid, signal.SIGTERM)
            assert second.ended() == 0
    before, after = shapes(programs, recording, work / "before"), shapes(programs, work / "session.2.rec", work / "after")
    depth = farthest(before[-1], before[0])
    assert depth > PRESSED_M / 2, f"the hand pressed by {depth} m only"
    hold = after[: len(after) - 20]  # it lets go at the end
    assert len(hold) > 20, len(after)
    off = max(farthest(shape, before[-1]) for shape in hold)
    assert off < SAME_M, f"the body was off by {1e3 * off:.3f} mm after the restart, of a depth of {1e3 * depth:.1f} mm"
    felt = forces(report)
    size = numpy.linalg.norm(felt[:, 1:], axis=1)
    last = numpy.flatnonzero(size > 0.99 * size.max())[-1]  # then it ends
    felt, size = felt[:last], size[:last]
    together = numpy.diff(felt[:, 0]) < 1.5 * TICK_S
    step = numpy.linalg.norm(numpy.diff(felt[:, 1:], axis=0), axis=1)[together].max()
    most = 1.1 * size.max() / RAMP_TICKS
    assert (size < 1e-9).any() and size[-1] > 0.9 * size.max(), "the hand did not feel the body, nothing, and the body again"
    assert step < most, f"a step of {step:.4f} N in a tick, of a force of {size.max():.2f} N"
    return took, depth, off, size.max(), step


def refused(programs, scenes, scene, recording):
    done = subprocess.run([programs / "palpate-server", "--scene", scenes / scene, "--listen", "127.0.0.1:0", "--record", recording,
                           "--resume", "--duration-s", "0.1"], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 2 and done.stderr.count("\n") == 1, (done.returncode, done.stdout, done.stderr)
    return done.stderr


def check_wrong_files(programs, scenes, work):
    recording = work / "session.rec"
    latest = work / "session.2.rec"
    said = refused(programs, scenes, "cube6.json", recording)
    assert f'--resume from {latest}: is of room "touch-cube"; expected of room "cube6"' in said, said
    text = work / "text.rec"
    text.write_text("no recording\n")
    said = refused(programs, scenes, "touch-cube.json", text)
    assert f"--resume from {text}: is no recording; expected a recording" in said, said
    done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--resume"], capture_output=True, text=True,
                          timeout=PATIENCE_S)
    assert done.returncode == 2 and "--resume: has no recording to continue; expected --record FILE" in done.stderr, done.stderr
    # The newest was cut as it began: the one before it counts.
    for size in (1, 1000):
        (work / "cut.rec").write_bytes(latest.read_bytes())
        (work / "cut.2.rec").write_bytes(latest.read_bytes()[:size])
        done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", "--record",
                               work / "cut.rec", "--resume", "--duration-s", "0.1"], capture_output=True, text=True, timeout=PATIENCE_S)
        said = done.stdout + done.stderr
        assert done.returncode == 0 and f"warning: --resume from {work / 'cut.2.rec'}: " in said, said
        assert f"the body is as {work / 'cut.rec'} had it" in said and (work / "cut.3.rec").exists(), said
        (work / "cut.3.rec").unlink()
    # The only one was cut as it began: the body is at rest, and the next number is written.
    for k, size in enumerate((1, 100, 1000)):
        cut = work / f"only{k}.rec"
        cut.write_bytes(latest.read_bytes()[:size])
        done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", "--record", cut,
                               "--resume", "--duration-s", "0.1"], capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 0 and "it is at rest" in done.stdout and (work / f"only{k}.2.rec").exists(), done.stdout + done.stderr
    # Its middle damaged: what is behind the damage counts.
    broken = bytearray(latest.read_bytes())
    del broken[len(broken) // 2 : len(broken) // 2 + 1000]
    damaged = work / "damaged.rec"
    damaged.write_bytes(broken)
    done = subprocess.run([programs / "palpate-server", "--scene", scenes / "touch-cube.json", "--listen", "127.0.0.1:0", "--record", damaged,
                           "--resume", "--duration-s", "0.1"], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0 and f"the body is as {damaged} had it" in done.stdout, done.stdout + done.stderr
    assert damaged.read_bytes() == bytes(broken) and (work / "damaged.2.rec").exists()
    done = subprocess.run([programs / "palpate-lab", "summary", "--recording", damaged, "--out", work / "summary"], capture_output=True,
                          text=True, timeout=PATIENCE_S)
    assert done.returncode == 0 and "damaged in 1 place:" in done.stderr, done.stdout + done.stderr


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        took, depth, off, force, step = check_killed(programs, scenes, work)
        check_wrong_files(programs, scenes, work)
    print(f"the hand was back {took:.1f} s after the server's start, the body off by {1e3 * off:.3f} mm of {1e3 * depth:.1f}, the largest "
          f"step {step:.4f} N of {force:.2f}")


if __name__ == "__main__":
    main()
