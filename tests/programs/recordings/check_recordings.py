"""Records a session with the real programs, kills them, and reads what they leave as others would.

usage: check_recordings.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES WORK
"""

import base64
import csv
import json
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree

import numpy

LOST_MOST_S = 1.0  # of a session by a program that is killed
TASK_HOLD_MOST_S = 0.25  # between two frames of a stretch in the band: a busy machine leaves frames out


def lines_of(file):
    with open(file, newline="") as text:
        return list(csv.DictReader(text))


def column(rows, *names):
    return numpy.array([[float(row[name]) for name in names] for row in rows])


TURN_RAD_S = 0.5
PRESSES = [(0.5, 1), (1.0, 2), (1.2, 0)]  # from then on, in seconds of the motion


def write_held_motion(motion, file):
    """The same, the tool turning steadily about z, buttons pressed in between."""
    rows = motion.read_text().split()
    with open(file, "w") as out:
        print(rows[0] + ",qx,qy,qz,qw,buttons", file=out)
        for row in rows[1:]:
            t_s = float(row.split(",")[0])
            half = TURN_RAD_S * t_s / 2
            pressed = ([0] + [state for begin, state in PRESSES if begin <= t_s])[-1]
            print(f"{row},0,0,{numpy.sin(half)!r},{numpy.cos(half)!r},{pressed}", file=out)
    return file


class Session:
    """A server and a client that record, until they are ended with one signal or the other."""

    def __init__(self, programs, scenes, work):
        motion = write_held_motion(scenes / "motions" / "press.csv", work / "held.csv")
        self.server_file, self.client_file = work / "server.rec", work / "client.rec"
        self.server = subprocess.Popen(
            [programs / "palpate-server", "--scene", scenes / "cube6.json", "--listen", "127.0.0.1:0", "--record", self.server_file],
            stdout=subprocess.PIPE, text=True)
        address = re.search(r"at (127\.0\.0\.1:\d+)", self.server.stdout.readline()).group(1)
        self.client = subprocess.Popen(
            [programs / "palpate-client", "--server", address, "--device", "replay", "--motion", motion,
             "--realtime", "off", "--record", self.client_file],
            stdout=subprocess.PIPE, text=True)
        while "motion of" not in self.client.stdout.readline():
            assert self.client.poll() is None, "the client ended before its motion"

    def end(self, how):
        """Returns the moment, in the clock that the recordings use."""
        moment = time.monotonic()
        for program in (self.client, self.server):
            program.send_signal(how)
        for program in (self.client, self.server):
            program.communicate()
        return moment


