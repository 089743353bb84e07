"""The Python module beside the same runs in C++, and its promises about memory, threads, errors and documentation.

usage: check_module.py SOURCES BUILD WORK
"""

import ast
import builtins
import gc
import inspect
import json
import os
import shutil
import subprocess
import sys
import threading
import time

import numpy as np
from running import Places

places = Places()
import palpate  # noqa: E402  (after the path is set)

SCENE = "touch-stiffening"


def expect(error, text, call):
    try:
        call()
    except error as raised:
        assert text in str(raised), str(raised)
        return str(raised)
    raise AssertionError(f"no {error.__name__}")


def numbers(name):
    return np.fromfile(places.work / f"{name}.f64").reshape(-1, 3)


def same_bits(a, b):
    assert a.shape == b.shape, (a.shape, b.shape)
    assert np.array_equal(np.ascontiguousarray(a).view(np.uint64), np.ascontiguousarray(b).view(np.uint64))


def path(scene, first, last):
    return scene.home - np.outer(np.arange(first, last + 1), [0, 0, 0.0003])


def beginning(motion):
    """As bindings_runs has it."""
    kept = motion.t_s <= 2
    return palpate.Motion(motion.t_s[kept], motion.positions[kept])


def check_press(scene):
    room, frames = palpate.Room(scene), []
    for begin in (0, 50):
        frames.append(room.step(path(scene, begin + 1, begin + 50), scheme="hyper", horizon_s=0.15))
    same_bits(np.vstack([row for f in frames for row in (f.shape, f.tool().force[None])]), numbers("frame"))
    patch = frames[-1].tool().patch
    assert patch.scheme == "hyper" and patch.nonlinear and patch.stiffness.shape == (patch.modes,)
    forces, contact, torques = palpate.Player(patch).play(path(scene, 101, 200))
    same_bits(forces, numbers("played"))
    assert contact.any() and np.abs(forces).max() > 0.1 and not torques.any()
    return frames[-1]


def check_replay(scene):
    motion = beginning(palpate.Motion.examination(scene))
    link = dict(scheme="hyper", rtt_ms=150, jitter_ms=10, loss=0.03, seed=7)
    one = palpate.replay(scene, motion, **link)
    same_bits(np.hstack([one.felt, one.reference]).reshape(-1, 3), numbers("felt"))
    both = palpate.replay(scene, [motion, motion], **link)
    same_bits(np.vstack([np.hstack([r.felt, r.reference]).reshape(-1, 3) for r in both]), numbers("together"))
    # The measure, from its definition (bench/fidelity/metrics.hpp), by numpy.
    felt, reference = one.felt[250:], one.reference[250:]
    error = np.sum((felt - reference) ** 2)
    snr_db = 10 * np.log10(np.sum((reference - reference.mean(axis=0)) ** 2) / error)
    assert abs(snr_db - one.snr_db) < 1e-9 * abs(snr_db), (snr_db, one.snr_db)
    assert abs(np.sqrt(error / np.sum(reference**2)) - one.rel_rms) < 1e-12
    measured = palpate.compare(one.felt, one.reference)
    assert measured["snr_db"] == one.snr_db and measured["lag_ms"] == one.lag_ms and measured["contact_ticks"] == one.contact_ticks
    assert measured["p95_error"] == one.p95_error and measured["median_error"] == one.median_error
    later = palpate.compare(one.felt, one.reference, skip=1000)
    large = np.linalg.norm(one.reference[1000:], axis=1)
    errors = np.linalg.norm(one.felt - one.reference, axis=1)[1000:] / np.where(large > 0, large, 1)
    assert abs(later["median_error"] - np.median(errors[large >= 0.1 * large.max()])) < 1e-3
    expect(palpate.InputError, "as many as reference", lambda: palpate.compare(one.felt, one.reference[1:]))
    assert len(one.felt) == len(motion.path()) and one.patches > 10
    # accuracy() plays the whole examination, which begins as `motion` does.
    reference = palpate.Reference(scene, palpate.Motion.examination(scene))
    same_bits(reference.force[: len(one.felt)], one.reference)
    shared = palpate.accuracy(scene, "port", 50, reference)
    same_bits(shared.felt[: len(one.felt)], palpate.replay(scene, motion, scheme="port", rtt_ms=50).felt)


