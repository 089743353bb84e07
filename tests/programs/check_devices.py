"""Lists, tries and feels with devices as a user does, over the stand-ins for their vendors' libraries and services (tests/client/device/standin).

usage: check_devices.py FOLDER_OF_PROGRAMS FOLDER_OF_SCENES FOLDER_OF_STANDINS
"""

import json
import math
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

from running import PATIENCE_S, at_last

VARIABLES = {"openhaptics": ("PALPATE_LIBHD", "libstandin_hd.so"), "forcedimension": ("PALPATE_LIBDHD", "libstandin_dhd.so")}


class Service:
    """The stand-in for Haply's Inverse Service, configured like the libraries."""

    def __init__(self, standins, *ids, **standin):
        environment = {**os.environ, **{f"STANDIN_{name.upper()}": str(value) for name, value in standin.items()}}
        self.process = subprocess.Popen([standins / "standin_inverse3", *ids], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
                                        env=environment)
        self.device = f"inverse3:,port={int(self.process.stdout.readline())}"

    def __enter__(self):
        return self.device

    def __exit__(self, fault, *_):
        said, _ = self.process.communicate("")
        assert fault or self.process.returncode == 0, said


class Client:
    """palpate-client, with or without the stand-ins."""

    def __init__(self, programs, standins):
        self.program, self.standins = programs / "palpate-client", standins

    def run(self, *arguments, stdin="", **standin):
        environment = {**os.environ, **{f"STANDIN_{name.upper()}": str(value) for name, value in standin.items()}}
        for variable, library in VARIABLES.values():
            environment.setdefault(variable, str(self.standins / library))
        return subprocess.run([self.program, *map(str, arguments)], input=stdin, capture_output=True, text=True, timeout=PATIENCE_S,
                              env=environment)

    def run_without(self, *arguments):
        environment = {**os.environ, "PALPATE_LIBHD": "/nowhere/libHD.so", "PALPATE_LIBDHD": "/nowhere/libdrd.so"}
        return subprocess.run([self.program, *map(str, arguments)], capture_output=True, text=True, timeout=PATIENCE_S, env=environment)


def check_missing_library(client):
    for device, (variable, _) in VARIABLES.items():
        done = client.run_without("--server", "127.0.0.1:9", "--device", device)
        assert done.returncode == 2 and done.stderr.count("\n") == 1, done.stderr
        assert f"{variable}=/nowhere/" in done.stderr and "there is no such file" in done.stderr, done.stderr
    listed = client.run_without("--list-devices")
    assert listed.returncode in (0, 1) and listed.stdout.count("there is no such file") == 2, listed.stdout


def check_wrong_names(client):
    for device, words in (("openhaptics:nobody", "the device 'nobody' does not open"), ("forcedimension:two", "'two' is not a number"),
                          ("forcedimension:5", "expected 0 to 0"), ("haptics", "'haptics' is not a device")):
        done = client.run("--server", "127.0.0.1:9", "--device", device)
        assert done.returncode == 2 and words in done.stderr and done.stderr.count("\n") == 1, done.stderr
    done = client.run("--check-device", "replay")
    assert done.returncode == 2 and "no device to try" in done.stderr, done.stderr
    done = client.run("--server", "127.0.0.1:9", "--device", "openhaptics", fault="no_device")
    assert done.returncode == 2 and "--list-devices" in done.stderr, done.stderr


def check_service(client):
    """A device behind a service: missing, one of several, its signs, its answers."""
    done = client.run("--server", "127.0.0.1:9", "--device", "inverse3:,port=9")
    assert done.returncode == 2 and "127.0.0.1:9: nothing listens; expected Haply's" in done.stderr, done.stderr
    with Service(client.standins, "049D", "A14") as device:
        done = client.run("--server", "127.0.0.1:9", "--device", device)
        assert done.returncode == 2 and "inverse3:ID with one of 049D, A14" in done.stderr, done.stderr
    with Service(client.standins, "049D", hand="light") as device:
        at_last(check_pushes, client, device)
        done = client.run("--check-device", device, "--duration-s", "1", stdin="\n")
        assert re.search(r"driver +\d+\.\d answers a second, after \d+\.\d\d ms in the mean", done.stdout), done.stdout
    with Service(client.standins, "049D", hand="light", fault="mirrored") as device:
        at_last(check_mirrored, client, device)


def check_listing(client):
    done = client.run("--list-devices")
    for device in VARIABLES:
        assert f"{device}: its library can be loaded" in done.stdout, done.stdout
    assert "forcedimension: its library can be loaded and sees 1 device\n" in done.stdout, done.stdout


def check_pushes(client, device):
    hand = ["--hand", "light"] if device == "sim" else []
    done = client.run("--check-device", device, "--duration-s", "1.5", "--realtime", "off", *hand, stdin="yes\n", hand="light")
    for way in ("to the right", "away from you", "up"):
        assert f"pushed {way}: the hand yielded that way" in done.stdout, done.stdout
    assert "steps of 0.03 mm" in done.stdout, done.stdout


def check_mirrored(client, device):
    done = client.run("--check-device", device, "--duration-s", "1", stdin="yes\n", hand="light", fault="mirrored")
    assert done.returncode == 1 and "pushed to the right: the hand yielded the other way" in done.stdout, done.stdout
    assert "pushed up" not in done.stdout, done.stdout


