"""Uses palpate-view's window as a person does, on an X server of the test's own.

usage: check_window.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
from running import PATIENCE_S, at_last  # noqa: E402  (after the path is set)

SKIPPED = 77
NOBODY = "127.0.0.1:9"  # where no server listens


class Display:
    """An X server, its number in `environment`."""

    def __init__(self, size="1280x800", dots_per_inch=None):
        ours, theirs = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-displayfd", str(theirs), "-screen", "0", size + "x24", "-noreset"], pass_fds=[theirs],
                                       stderr=subprocess.DEVNULL)
        os.close(theirs)
        with os.fdopen(ours) as number:
            self.environment = dict(os.environ, DISPLAY=":" + number.readline().strip())
        if dots_per_inch:
            self.run("xprop", "-root", "-f", "RESOURCE_MANAGER", "8s", "-set", "RESOURCE_MANAGER", f"Xft.dpi:\t{dots_per_inch}")

    def run(self, *command):
        done = subprocess.run(command, env=self.environment, capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 0, f"{' '.join(command)}: exit {done.returncode}: {done.stderr}"
        return done.stdout

    def xdotool(self, *arguments):
        return self.run("xdotool", *map(str, arguments))

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.terminate()
        self.server.wait()


class View:
    """palpate-view, with its window open."""

    def __init__(self, programs, display, *arguments):
        self.display = display
        self.program = subprocess.Popen([programs / "palpate-view", *arguments], env=display.environment, stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True)
        until = time.monotonic() + PATIENCE_S
        while not (windows := self.windows()):
            assert self.program.poll() is None, f"no window: {self.program.communicate()[1]}"
            assert time.monotonic() < until, "no window"
            time.sleep(0.05)
        self.window = windows[0]

    def windows(self):
        found = subprocess.run(["xdotool", "search", "--onlyvisible", "--name", "^Palpate$"], env=self.display.environment,
                               capture_output=True, text=True)
        return found.stdout.split()

    def close(self):
        """By its key; what it said on the way."""
        self.display.xdotool("key", "--window", self.window, "q")
        said, complaint = self.program.communicate(timeout=PATIENCE_S)
        assert self.program.returncode == 0, f"exit {self.program.returncode}: {complaint}"
        assert complaint == "", complaint
        return said


class Room:
    """A server of a scene."""

    def __init__(self, programs, scene, recording):
        self.server = subprocess.Popen([programs / "palpate-server", "--scene", scene, "--listen", "127.0.0.1:0", "--record", recording],
                                       stdout=subprocess.PIPE, text=True)
        self.address = re.search(r"at (127\.0\.0\.1:\d+)", self.server.stdout.readline()).group(1)

    def wait_for_two(self):
        """Until the viewer and its mouse have joined: the server says so every 5 s."""
        while "2 stations" not in self.server.stdout.readline():
            assert self.server.poll() is None, "the server ended"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.server.send_signal(signal.SIGTERM)
        self.server.communicate()


def check_old_opengl(programs):
    with Display() as display:
        environment = dict(display.environment, MESA_GL_VERSION_OVERRIDE="2.1", LIBGL_ALWAYS_SOFTWARE="1")
        done = subprocess.run([programs / "palpate-view", "--server", NOBODY], env=environment, capture_output=True, text=True,
                              timeout=PATIENCE_S)
        assert done.returncode == 1, f"exit {done.returncode}"
        assert done.stderr.count("\n") == 1, done.stderr
        assert "OpenGL 3.3" in done.stderr and "found OpenGL 2.1" in done.stderr, done.stderr


def check_closed_while_connecting(programs):
    with Display() as display:
        for touch in ([], ["--touch"]):
            said = View(programs, display, "--server", NOBODY, *touch).close()
            assert ("the mouse touched nothing" in said) == bool(touch), said


def check_dense(programs):
    """On a display of 192 dots an inch a window is as large as on one of 96, in inches."""
    with Display("2700x1700", dots_per_inch=192) as display:
        view = View(programs, display, "--server", NOBODY)
        shape = display.xdotool("getwindowgeometry", view.window)
        view.close()
        assert "2560x1600" in shape, shape


def check_pressed(programs, scene, recording):
    """Presses the left button over the middle of the body, drags, lets go: the hand would have felt something."""
    recording.unlink(missing_ok=True)
    with Display() as display, Room(programs, scene, recording) as room:
        view = View(programs, display, "--server", room.address, "--touch", "--no-panels", "--patch")
        room.wait_for_two()
        display.xdotool("mousemove", 640, 400, "sleep", 1, "mousedown", 1, "sleep", 1)
        for _ in range(10):
            display.xdotool("mousemove_relative", "--", -3, -6, "sleep", 0.05)
        display.xdotool("sleep", 0.5, "mouseup", 1)
        said = view.close()
    force = float(re.search(r"at most ([\d.]+) N", said).group(1))
    assert force > 0.05, f"{scene}: a mouse that presses and drags met {force} N"


def drawn_anew(programs, recording, *clicks):
    """Of a recording that stands at its end, after clicks on the track of the replay bar at these shares of its length."""
    left, right, middle = 190, 1204, 772
    with Display() as display:
        length = re.search(r"0 to ([\d.]+)", subprocess.run(
            [programs / "palpate-view", "--recording", recording, "--at", "1e5", "--screenshot", "no.png"],
            capture_output=True, text=True, timeout=PATIENCE_S).stderr).group(1)
        view = View(programs, display, "--recording", recording, "--at", length)
        display.xdotool("sleep", 1)
        for share in clicks:
            display.xdotool("mousemove", left + round(share * (right - left)), middle, "sleep", 0.3, "click", 1, "sleep", 0.7)
        said = view.close()
    return int(re.search(r"(\d+) of them drawn anew", said).group(1))


def check_scrubbed(programs, recording):
    still, moved = drawn_anew(programs, recording), drawn_anew(programs, recording, 0.9, 0.7, 0.99)
    assert moved >= still + 3, f"{moved} pictures drawn anew after three clicks on the bar, {still} without"


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:])
    for tool in ("Xvfb", "xdotool", "xprop"):
        if not shutil.which(tool):
            print("skipped: no", tool)
            sys.exit(SKIPPED)
    check_old_opengl(programs)
    check_closed_while_connecting(programs)
    check_dense(programs)
    with tempfile.TemporaryDirectory() as work:
        for scene in ("touch-cube", "cube6"):
            recording = pathlib.Path(work) / (scene + ".rec")
            at_last(check_pressed, programs, scenes / (scene + ".json"), recording)
            at_last(check_scrubbed, programs, recording)


if __name__ == "__main__":
    main()