def check_views(scene, frame):
    """Arrays are views: of the same memory at every call, read-only, valid when nothing else holds their owner."""
    patch = frame.tool().patch
    for owner, names in ((scene, ("nodes", "triangles", "masses_kg", "fixed")), (frame, ("shape",)),
                         (patch, ("stiffness", "damping", "c_static", "surface", "force"))):
        for name in names:
            array = getattr(owner, name)
            assert array.size and np.shares_memory(array, getattr(owner, name)), name
            assert not array.flags.writeable and not array.flags.owndata, name
    nodes = palpate.Scene(places.scene(SCENE)).nodes
    shape = palpate.Room(scene).step(path(scene, 1, 50)).shape
    gc.collect()
    same_bits(nodes, np.array(scene.nodes))
    assert np.isfinite(shape).all() and shape.shape == nodes.shape
    assert np.abs(patch.damping - patch.damping.T).max() < 1e-12 * np.abs(patch.damping).max()
    motion = palpate.Motion([0, 0.5, 1], [[0, 0, 0], [0, 0, 1], [0, 0, 1]])
    assert np.array_equal(motion.t_s, [0, 0.5, 1]) and abs(motion.path()[250, 2] - 0.5) < 1e-12


def check_errors(scene):
    file = places.work / "broken.json"
    file.write_text(places.scene(SCENE).read_text().replace('"tool"', '"tol"', 1))
    said = expect(palpate.InputError, "expected", lambda: palpate.Scene(file))
    program = subprocess.run([places.programs / "palpate-server", "--scene", file, "--listen", "127.0.0.1:0"], capture_output=True, text=True)
    assert program.returncode == 2 and said in program.stderr, (said, program.stderr)
    assert issubclass(palpate.InputError, ValueError)
    room = palpate.Room(scene)
    up = path(scene, 1, 5)
    expect(palpate.InputError, "path of tool 1[2]", lambda: room.step(np.where(np.arange(5)[:, None] == 2, np.nan, up)))
    expect(palpate.InputError, "shape (3)", lambda: room.step([0, 0, 0]))
    expect(palpate.InputError, "has 0 poses", lambda: room.step(np.zeros((0, 3))))
    expect(palpate.InputError, "5, as the path of the first tool", lambda: room.step({1: up, 2: up[:4]}))
    expect(palpate.InputError, "at least one", lambda: room.step({}))
    expect(palpate.InputError, "one of hold, tangent, ring, port, hyper", lambda: room.step(up, scheme="cube"))
    expect(palpate.InputError, "horizon_s", lambda: room.step(up, horizon_s=float("nan")))
    expect(palpate.InputError, "rtt_ms", lambda: palpate.replay(scene, palpate.Motion.gesture(scene, "press"), rtt_ms=-1))
    expect(palpate.InputError, "expected one of press", lambda: palpate.Motion.gesture(scene, "wave"))
    expect(palpate.InputError, "", lambda: palpate.Motion([0, 0], np.zeros((2, 3))))
    expect(TypeError, "", lambda: palpate.Room("organ"))
    expect(palpate.InputError, "path of tool 1: is no array of numbers; expected an array of the shape (n, 3)", lambda: room.step("up"))
    expect(palpate.InputError, "path of tool 2: is no array of numbers", lambda: room.step({2: [up, "up"]}))
    for key in ("a", -1, 1.5, None):
        expect(palpate.InputError, f"path: is of tool {key!r}; expected the tools 1, 2", lambda key=key: room.step({key: up}))
    assert room.t_s == 0, "a refused step moves nothing"
    assert room.step(up).t_s == 0.005
    two = room.step({1: up, 7: up + [0.01, 0, 0]})
    assert [tool.id for tool in two.tools] == [1, 7]
    expect(palpate.InputError, "tool 2", lambda: two.tool(2))


