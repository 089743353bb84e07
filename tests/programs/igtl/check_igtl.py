"""palpate-bridge igtl with a server, a hand and OpenIGTLink's own library as the other end.

usage: check_igtl.py FOLDER_OF_PROGRAMS IGTL_PEER FOLDER_OF_SCENES
"""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

PATIENCE_S = 60


def start(*arguments):
    return subprocess.Popen([str(a) for a in arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def line_with(program, words):
    """The first line of a program that has these words."""
    said = []
    for line in program.stdout:
        said.append(line)
        if words in line:
            return line
    raise AssertionError(f"no '{words}' in {''.join(said)}")


def end(*programs):
    for program in programs:
        program.send_signal(signal.SIGTERM)
    for program in programs:
        program.communicate(timeout=PATIENCE_S)


def port_of(program):
    return re.search(r"127\.0\.0\.1:(\d+)", line_with(program, "OpenIGTLink at")).group(1)


def listened(peer, port, bodies):
    done = subprocess.run([peer, "listen", port, str(bodies)], capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, (done.returncode, done.stdout[-2000:])
    messages = []
    for line in done.stdout.splitlines():
        kind, rest = line.split(" ", 1)
        name, *values = rest.rsplit(" ", 9 if kind == "POLYDATA" else 3)  # a station's name may have spaces
        messages.append((kind, name, [float(value) for value in values]))
    return messages


def check_sending(programs, peer, scenes, work):
    """A hand that holds the tip 8 mm deep: place in millimetres, a force that pushes it out, a body that yields."""
    motion = work / "press.csv"
    motion.write_text("t_s,x_m,y_m,z_m\n0,0,0,0.2\n1,0,0,0.075\n60,0,0,0.075\n")
    server = start(programs / "palpate-server", "--scene", scenes / "organ.json", "--listen", "127.0.0.1:0")
    place = re.search(r"127\.0\.0\.1:\d+", line_with(server, "at 127")).group(0)
    sender = start(programs / "palpate-bridge", "igtl", "--server", place, "--listen", "127.0.0.1:0")
    port = port_of(sender)
    hand = start(programs / "palpate-client", "--server", place, "--station", "or 3", "--device", "replay", "--motion", motion)
    try:
        line_with(hand, "joined")
        # A client that comes again, until the hand presses: on a busy machine that is later.
        for bodies in (20, *[60] * 8):
            messages = listened(peer, port, bodies)
            line_with(sender, "nobody is connected")  # it has left the server
            forces = [m for m in messages if m[0] == "SENSOR"]
            if bodies > 20 and forces and forces[-1][2][2] > 0.05:
                break
        bodies = [m for m in messages if m[0] == "POLYDATA"]
        tools = [m for m in messages if m[0] == "TRANSFORM"]
        assert tools and {m[1] for m in tools} == {"or 3"} and {m[1] for m in forces} == {"or 3 force"}, messages[:5]
        x, y, z = tools[-1][2]
        assert abs(x) < 1 and abs(y) < 1 and abs(z - 75) < 1, tools[-1]
        assert forces[-1][2][2] > 0.05, forces[-1]
        points, triangles, *box, most = bodies[-1][2]
        assert points > 100 and triangles > 100 and most > 2, bodies[-1]
        assert all(20 < high - low < 400 for low, high in zip(box[:3], box[3:])), box
    finally:
        end(hand, sender, server)


def check_receiving(programs, peer, work):
    """A surface with a hole is named and not used; the next one becomes a scene at its place that a server runs."""
    scene = work / "made" / "ball.json"
    receiver = start(programs / "palpate-bridge", "igtl", "--receive", scene, "--material", "liver", "--spacing-mm", "8", "--hold-mm", "12",
                     "--up", "anterior", "--listen", "127.0.0.1:0")
    port = port_of(receiver)
    for arguments in (["40", "open"], ["40"]):
        subprocess.run([peer, "send", port, *arguments], check=True, timeout=PATIENCE_S)
        if len(arguments) == 2:
            assert "holes" in line_with(receiver, "Segment_1 is not used")
    said = receiver.communicate(timeout=PATIENCE_S)[0]
    assert receiver.returncode == 0 and f"palpate-server --scene {scene}" in said, said
    assert json.loads(scene.read_text())["body"]["lattice"]["clip"]["mesh"]["file"] == "ball.stl"
    done = subprocess.run([programs / "palpate-server", "--scene", scene, "--listen", "127.0.0.1:0", "--duration-s", "1"],
                          capture_output=True, text=True, timeout=PATIENCE_S)
    assert done.returncode == 0, done.stdout + done.stderr
    nodes, held = re.search(r"(\d+) of (\d+) nodes fixed", done.stdout).group(2, 1)
    assert 400 < int(nodes) < 900 and 0 < int(held) < int(nodes) / 4, done.stdout
    # The body that comes back lies where the surface was.
    server = start(programs / "palpate-server", "--scene", scene, "--listen", "127.0.0.1:0")
    place = re.search(r"127\.0\.0\.1:\d+", line_with(server, "at 127")).group(0)
    sender = start(programs / "palpate-bridge", "igtl", "--server", place, "--listen", "127.0.0.1:0", "--up", "anterior")
    try:
        _, _, *box, most = listened(peer, port_of(sender), 1)[-1][2]
        for bound, expected in zip(box, (60, -90, -20, 140, -10, 60)):
            assert abs(bound - expected) < 8, box
        assert most < 1, most
    finally:
        end(sender, server)


def check_refusals(programs, work):
    def refused(*arguments):
        done = subprocess.run([programs / "palpate-bridge", "igtl", *arguments], capture_output=True, text=True, timeout=PATIENCE_S)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done
        return done.stderr

    assert "are both missing" in refused()
    assert "--material: is missing" in refused("--receive", work / "a.json")
    assert '--material: "cheese" is unknown; expected one of brain' in refused("--receive", work / "a.json", "--material", "cheese")
    assert "is a folder" in refused("--receive", work, "--material", "liver")
    (work / "file").write_text("")
    assert "cannot be made" in refused("--receive", work / "file" / "a.json", "--material", "liver")
    assert "together with --receive" in refused("--receive", work / "a.json", "--material", "liver", "--rate-hz", "20")
    assert "together with --server" in refused("--server", "127.0.0.1:1", "--material", "liver")
    assert "--insecure" in refused("--server", "127.0.0.1:1", "--listen", "0.0.0.0:0")
    assert "no direction of a patient" in refused("--server", "127.0.0.1:1", "--up", "z")


def main():
    programs, peer, scenes = pathlib.Path(sys.argv[1]), sys.argv[2], pathlib.Path(sys.argv[3])
    with tempfile.TemporaryDirectory() as name:
        work = pathlib.Path(name)
        check_refusals(programs, work)
        check_receiving(programs, peer, work)
        check_sending(programs, peer, scenes, work)


if __name__ == "__main__":
    main()