def check_trial(client):
    """Signs and steps; whether this machine keeps up is not this test's to say."""
    for device in (*VARIABLES, "sim"):
        at_last(check_pushes, client, device)
    at_last(check_mirrored, client, "openhaptics")
    done = client.run("--check-device", "openhaptics", "--duration-s", "1", stdin="\n")
    assert "the force test was skipped" in done.stdout, done.stdout


def check_library_without_homing(client):
    """libdhd alone does not home: what to do is said, and nothing is waited for when the person gives up."""
    alone = {**os.environ, "PALPATE_LIBDHD": str(client.standins / "libstandin_dhd_alone.so"), "STANDIN_FAULT": "not_calibrated"}
    trial = subprocess.Popen([client.program, "--check-device", "forcedimension"], stdout=subprocess.PIPE, text=True, env=alone)
    for line in trial.stdout:
        if "it is not calibrated" in line:
            break
    assert "not ready: it is not calibrated: do what its manual says" in line, line
    trial.send_signal(signal.SIGTERM)
    said = trial.communicate(timeout=PATIENCE_S)[0]
    assert trial.returncode == 1 and "the device did not become ready" in said, said
    del alone["STANDIN_FAULT"]
    done = subprocess.run([client.program, "--check-device", "forcedimension", "--duration-s", "1"], stdin=subprocess.DEVNULL,
                          capture_output=True, text=True, timeout=PATIENCE_S, env=alone)
    assert "omega.3 stand-in, serial number 42" in done.stdout and "steps of" in done.stdout, done.stdout


def forces(log):
    """(time, strength) of each millisecond of the device."""
    rows = [tuple(map(float, line.split())) for line in log.read_text().splitlines() if line.count(" ") == 6]
    return [(row[0], math.hypot(*row[4:7])) for row in rows]


def pressing(work):
    """15 mm down and up, once a second: whenever the run begins, the hand is soon away from there."""
    motion = work / "press.csv"
    motion.write_text("t_s,x_m,y_m,z_m\n" + "".join(f"{k / 2},0,0,{-0.015 * (k % 2)}\n" for k in range(120)))
    return motion


def check_feel(client, server, work):
    """A hand that moves the held node feels it, and nothing at the end."""
    motion = pressing(work)
    for device in VARIABLES:
        log, report = work / f"{device}.log", work / device
        done = client.run("--server", server, "--device", device, "--duration-s", "5", "--realtime", "off", "--report", report,
                          motion=motion, hand="firm", log=log)
        assert done.returncode == 0 and "the device renders the force of the body from now on" in done.stdout, done.stdout + done.stderr
        felt = [strength for _, strength in forces(log)]
        assert max(felt) > 0.5 and felt[-1] == 0, (device, max(felt), felt[-1])
        assert json.loads((report / "summary.json").read_text())["run"]["device"] == device
    done = client.run("--server", server, "--device", "openhaptics", "--motion", motion)
    assert done.returncode == 2 and "moves by itself" in done.stderr, done.stderr


def check_feel_by_service(client, server, work):
    """The same through a service; and one that stalls 6 s after it was started takes the force with it."""
    for fault in ("", "silent@6"):
        log, report = work / "inverse3.log", work / "inverse3"
        with Service(client.standins, "049D", motion=pressing(work), hand="firm", log=log, fault=fault) as device:
            done = client.run("--server", server, "--device", device, "--duration-s", "8" if fault else "5", "--realtime", "off",
                              "--report", report)
        assert done.returncode == 0 and "the device renders the force of the body from now on" in done.stdout, done.stdout + done.stderr
        felt = forces(log)
        assert max(strength for at, strength in felt if at < 6) > 0.5, done.stdout
        if fault:
            assert "not answered for 20 ms" in done.stdout, done.stdout
        else:
            assert felt[-1][1] == 0, felt[-1]
        assert (report / "summary.json").exists(), done.stdout


def check_lost(client, server, work):
    """A cable that is pulled 6 s after the device was opened: no force from that millisecond on, and a report all the same."""
    log, report = work / "lost.log", work / "lost"
    done = client.run("--server", server, "--device", "openhaptics", "--duration-s", "8", "--realtime", "off", "--report", report,
                      motion=pressing(work), hand="firm", log=log, fault="lost@6")
    felt = forces(log)
    assert done.returncode in (0, 1) and max(strength for at, strength in felt if at < 6) > 0.5, done.stdout + done.stderr
    assert all(strength == 0 for at, strength in felt if at >= 6), [row for row in felt if row[0] >= 6 and row[1] > 0][:5]
    assert (report / "summary.json").exists(), done.stdout


def main():
    programs, scenes, standins = map(pathlib.Path, sys.argv[1:])
    client = Client(programs, standins)
    check_missing_library(client)
    check_wrong_names(client)
    check_listing(client)
    check_trial(client)
    check_library_without_homing(client)
    check_service(client)
    room = subprocess.Popen([programs / "palpate-server", "--scene", scenes / "cube6.json", "--listen", "127.0.0.1:0"],
                            stdout=subprocess.PIPE, text=True)
    try:
        server = re.search(r"at (127\.0\.0\.1:\d+)", room.stdout.readline()).group(1)
        with tempfile.TemporaryDirectory() as name:
            at_last(check_feel, client, server, pathlib.Path(name))
            at_last(check_lost, client, server, pathlib.Path(name))
            at_last(check_feel_by_service, client, server, pathlib.Path(name))
    finally:
        room.send_signal(signal.SIGTERM)
        room.communicate()


if __name__ == "__main__":
    main()