def check_threads(scene):
    """Others run while C++ computes, and rooms in threads have the bits of one alone."""
    motion = beginning(palpate.Motion.examination(scene))
    done = threading.Event()
    thread = threading.Thread(target=lambda: (palpate.Reference(scene, motion), done.set()))
    thread.start()
    turns = 0
    while not done.is_set():
        turns += 1
        time.sleep(1e-4)
    thread.join()
    assert turns > 50, turns  # with the lock held there is a turn or two before and after

    def press(results, k):
        room = palpate.Room(scene)
        results[k] = [room.step(path(scene, 1 + 20 * n, 20 + 20 * n), shape=False).tool().force for n in range(5)]

    results = {}
    threads = [threading.Thread(target=press, args=(results, k)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    press(results, "alone")
    for k in range(4):
        same_bits(np.array(results[k]), np.array(results["alone"]))


def check_types():
    """The stubs say what a program that uses them relies on; without mypy, every name in them is at least defined."""
    stubs = [places.build / "python/palpate" / file for file in ("__init__.pyi", "env.pyi")]
    for stub in stubs:
        tree = ast.parse(stub.read_text())
        defined = set(dir(builtins)) | {"self"}
        for node in ast.walk(tree):
            if isinstance(node, (ast.Import, ast.ImportFrom)):
                defined |= {(name.asname or name.name).split(".")[0] for name in node.names}
            elif isinstance(node, (ast.ClassDef, ast.FunctionDef)):
                defined.add(node.name)
            elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                defined.add(node.id)
        used = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)}
        assert used <= defined, (stub, used - defined)
    if not shutil.which("mypy"):
        print("mypy is not installed: the types were not checked")
        return
    program = places.work / "typed.py"
    program.write_text(TYPED)
    settings = ["--strict", "--allow-subclassing-any", "--no-error-summary", "--hide-error-context", "--python-executable", sys.executable, "--cache-dir", places.work / "mypy"]
    environment = {**os.environ, "MYPYPATH": str(places.build / "python")}
    checked = subprocess.run(["mypy", *settings, *stubs, program], capture_output=True, text=True, env=environment)
    lines = [int(line.split(":")[1]) for line in checked.stdout.splitlines() if "typed.py:" in line and "error" in line]
    last = len(TYPED.splitlines())
    assert lines == [last - 1, last] and checked.stdout.count("error:") == 2, checked.stdout + checked.stderr


# A program for check_types(): its last two lines are wrong, the others are right.
TYPED = """\
import numpy as np
import palpate
from palpate import env

scene = palpate.Scene("scenes/organ.json")
palpate.TaskScorer(scene).add(0.0, [0, 0, 0], np.zeros(3), True)
force: float = palpate.compare(np.zeros((3, 3)), np.zeros((3, 3)), skip=0)["median_error"]
press = env.Press("scenes/organ.json", target_n=1.0)
observation, info = press.reset(seed=1)
reward: float = press.step([0, 0, -1])[1]
env.Vector(env.Press, 8, target_n=1.0).step(np.zeros((8, 3)))[3].any()
palpate.TaskScorer(scene).add(0.0, scene, np.zeros(3), True)
env.Press(target_n="much")
"""


def posed(positions, turn, opening=None):
    """Poses of one orientation x, y, z, w."""
    columns = [positions, np.tile(turn, (len(positions), 1))] + ([] if opening is None else [np.full((len(positions), 1), opening)])
    return np.hstack(columns)


def near(torque, closed):
    """Within 0.3 %: the spring of a contact passes the sphere's centre closely, not exactly."""
    return np.abs(torque - closed).max() < 0.003 * np.abs(closed).max()


