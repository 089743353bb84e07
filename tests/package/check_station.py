"""A station of docs/tutorials joins a server and feels the body.

usage: check_station.py SERVER STATION SCENES
"""

import pathlib
import re
import subprocess
import sys


def main():
    server_program, station, scenes = sys.argv[1:]
    server = subprocess.Popen([server_program, "--scene", f"{scenes}/cube6.json", "--listen", "127.0.0.1:0", "--duration-s", "60"],
                              stdout=subprocess.PIPE, text=True)
    try:
        place = None
        while place is None:
            line = server.stdout.readline()
            assert line, "the server said no address"
            place = re.search(r"(127\.0\.0\.1:\d+)", line)
        motion = [f"{scenes}/motions/press.csv"] if pathlib.Path(station).name == "station" else []
        said = subprocess.run([station, place.group(1), *motion], check=True, capture_output=True, text=True, timeout=50).stdout
    finally:
        server.terminate()
        server.wait()
    print(said, end="")
    felt = re.fullmatch(r"(\d+) ticks, at most ([\d.]+) N\n", said)
    assert felt and int(felt.group(1)) > 0, said
    assert 0.1 < float(felt.group(2)) <= 8.5, said  # presses of 8 to 10 mm are about 1 N in the full model


if __name__ == "__main__":
    main()
