"""A Python program as a station of a real server, and the recordings of both.

usage: check_client.py SOURCES BUILD WORK
"""

import time

import numpy as np
from running import Places, serving

places = Places()
import palpate  # noqa: E402  (after the path is set)

PATIENCE_S = 120
STROKE_M = 0.01


def raised(error, call):
    try:
        call()
    except error as told:
        return str(told)
    raise AssertionError(f"no {error.__name__}")


def tries(what):
    """Counts from 1, while there is patience: on a busy machine a frame comes so late that a hand feels nothing, and a viewer sees an older body."""
    end, count = time.monotonic() + PATIENCE_S, 0
    while time.monotonic() < end:
        yield (count := count + 1)
    raise AssertionError(what)


def press(client):
    """10 mm up in 0.5 s, held for 0.5 s, and back, until the body pulls the tool back down: the path, and how often it took."""
    up = np.concatenate([np.linspace(0, STROKE_M, 500), np.full(500, STROKE_M), np.linspace(STROKE_M, 0, 500)])
    path = client.home + np.outer(up, [0, 0, 1])
    for count in tries("the hand feels nothing"):
        felt = client.follow(path)
        assert felt.force.shape == path.shape and np.isfinite(felt.force).all()
        if felt.force[500:1000, 2].min() < -0.1:
            return path, count


def watch(address, client):
    """A viewer beside the hand sees the body that it pulls at."""
    viewer = palpate.Viewer(address)
    viewer.wait(20)
    path = client.home + np.outer(np.linspace(0, STROKE_M, 500), [0, 0, 1])
    client.follow(path)
    body = palpate.Scene(places.scene("cube6"))
    assert viewer.scene == "cube6" and viewer.triangles.shape == body.triangles.shape
    for _ in tries("the viewer does not see the body pulled"):
        client.follow(path[-1:].repeat(50, axis=0))
        view = viewer.update(0.3)
        if not view or not view.tools:
            continue
        assert view.positions.shape == viewer.rest.shape and view.positions.dtype == np.float32 and not view.positions.flags.owndata
        [tool] = view.tools
        moved = np.linalg.norm(view.positions - viewer.rest, axis=1).max()
        assert tool.station == "arm" and moved < 0.02, (tool.station, moved)
        if moved > 0.003 and tool.contact and abs(tool.position[2] - client.home[2] - STROKE_M) < 0.003 and tool.force[2] < 0:
            break
    kept = view.positions.copy()
    viewer.update(0.1)
    assert np.array_equal(kept, view.positions), "a view that was returned stays"


def check_session():
    file = places.work / "room.rec"
    file.unlink(missing_ok=True)
    with serving(places, "cube6", "--record", file) as address:
        with palpate.Client(address, "arm", scheme="port") as client:
            client.wait(20)
            status = client.status
            assert status["link"] == "joined" and status["station"] == "arm" and status["fault"] == "", status
            assert np.allclose(client.home, palpate.Scene(places.scene("cube6")).home)
            for _ in tries("no patch comes"):
                if client.follow(np.repeat(client.home[None], 5, axis=0)).has_patch[-1]:
                    break
            path, presses = press(client)
            watch(address, client)
            before = client.tick(path[-1])
            assert before.has_patch and before.force.shape == (3,)
            nowhere = client.tick([np.nan, 0, 0])
            assert np.isfinite(nowhere.force).all()
        refused = raised(RuntimeError, lambda: palpate.Client(address, tool="scalpel").wait(20))
        assert 'no tool "scalpel" in this scene' in refused, refused
        assert raised(RuntimeError, lambda: palpate.Client(address, room="attic").wait(20)).startswith(f"{address} refuses the station")
    recording = palpate.Recording(file)
    assert recording.kind == "room" and recording.complete and recording.blocks_lost == 0, recording.damage
    hand = recording.hand("arm")
    assert [h.name for h in recording.hands] == ["arm"]
    assert np.all(np.diff(hand.t_s) > 0) and np.all(np.diff(hand.force_t_s) > 0)
    deepest = hand.positions[:, 2].max() - client.home[2]
    assert abs(deepest - STROKE_M) < 1e-6, deepest
    assert hand.forces[:, 2].min() < -0.1 and hand.contact.any()
    metrics = hand.metrics(threshold_n=0.2)
    assert metrics["force_peak_n"] == np.linalg.norm(hand.forces, axis=1).max() and metrics["overs"] >= 1, metrics
    assert abs(metrics["duration_s"] - np.ptp(hand.t_s)) < 1e-9 and abs(metrics["path_m"] / STROKE_M - 2 * (presses + 1)) < 2, metrics  # with the viewer's, and back
    assert "threshold_n" in raised(palpate.InputError, lambda: hand.metrics(0))
    assert palpate.Scene.from_json(recording.scene_json).name == "cube6"
    assert recording.shape_at(recording.duration_s).shape[1] == 3 and recording.triangles.max() < len(recording.shape_at(recording.duration_s))
    assert recording.shape_at(-1) is None
    assert "expected one of arm" in raised(palpate.InputError, lambda: recording.hand("leg"))
    assert "expected" in raised(palpate.InputError, lambda: palpate.Recording(places.scene("cube6")))
    [motion] = recording.motions("arm")
    replayed = palpate.replay(palpate.Scene(places.scene("cube6")), motion, rtt_ms=50)
    assert replayed.snr_db > 20, replayed.snr_db


def check_nobody():
    client = palpate.Client("127.0.0.1:9")
    assert raised(RuntimeError, lambda: client.wait(1.0)) == "nothing listens at 127.0.0.1:9"
    assert np.all(client.tick([0, 0, 0]).force == 0)
    client.leave()
    assert raised(RuntimeError, lambda: palpate.Viewer("127.0.0.1:9").wait(0.5)) == "nothing listens at 127.0.0.1:9"
    raised(palpate.InputError, lambda: palpate.Client("nowhere"))
    raised(palpate.InputError, lambda: palpate.Client("127.0.0.1:9", key=str(places.work / "none.key")))
    raised(palpate.InputError, lambda: palpate.Client("127.0.0.1:9", scheme="cube"))


check_session()
check_nobody()
