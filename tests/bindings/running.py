"""What the tests of bindings share: where things are, and a server of a scene."""

import contextlib
import pathlib
import re
import subprocess
import sys


class Places:
    """The arguments of every test: the sources, the build folder, and a folder to write to."""

    def __init__(self):
        self.sources, self.build, self.work = (pathlib.Path(argument) for argument in sys.argv[1:])
        self.scenes, self.programs = self.sources / "scenes", self.build / "bin"
        self.work.mkdir(parents=True, exist_ok=True)
        sys.path.insert(0, str(self.build / "python"))

    def scene(self, name):
        return self.scenes / f"{name}.json"


@contextlib.contextmanager
def serving(places, scene, *flags):
    """A server of this scene on a free port: yields its address; ends it with a signal."""
    server = subprocess.Popen(
        [places.programs / "palpate-server", "--scene", places.scene(scene), "--listen", "127.0.0.1:0", *map(str, flags)],
        stdout=subprocess.PIPE, text=True)
    try:
        place = None
        while place is None:
            line = server.stdout.readline()
            assert line, "the server said no address"
            place = re.search(r"(127\.0\.0\.1:\d+)", line)
        yield place.group(1)
    finally:
        server.terminate()
        server.communicate(timeout=60)
    assert server.returncode == 0, server.returncode
