"""Runs palpate-lab as a user does and reads what it leaves and says.

usage: check_lab.py PALPATE_LAB SCENES WORK
"""

import json
import pathlib
import shutil
import subprocess
import sys


def lab(program, *arguments, expect=0):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == expect, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def said(done):
    """What was said on stderr, without the progress of a command that takes longer than 10 s."""
    return [line for line in done.stderr.splitlines() if " % of " not in line]


def fnv1a(file):
    value = 0xcbf29ce484222325
    for byte in file.read_bytes():
        value = ((value ^ byte) * 0x100000001b3) % 2**64
    return f"{value:016x}"


def write_motion(file, *points):
    file.write_text("t_s,x_m,y_m,z_m\n" + "".join("{:g},{:g},{:g},{:g}\n".format(*p) for p in points))
    return file


def check_no_contact(program, scenes, work):
    """A tool that never meets the body has no score, and the command fails with a line that says so."""
    aside = write_motion(work / "aside.csv", (0, 0.05, 0.05, 0.3), (1.5, 0.05, 0.05, 0.25))
    done = lab(program, "replay", "--scene", scenes / "touch-cube.json", "--motion", aside, "--scheme", "port", "--out", work / "replay", expect=1)
    assert "no contact" in done.stderr and len(said(done)) == 1, done.stderr
    text = (work / "replay" / "summary.json").read_text()
    assert "snr_db" not in text and '"contact_ticks": 0' in text, text
    report = work / "report-aside"
    report.mkdir()
    rows = "".join(f"{i / 1000:.3f},0.05,0.05,0.3,0,0,0,20,0\n" for i in range(1200))
    (report / "forces.csv").write_text("t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact\n" + rows)
    done = lab(program, "fidelity", "--scene", scenes / "touch-cube.json", "--report", report, "--out", work / "felt-aside", expect=1)
    assert "no contact" in done.stderr, done.stderr
    assert json.loads((work / "felt-aside" / "fidelity.json").read_text())["contact_ticks"] == 0
    for told, expected in [({"name": "organ"}, 'is "touch-cube"; the hand of'),
                           ({"name": "touch-cube", "mesh": "0" * 16}, "has another surface"),
                           ({"name": "touch-cube", "hash": "0" * 16}, "but other materials, another tool or another step")]:
        (report / "summary.json").write_text(json.dumps({"run": {"scheme": "port", "scene": told}}))
        done = lab(program, "fidelity", "--scene", scenes / "touch-cube.json", "--report", report, "--out", work / "felt-other", expect=2)
        assert expected in done.stderr and len(said(done)) == 1, done.stderr
        assert not (work / "felt-other").exists()


def check_run(program, scenes, work):
    """Result files carry what was run; gestures meet the body of their scene."""
    scene, out = scenes / "touch-cube.json", work / "press"
    lab(program, "replay", "--scene", scene, "--gesture", "press", "--scheme", "port", "--rtt-ms", 60, "--seed", 7, "--out", out)
    result = json.loads((out / "summary.json").read_text())
    assert result["contact_ticks"] > 300 and result["snr_db"] > 10, result
    run = result["run"]
    assert run["scheme"] == "port" and run["seed"] == 7 and run["link"]["rtt_ms"] == 60 and run["link"]["loss_pct"] == 0, run
    assert run["scene"]["name"] == "touch-cube" and run["scene"]["hash"] == fnv1a(scene), run
    assert run["flags"]["gesture"] == "press" and run["version"] and run["machine"]["cores"] > 0, run
    wrong = ["replay", "--scene", scene, "--gesture", "press", "--out", work / "wrong"]
    done = lab(program, *wrong, "--scheme", "x", expect=2)
    assert done.stderr.endswith("port, hyper, auto\n"), done.stderr
    done = lab(program, *wrong, "--scheme", "port", "--rtt-ms", "50,20,50", expect=2)
    assert "--rtt-ms: has 50 twice; expected each number once" in done.stderr and not (work / "wrong").exists(), done.stderr
    felt = []
    for scheme in ("hyper", "auto"):  # auto: what a server gives that has the time
        lab(program, "replay", "--scene", scene, "--gesture", "press", "--scheme", scheme, "--out", work / scheme)
        felt.append((work / scheme / "forces.csv").read_bytes())
        summary = (work / scheme / "summary.json").read_text()
        assert json.loads(summary)["run"]["scheme"] == scheme, summary
    assert felt[0] == felt[1], "auto is not hyper"
    done = lab(program, "replay", "--scene", scene, "--gesture", "press", "--scheme", "port", "--rtt-ms", "60,0", "--seed", 7, "--out", work / "both")
    both = json.loads((work / "both" / "summary.json").read_text())
    first, second = both["round_trips"]
    assert both["run"]["link"]["rtt_ms"] == [60, 0] and (first["rtt_ms"], second["rtt_ms"]) == (60, 0), both
    assert first["snr_db"] == result["snr_db"] < second["snr_db"], both
    assert len([line for line in done.stdout.splitlines() if " port " in line]) == 2, done.stdout
    assert (work / "both" / "forces-60ms.csv").read_bytes() == (out / "forces.csv").read_bytes()
    motion = work / "stroke.csv"
    lab(program, "gesture", "--scene", scene, "--kind", "stroke", "--out", motion)
    lab(program, "replay", "--scene", scene, "--motion", motion, "--scheme", "hold", "--out", work / "stroke")
    run = json.loads((work / "stroke" / "summary.json").read_text())["run"]
    assert run["motion"]["hash"] == fnv1a(motion) and run["scheme"] == "hold", run