def lab(programs, *arguments):
    done = subprocess.run([programs / "palpate-lab", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, f"palpate-lab {arguments}: {done.stderr}"
    return done


def check_killed(programs, scenes, work):
    session = Session(programs, scenes, work)
    time.sleep(2.5)
    killed_s = session.end(signal.SIGKILL)
    lost = []
    for file in (session.server_file, session.client_file):
        out = work / file.stem
        done = lab(programs, "export", "--recording", file, "--out", out)
        assert "what can be read is exported" in done.stderr, "a killed program's recording counts as complete"
        end_s = float(re.search(r"ends at ([\d.]+) s of the clock", done.stdout).group(1))
        lost.append(killed_s - end_s)
    return lost


def check_tables(work):
    server, client = work / "server", work / "client"
    sent, used = lines_of(client / "hand" / "samples.csv"), lines_of(server / "hand" / "samples.csv")
    assert list(sent[0]) == ["t_s", "x_m", "y_m", "z_m"]
    times = column(used, "t_s")
    assert (numpy.diff(times, axis=0) > 0).all(), "samples are not in order"
    known = {tuple(row) for row in column(sent, "x_m", "y_m", "z_m")}
    strange = [row for row in column(used, "x_m", "y_m", "z_m") if tuple(row) not in known]
    # What the client had not yet recorded when it was killed, its server may have got.
    assert len(strange) <= 1000 * LOST_MOST_S, f"{len(strange)} samples at the server that the client never took"
    felt, model = lines_of(client / "hand" / "forces.csv"), lines_of(server / "hand" / "forces.csv")
    largest = [numpy.abs(column(rows, "fx_n", "fy_n", "fz_n")).max() for rows in (felt, model)]
    assert 0.5 < largest[0] / largest[1] < 2, f"the hand felt {largest[0]} N, the server's tool {largest[1]} N"
    got = []  # bytes of each patch with the terms that came behind it, as the server counts them
    for row in lines_of(client / "hand" / "patches.csv"):
        if row["what"] == "patch":
            got.append(0)
        got[-1] += int(row["bytes"])
    made = {int(row["bytes"]) for row in lines_of(server / "hand" / "patches.csv")}
    assert 0 < len(got) and made & set(got), f"the client got patches of {got} bytes, the server made some of {made}"
    assert {"joined", "motion"} <= {row["event"] for row in lines_of(client / "events.csv")}
    assert any(row["event"] == "joined" and row["station"] == "hand" for row in lines_of(server / "events.csv"))
    # A busy machine has time for few frames.
    assert len(lines_of(server / "frames.csv")) > 5 and len(lines_of(server / "hand" / "links.csv")) > 2
    assert len(lines_of(client / "hand" / "hand_overs.csv")) > 1


def check_held(work):
    """How the tool was held, and its buttons, as the motion had them: at the client every tick, at the server as they came."""
    server, client = work / "server", work / "client"
    begin_s = next(float(row["t_s"]) for row in lines_of(client / "events.csv") if row["event"] == "motion")
    turns = column(lines_of(client / "hand" / "orientation.csv"), "t_s", "qx", "qy", "qz", "qw")
    turns = turns[turns[:, 0] > begin_s]
    assert len(turns) > 500 and (numpy.abs(turns[:, 1:3]) < 1e-4).all(), "the tool did not turn about z"
    angle = 2 * numpy.arctan2(turns[:, 3], turns[:, 4])
    assert numpy.abs(angle - TURN_RAD_S * (turns[:, 0] - begin_s)).max() < 2e-3, "the tool was not held as the motion says"
    presses = column(lines_of(client / "hand" / "buttons.csv"), "t_s", "buttons")
    assert [state for _, state in presses] == [state for _, state in PRESSES], presses
    # A tick that was slept through sees a button a little later.
    late = presses[:, 0] - begin_s - [begin for begin, _ in PRESSES]
    assert (late > -1e-6).all() and (late < 0.5).all(), late
    assert [state for _, state in column(lines_of(server / "hand" / "buttons.csv"), "t_s", "buttons")] == [1, 2, 0]
    seen = column(lines_of(server / "hand" / "orientation.csv"), "qx", "qy", "qz", "qw")
    assert len(seen) > 5 and seen[-1][2] > 0.1, "the server did not see the tool turn"


def array_of(parent, name, kind):
    for element in parent.iter("DataArray"):
        if element.get("Name") == name:
            data = base64.b64decode(element.text.strip())
            size = int.from_bytes(data[:4], "little")
            assert size == len(data) - 4, "a DataArray's size is wrong"
            return numpy.frombuffer(data[4:], kind)
    raise AssertionError(f"no DataArray {name}")


def read_vtp(file):
    piece = xml.etree.ElementTree.parse(file).getroot().find("PolyData/Piece")
    points = array_of(piece.find("Points"), "points", "<f4").reshape(-1, 3)
    displacement = array_of(piece.find("PointData"), "displacement", "<f4").reshape(-1, 3)
    connectivity = array_of(piece.find("Polys"), "connectivity", "<i4")
    offsets = array_of(piece.find("Polys"), "offsets", "<i4")
    assert len(points) == len(displacement) == int(piece.get("NumberOfPoints"))
    assert len(offsets) == int(piece.get("NumberOfPolys")) and (numpy.diff(offsets) == 3).all() and offsets[-1] == len(connectivity)
    return points, displacement, connectivity.reshape(-1, 3)


def read_ply(file):
    data = file.read_bytes()
    head, body = data.split(b"end_header\n", 1)
    assert head.startswith(b"ply\nformat binary_little_endian 1.0\n")
    count = {name: int(number) for name, number in re.findall(r"element (\w+) (\d+)", head.decode())}
    floats = numpy.frombuffer(body, "<f4", 6 * count["vertex"]).reshape(-1, 6)
    faces = numpy.frombuffer(body[24 * count["vertex"]:], numpy.dtype([("n", "u1"), ("v", "<i4", 3)]), count["face"])
    assert len(body) == 24 * count["vertex"] + 13 * count["face"] and (faces["n"] == 3).all()
    return floats[:, :3], floats[:, 3:], faces["v"]


def volume(points, triangles):
    a, b, c = (points[triangles[:, k]].astype(float) for k in range(3))
    return numpy.einsum("ij,ij->i", a, numpy.cross(b, c)).sum() / 6


def check_shapes(programs, work):
    lab(programs, "export", "--recording", work / "server.rec", "--format", "ply", "--out", work / "ply")
    series = xml.etree.ElementTree.parse(work / "server" / "shapes.pvd").getroot().find("Collection").findall("DataSet")
    times = [float(entry.get("timestep")) for entry in series]
    assert len(series) > 10 and times == sorted(times) and numpy.isclose(numpy.diff(times), 0.1, atol=2e-6).all()
    deepest = 0
    for entry in series:
        points, displacement, triangles = read_vtp(work / "server" / entry.get("file"))
        ply = read_ply(work / "ply" / entry.get("file").replace(".vtp", ".ply"))
        for ours, theirs in zip((points, displacement, triangles), ply):
            assert (ours == theirs).all(), "VTK and PLY differ"
        assert triangles.min() == 0 and triangles.max() == len(points) - 1
        assert abs(volume(points - displacement, triangles) / 1e-3 - 1) < 1e-3, "the body at rest is no cube of a litre"
        deepest = max(deepest, numpy.abs(displacement).max())
    assert 1e-3 < deepest < 0.05, f"the surface moved by {deepest} m"


def check_summary(programs, work):
    for name in ("server", "client"):
        out = work / f"{name}-summary"
        lab(programs, "summary", "--recording", work / f"{name}.rec", "--over-n", "0.2", "--out", out)
        hand = json.loads((out / "summary.json").read_text())["stations"]["hand"]
        samples = column(lines_of(out / "hand" / "samples.csv"), "t_s", "x_m", "y_m", "z_m")
        grid = numpy.arange(samples[0, 0], samples[-1, 0] + 1e-9, 0.01)
        path = numpy.stack([numpy.interp(grid, samples[:, 0], samples[:, k]) for k in (1, 2, 3)], axis=1)
        length = numpy.linalg.norm(numpy.diff(path, axis=0), axis=1).sum()
        assert abs(hand["path_m"] - length) < 1e-4 * length, f"path {hand['path_m']} m, by hand {length} m"
        forces = column(lines_of(out / "hand" / "forces.csv"), "t_s", "fx_n", "fy_n", "fz_n", "contact")
        size = numpy.linalg.norm(forces[:, 1:4], axis=1)
        assert abs(hand["force_peak_n"] - size.max()) < 1e-6
        held = numpy.minimum(numpy.diff(forces[:, 0]), 0.25)
        assert abs(hand["contact_s"] - (held * forces[:-1, 4]).sum()) < 1e-4
        assert abs(hand["over_s"] - (held * (size[:-1] > 0.2)).sum()) < 1e-4
        assert "<svg" in (out / "report.html").read_text() or "data:image/svg" in (out / "report.html").read_text() or not shutil.which("gnuplot")


def check_replay(programs, work):
    """The recording and its own exported motion are one and the same session."""
    rows = column(lines_of(work / "server" / "hand" / "samples.csv"), "t_s", "x_m", "y_m", "z_m")
    rows[:, 0] -= rows[0, 0]
    numpy.savetxt(work / "motion.csv", rows, "%.9f", ",", header="t_s,x_m,y_m,z_m", comments="")
    link = ["--scheme", "hold", "--rtt-ms", "40"]
    scene = work / "scene.json"
    scene.write_text(re.search(rb'\{\s*"name".*?\n\}', (work / "server.rec").read_bytes(), re.S).group(0).decode())
    lab(programs, "replay", "--recording", work / "server.rec", *link, "--out", work / "replay-a")
    lab(programs, "replay", "--scene", scene, "--motion", work / "motion.csv", *link, "--out", work / "replay-b")
    a, b = (column(lines_of(work / name / "forces.csv"), "fx_n", "fy_n", "fz_n", "fz_ref_n") for name in ("replay-a", "replay-b"))
    assert abs(len(a) - len(b)) <= 1 and len(a) > 1000
    least = min(len(a), len(b))
    assert numpy.abs(a[:least] - b[:least]).max() < 1e-3 * numpy.abs(b).max(), "the recording replays to other forces"


def check_sheet(programs, scenes, work):
    """A body without a surface: its lattice is exported as lines."""
    file = work / "sheet.rec"
    subprocess.run([programs / "palpate-server", "--scene", scenes / "sheet13.json", "--listen", "127.0.0.1:0", "--record", file, "--duration-s", "1"],
                   stdout=subprocess.DEVNULL, check=True)
    lab(programs, "export", "--recording", file, "--out", work / "sheet")
    piece = xml.etree.ElementTree.parse(work / "sheet" / "shapes" / "shape_00000.vtp").getroot().find("PolyData/Piece")
    points = array_of(piece.find("Points"), "points", "<f4").reshape(-1, 3)
    lines = array_of(piece.find("Lines"), "connectivity", "<i4").reshape(-1, 2)
    assert len(points) == 13 * 13 and len(lines) == int(piece.get("NumberOfLines")) == 2 * 13 * 12 + 2 * 12 * 12
    longest = numpy.linalg.norm(points[lines[:, 0]] - points[lines[:, 1]], axis=1).max()
    assert longest < 1.5 * numpy.ptp(points, axis=0).max() / 12, "a line joins what are no neighbours"


def check_task(programs, scenes, work):
    """The score of a training task, from the exported forces, and a mark by the button of a motion."""
    for task in ("press", "find"):
        scene, file, out = scenes / "tasks" / f"{task}.json", work / f"{task}.rec", work / f"{task}-task"
        motion = work / f"{task}.csv"
        lab(programs, "gesture", "--scene", scene, "--kind", "press", "--out", motion)
        rows = [line.split(",") for line in motion.read_text().split()]
        deepest = min(rows[1:], key=lambda row: float(row[3]))
        pressed = [[*rows[0], "buttons"], *([*row, int(0 <= float(row[0]) - float(deepest[0]) < 0.2)] for row in rows[1:])]
        motion.write_text("".join(",".join(map(str, row)) + "\n" for row in pressed))
        server = subprocess.Popen([programs / "palpate-server", "--scene", scene, "--listen", "127.0.0.1:0", "--record", file],
                                  stdout=subprocess.PIPE, text=True)
        address = re.search(r"at (127\.0\.0\.1:\d+)", server.stdout.readline()).group(1)
        # The server answers once it has measured what a frame takes, some seconds on a busy machine.
        subprocess.run([programs / "palpate-client", "--server", address, "--device", "replay", "--motion", motion, "--realtime", "off",
                        "--station", "anna", "--duration-s", str(float(rows[-1][0]) + 10)], stdout=subprocess.DEVNULL, check=True)
        server.terminate()
        server.communicate()
        said = lab(programs, "summary", "--recording", file, "--out", out).stdout
        attempt, = json.loads((out / "summary.json").read_text())["stations"]["anna"]["attempts"]
        row, = lines_of(out / "tasks.csv")
        assert row["station"] == "anna" and row["task"] == task and abs(float(row["score"]) - attempt["score"]) < 0.01
        other = ("miss_m", "mark_x_m", "traced_m", "within") if task == "press" else ("held_s", "traced_m", "within")
        assert not any(row[figure] for figure in other), row
        assert "attempt 1 scores" in said and json.loads((out / "summary.json").read_text())["task"]["kind"] == task
        forces = column(lines_of(out / "anna" / "forces.csv"), "t_s", "fx_n", "fy_n", "fz_n", "contact", "x_m", "y_m", "z_m")
        size = numpy.linalg.norm(forces[:, 1:4], axis=1)
        assert size.max() > 0.2, size.max()
        if task == "press":
            assert abs(attempt["force_max_n"] - size.max()) < 1e-5
            band = json.loads(scene.read_text())["task"]["press"]
            longest = stretch = 0.0
            for gap, inside in zip(numpy.diff(forces[:, 0]), (size >= band["min_n"]) & (size <= band["max_n"])):
                stretch = stretch + min(gap, TASK_HOLD_MOST_S) if inside else 0.0
                longest = max(longest, stretch)
                stretch = stretch if gap <= TASK_HOLD_MOST_S else 0.0
            assert abs(attempt["held_s"] - longest) < 1e-4 and abs(attempt["score"] - 100 * min(1, longest / band["time_s"])) < 0.01
        else:
            mark = numpy.array([float(row[f"mark_{axis}_m"]) for axis in "xyz"])
            # A mark is where the tool was in the first frame with the button, which is late on a busy machine.
            frame = numpy.linalg.norm(forces[:, 5:8] - mark, axis=1).argmin()
            late_s = 0.1 + forces[frame, 0] - forces[frame - 1, 0]
            path = numpy.array([[float(x) for x in row[:4]] for row in rows[1:]])
            there = path[(path[:, 0] >= float(deepest[0])) & (path[:, 0] <= float(deepest[0]) + late_s), 1:]
            assert attempt["marked"] == 1 and numpy.linalg.norm(there - mark, axis=1).min() < 2e-3, mark


def check_ended_well(programs, scenes, work):
    for name in ("server.rec", "client.rec"):
        (work / name).unlink()
    session = Session(programs, scenes, work)
    time.sleep(0.5)
    session.end(signal.SIGTERM)
    for file in (session.server_file, session.client_file):
        lab(programs, "summary", "--recording", file, "--out", work / "well")
        assert json.loads((work / "well" / "summary.json").read_text())["complete"] == 1
    again = subprocess.run([programs / "palpate-client", "--server", "127.0.0.1:9", "--record", session.client_file], capture_output=True, text=True)
    assert again.returncode == 2 and "is there already" in again.stderr


def main():
    programs, scenes, work = map(pathlib.Path, sys.argv[1:4])
    tries = []
    for _ in range(3):  # a machine that stands still for a second is not the program's fault
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir(parents=True)
        tries.append(check_killed(programs, scenes, work))
        if max(tries[-1]) <= LOST_MOST_S:
            break
    assert max(tries[-1]) <= LOST_MOST_S, f"lost at the end, server and client [s]: {tries}"
    check_tables(work)
    check_held(work)
    check_shapes(programs, work)
    check_summary(programs, work)
    check_replay(programs, work)
    check_sheet(programs, scenes, work)
    check_task(programs, scenes, work)
    check_ended_well(programs, scenes, work)
    print(f"recordings hold; lost at the end, server and client [s]: {tries[-1]}")


if __name__ == "__main__":
    main()