def check_instruments():
    """A sphere without friction beside the tool point: its torque is that of its force at its centre, for any orientation."""
    described = json.loads(places.scene("touch-cube").read_text())
    aside = np.array([0.012, 0.004, 0.006])
    described["tool"] = {"contact": "touch", "mu": 0, "body": {"spheres": [{"center_m": list(aside), "radius_m": 0.008}]}}
    scene = palpate.Scene.from_json(json.dumps(described), "aside", [places.scenes])
    down = scene.home - np.outer(np.arange(1, 151), [0, 0, 0.0003])
    for angle in (0, 0.5, 2):
        turn = np.array([0, 0, np.sin(angle / 2), np.cos(angle / 2)])
        cos, sin = np.cos(angle), np.sin(angle)
        centre = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]) @ aside
        room = palpate.Room(scene)
        for begin in (0, 50, 100):
            tool = room.step(posed(down[begin : begin + 50], turn)).tool()
        assert tool.force[2] > 0.1 and np.allclose(tool.orientation, turn) and tool.opening == 0
        assert near(tool.torque, np.cross(centre, tool.force)), (tool.torque, np.cross(centre, tool.force))
        forces, contact, torques = palpate.Player(tool.patch).play(posed(np.repeat(down[-1:], 20, axis=0), turn))
        assert contact.all() and near(torques, np.cross(centre, forces))
    motion = palpate.Motion(0.001 * np.arange(150), posed(down, turn))
    assert np.allclose(motion.path(), posed(down, turn)) and motion.path().shape == (150, 7)
    replayed = palpate.replay(scene, motion, rtt_ms=20)
    assert near(replayed.reference_torque, np.cross(centre, replayed.reference))
    assert np.abs(replayed.felt_torque - replayed.reference_torque)[-1].max() < 0.1 * np.abs(replayed.reference_torque[-1]).max()
    assert palpate.Motion([0, 0.01], posed(down[:2], turn, 0.5)).path().shape == (11, 8)
    expect(palpate.InputError, "orientation of path of tool 1[0]: has the length 2", lambda: room.step(posed(down[:1], [0, 0, 0, 2])))
    expect(palpate.InputError, "opening of path of tool 1[0]: is 1.5", lambda: room.step(posed(down[:1], turn, 1.5)))
    expect(palpate.InputError, "(n, 7) with an orientation", lambda: room.step(np.zeros((4, 5))))


def check_tools():
    """A tool that is asked for by name has the bits that it has where it is the scene's only one."""
    described = json.loads(places.scene("touch-cube").read_text())
    ball = {"mu": 0.5, "named": "ball", "contact_stiffness_n_m": 2000}
    alone = palpate.Scene.from_json(json.dumps(described | {"tool": ball}), "alone", [places.scenes])
    both = palpate.Scene.from_json(json.dumps(described | {"tools": [ball | {"name": "ball"}]}), "both", [places.scenes])
    down = alone.home - np.outer(np.arange(1, 101), [0, 0, 0.0003])
    by_name, only = palpate.Room(both).step(down, held={1: "ball"}).tool(), palpate.Room(alone).step(down).tool()
    assert only.force[2] > 0.1 and np.array_equal(by_name.force, only.force) and np.array_equal(by_name.torque, only.torque)
    assert not np.allclose(palpate.Room(both).step(down).tool().force, only.force, rtol=0.01)
    expect(palpate.InputError, "'probe' is no tool of", lambda: palpate.Room(both).step(down, held={1: "probe"}))


def check_documentation():
    """Every public name has a docstring and its type in the stub, and the stub has no others."""
    tree = ast.parse((places.sources / "bindings/python/palpate/__init__.pyi").read_text())
    typed = {node.name: {m.name for m in node.body if isinstance(m, ast.FunctionDef)} if isinstance(node, ast.ClassDef) else set()
             for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    assert set(typed) == set(palpate.__all__), set(typed) ^ set(palpate.__all__)
    for name in palpate.__all__:
        thing = getattr(palpate, name)
        assert vars(thing).get("__doc__") if inspect.isclass(thing) else inspect.getdoc(thing), name
        if not inspect.isclass(thing) or name == "InputError":
            continue
        members = {m for m in vars(thing) if not m.startswith("_")}
        assert members == {m for m in typed[name] if not m.startswith("_")}, (name, members ^ typed[name])
        for member in members:
            assert inspect.getdoc(getattr(thing, member)), f"{name}.{member}"


def main():
    subprocess.run([places.build / "bin/bindings_runs", places.scene(SCENE), places.work], check=True)
    scene = palpate.Scene(places.scene(SCENE))
    frame = check_press(scene)
    check_replay(scene)
    check_views(scene, frame)
    check_errors(scene)
    check_threads(scene)
    check_instruments()
    check_tools()
    check_types()
    check_documentation()
    organ = palpate.Scene.from_json(places.scene("organ").read_text(), "organ", [places.scenes])
    assert organ.contact == "touch" and len(organ.nodes) > 300
    grasp = palpate.Scene(places.scene("cube6"))
    assert grasp.contact == "attach"
    held = palpate.Room(grasp).step(path(grasp, 1, 20)).tool()
    assert held.contact and held.patch.k_port.shape == (3, 3) and held.patch.b_k.shape == (held.patch.modes, 3)


main()
