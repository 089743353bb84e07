"""One station guides another: both feel it, server, recording and reports say so, and neither keys nor the guided hand are passed over.

usage: check_guidance.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES
"""

import json
import pathlib
import sys
import tempfile

from running import Program, Server, end, key, run

MOTION = "t_s,x_m,y_m,z_m\n"


def motion(work, home, name, distance_m):
    """A stroke to and fro at a distance from the surface."""
    file = work / f"{name}.csv"
    x, y, z = home
    rows = [(0, x), (1.5, x), (2.5, x + distance_m), (3.5, x), (4.5, x + distance_m), (6, x + distance_m)]
    file.write_text(MOTION + "".join(f"{t},{at},{y},{z + 0.03}\n" for t, at in rows))
    return file


def client(programs, server, name, *arguments):
    return Program(programs / "palpate-client", "--server", server.address, "--station", name, "--realtime", "off", *arguments)


def home_of(scenes):
    """Middle of the cube's top."""
    x, y, z = json.loads((scenes / "touch-cube.json").read_text())["body"]["lattice"]["size_m"]
    return x / 2, y / 2, z


def check_held(programs, scenes, work):
    recording, reports = work / "room.plpr", {name: work / name for name in ("guide", "trainee")}
    home = home_of(scenes)
    with Server(programs, scenes / "touch-cube.json", "--record", recording) as server:
        with client(programs, server, "OR 1", "--motion", motion(work, home, "still", 0), "--report", reports["trainee"]) as trainee, \
                client(programs, server, "OR 3", "--guide", "OR 1", "--motion", motion(work, home, "stroke", 0.02),
                       "--report", reports["guide"]) as guide:
            guide.wait_for("this hand guides OR 1")
            trainee.wait_for("OR 3 guides this hand")
            assert guide.ended() == 0, guide.lines
            assert trainee.ended() == 0, trainee.lines
        server.wait_for('station "OR 3" guides "OR 1"')
        server.wait_for(r'station "OR 3" guided "OR 1" for \d+\.\d s; mean force \d\.\d\d N')
        end(server)
    summaries = {name: json.loads((folder / "summary.json").read_text())["guidance"] for name, folder in reports.items()}
    for name, partner in (("guide", "OR 1"), ("trainee", "OR 3")):
        felt = summaries[name]
        assert felt["partner"] == partner and felt["guides"] == (name == "guide"), felt
        assert felt["holds"] >= 1 and felt["held_s"] > 1 and 0 < felt["force_mean_n"] <= felt["force_max_n"] < 6, felt
    done = run(programs, "palpate-lab", "summary", "--recording", recording, "--out", work / "summary")
    assert done.returncode == 0 and "OR 3 guided OR 1 from" in done.stdout, done.stdout + done.stderr
    holds = json.loads((work / "summary" / "summary.json").read_text())["guidance"]
    assert holds[0]["guide"] == "OR 3" and holds[0]["guided"] == "OR 1" and holds[0]["duration_s"] > 1, holds
    assert abs(holds[0]["guided_force_mean_n"] - summaries["trainee"]["force_mean_n"]) < 0.5, (holds, summaries)
    assert "OR 3 guided OR 1" in (work / "summary" / "report.html").read_text().replace("&quot;", '"')


def check_refused(programs, scenes):
    with Server(programs, scenes / "touch-cube.json") as server:
        with client(programs, server, "OR 1", "--no-guidance", "--duration-s", "20") as trainee, \
                client(programs, server, "OR 3", "--guide", "OR 1", "--duration-s", "20") as guide:
            guide.wait_for("OR 1 refuses guidance")
            said = end(trainee) + end(guide)
            assert "guides this hand" not in said and "this hand guides" not in said and "guidance  " not in said, said


def check_right(programs, scenes, work):
    site = work / "site.key"
    public = key(programs, "new", site)
    files = {name: work / f"{name}.key" for name in ("OR 1", "OR 3", "OR 4")}
    for name, role in (("OR 1", "hand"), ("OR 3", "hand,guide"), ("OR 4", "hand,viewer")):
        key(programs, "admit", site, key(programs, "new", files[name], "--trust", public), name, "--role", role)
    wrong = run(programs, "palpate-key", "admit", site, key(programs, "new", work / "x.key", "--trust", public), "x", "--role", "guide")
    assert wrong.returncode == 2 and '"guide" is no role' in wrong.stderr, wrong.stderr
    with Server(programs, scenes / "touch-cube.json", "--keys", site) as server:
        with client(programs, server, "OR 4", "--guide", "OR 1", "--key", files["OR 4"], "--duration-s", "20") as refused:
            refused.wait_for("this key may not guide others")
            assert refused.ended() == 1, refused.lines
        server.wait_for(r'station "OR 4" refused from 127\.0\.0\.1:\d+ by its key.s rights: this key may not guide others')
        with client(programs, server, "OR 1", "--key", files["OR 1"], "--duration-s", "30") as trainee, \
                client(programs, server, "OR 3", "--guide", "OR 1", "--key", files["OR 3"], "--duration-s", "30") as guide:
            trainee.wait_for("OR 3 guides this hand")
            end(guide)
            trainee.wait_for("guidance with OR 3 has ended")
            assert not any("when both links are measured" in line for line in trainee.lines[-3:]), trainee.lines
            end(trainee)


def main():
    programs, scenes = map(pathlib.Path, sys.argv[1:])
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        check_held(programs, scenes, work)
        check_refused(programs, scenes)
        check_right(programs, scenes, work)
    own = run(programs, "palpate-client", "--server", "127.0.0.1:9", "--station", "a", "--guide", "a")
    assert own.returncode == 2 and "--guide: 'a' is this station" in own.stderr, own.stderr


if __name__ == "__main__":
    main()