def check_fidelity(program, scenes, work):
    """What was felt has the name of its scheme, and no comparison is lost."""
    forces = [line.split(",") for line in (work / "stroke" / "forces.csv").read_text().splitlines()[1:]]
    path = [line.split(",") for line in (work / "stroke.csv").read_text().splitlines()[1:]]
    report = work / "report"
    report.mkdir()
    header = "t_s,x_m,y_m,z_m,fx_n,fy_n,fz_n,patch_age_ms,contact"
    for name in ("port", "hold"):
        header += f",{name}_fx_n,{name}_fy_n,{name}_fz_n,{name}_contact"
    rows = [header]
    for at, force in zip(path, forces):
        f = force[1:4]
        rows.append(",".join([*at, *f, "20", force[8], *f, force[8], *f, force[8]]))
    (report / "forces.csv").write_text("\n".join(rows) + "\n")
    for ran, key in [("hyper", "hyper"), ("port", "port, felt")]:
        (report / "summary.json").write_text(json.dumps({"run": {"scheme": ran}}))
        lab(program, "fidelity", "--scene", scenes / "touch-cube.json", "--report", report, "--out", work / "felt")
        result = json.loads((work / "felt" / "fidelity.json").read_text())
        assert list(result) == [key, "port", "hold", "run"], list(result)
        assert result[key]["snr_db"] == result["port"]["snr_db"], result
    # What was felt here was the last force, over no link: by itself, and beside the same without jitter and loss.
    (report / "summary.json").write_text(json.dumps({"run": {"scheme": "hold", "order": 0, "rate_hz": 20}}))
    felt_alone = program.parent / "palpate-fidelity"
    done = lab(felt_alone, "--scene", scenes / "touch-cube.json", "--report", report, "--clean-rtt-ms", 0, "--out", work / "clean")
    result = json.loads((work / "clean" / "fidelity.json").read_text())
    assert abs(result["clean_link"]["snr_db"] - result["hold, felt"]["snr_db"]) < 1, result
    assert "Over 0 ms without jitter and loss" in done.stdout and result["run"]["program"] == "palpate-fidelity", done.stdout
    (report / "summary.json").unlink()
    done = lab(felt_alone, "--scene", scenes / "touch-cube.json", "--report", report, "--clean-rtt-ms", 0, "--out", work / "x", expect=2)
    assert "the report names no scheme" in done.stderr and done.stderr.startswith("palpate-fidelity: "), done.stderr


def check_cells(program, scenes, work):
    """Shards that are merged, and a sweep that was interrupted, give the cells of the whole sweep."""
    sweep = ["pareto", "--only", "6,4,explicit,10"]
    lab(program, *sweep, "--out", work / "cells")
    lab(program, *sweep, "--shard", "1/1", "--resume", "--out", work / "cells")
    rows = (work / "cells" / "cells.csv").read_text().splitlines()
    assert len(rows) == 2 and rows[1].startswith("6,4,explicit,10,"), rows
    done = lab(program, "pareto", "--only", "6,4,explicit", "--out", work / "x", expect=2)
    assert "has 3 fields" in done.stderr, done.stderr
    done = lab(program, "pareto", "--only", "6,4,euler,10", "--out", work / "x", expect=2)
    assert "tr-bdf2, explicit" in done.stderr, done.stderr


def check_starved(program, scenes, work):
    """A server that gets half of a core for frames that take 30 of 50 ms with a whole one makes fewer and later ones."""
    command = ["starved", "--scene", scenes / "touch-cube.json", "--schemes", "port", "--shares", "1,0.5", "--cost-ms", "10,20,30,5"]
    done = lab(program, *command, "--out", work / "starved")
    whole, half = json.loads((work / "starved" / "summary.json").read_text())["shares"]
    assert (whole["share"], half["share"]) == (1, 0.5) and whole["rate_hz"] > 19 and 14 < half["rate_hz"] < 18, (whole, half)
    assert half["patch_age_p95_ms"] > whole["patch_age_p95_ms"] + 25, (whole, half)
    assert len((work / "starved" / "cells.csv").read_text().splitlines()) == 3 and "share" in done.stdout, done.stdout
    for costs, expected in [("1,2", "has 2 numbers"), ("1,2,3,4", "take longer than the patch")]:
        done = lab(program, "starved", "--scene", scenes / "touch-cube.json", "--cost-ms", costs, "--out", work / "x", expect=2)
        assert expected in done.stderr and len(said(done)) == 1, done.stderr


def check_words(program, scenes, work):
    done = lab(program, "accuracy", "--scenes", scenes, "--only", "cubee", "--out", work / "x", expect=2)
    assert "cubee" in done.stderr and "cube6, organ" in done.stderr, done.stderr
    done = lab(program, "replay", "--no-such-flag", "--out", work / "x", expect=2)
    assert "palpate-lab replay --help" in done.stderr, done.stderr
    done = lab(program, "replay", "--out", work / "x", expect=2)
    assert "palpate-lab: --scheme: it is missing" in done.stderr, done.stderr
    done = lab(program, expect=2)
    assert "EXPERIMENT: it is missing" in done.stderr, done.stderr
    done = lab(program, "replay", "--help")
    assert "->" not in done.stdout and "Example" in done.stdout and "20" in done.stdout, done.stdout
    names = [line.split()[0] for line in lab(program, "list").stdout.splitlines() if line.startswith("  ")]
    assert len(names) == len(set(names)) > 12 and "accuracy" in names, names


def main():
    program, scenes, work = map(pathlib.Path, sys.argv[1:])
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    check_no_contact(program, scenes, work)
    check_run(program, scenes, work)
    check_fidelity(program, scenes, work)
    check_cells(program, scenes, work)
    check_starved(program, scenes, work)
    check_words(program, scenes, work)


if __name__ == "__main__":
    main()
