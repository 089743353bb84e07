"""The environments of palpate.env: the shapes and promises of Gymnasium's interface, and that a simple policy reaches each goal.

usage: check_env.py SOURCES BUILD WORK
"""

import sys
import threading

import numpy as np
from running import Places

places = Places()
sys.modules["gymnasium"] = None  # as where it is not installed
import palpate  # noqa: E402  (after the path is set)
import palpate.env  # noqa: E402

scene = palpate.Scene(places.scene("touch-cube"))


def down_to(env, force_n):
    """A policy: down fast without contact, then by the error of the force."""

    def act(observation):
        error = force_n - np.linalg.norm(observation[3:6])
        return np.array([0, 0, -1.0 if not observation[3:6].any() else np.clip(-0.5 * error, -1, 1)])

    return act


def over_place(observation):
    """A policy: aside to the place above the body, then down."""
    aside = observation[6:8] - observation[:2]
    return np.array([*np.clip(aside / 0.002, -1, 1), -1.0 if np.abs(aside).max() < 0.002 else 0.0])


def episode(env, policy, seed):
    observation, info = env.reset(seed=seed)
    seen, total, terminated, truncated = [observation], 0.0, False, False
    assert env.observation_space.contains(observation) and info == {}
    while not (terminated or truncated):
        action = policy(observation)
        assert env.action_space.contains(action), action
        observation, reward, terminated, truncated, info = env.step(action)
        assert env.observation_space.contains(observation) and np.isfinite(observation).all()
        assert type(reward) is float and type(terminated) is bool and type(truncated) is bool and not info["failed"]
        seen.append(observation)
        total += reward
    return np.array(seen), total, terminated


def check(env, policy, *arguments):
    first, reward, reached = episode(env, policy, seed=3)
    assert reached, (type(env), first[-1])
    assert env.unwrapped is env
    again, same_reward, _ = episode(env, policy, seed=3)
    assert np.array_equal(first, again) and reward == same_reward, "a seed repeats an episode, on a body that was used"
    other = type(env)(*arguments)
    assert np.array_equal(first, episode(other, policy, seed=3)[0]), "and in another environment"
    idle, _, reached = episode(env, lambda observation: np.zeros(env.action_space.shape), seed=3)
    assert not reached and len(idle) == env.max_steps + 1, "a hand that rests succeeds at nothing"


press, reach = palpate.env.Press(scene, target_n=1.0), palpate.env.Reach(scene)
check(press, down_to(press, 1.0), scene)
check(reach, over_place, scene)


class Searcher:
    """A policy for FindLump: presses by 6 mm on a grid of nine places, goes to the centre of the forces beyond the median, and marks.

    A callable that sees an observation at home begins anew.
    """

    def __call__(self, observation):
        tool, force = observation[:3], observation[3:6]
        if not tool.any():
            self.places = [np.array([x, y]) * 0.016 for x in (-1, 0, 1) for y in (-1, 0, 1)]
            self.felt, self.down = [], False
        deep = -0.026  # the top is 20 mm below home
        if len(self.felt) < len(self.places):
            target = self.places[len(self.felt)]
        else:
            excess = np.maximum(np.array(self.felt) - np.median(self.felt), 0)
            target = (excess[:, None] * np.array(self.places)).sum(axis=0) / max(excess.sum(), 1e-9)
        aside = target - tool[:2]
        if np.abs(aside).max() > 1e-4:  # above the body, then aside
            return np.array([*(np.clip(aside / 0.002, -1, 1) if tool[2] > -0.0181 else (0, 0)), 1.0 if tool[2] < -0.0181 else 0.0, -1])
        if tool[2] > deep + 1e-4:
            return np.array([0, 0, np.clip((deep - tool[2]) / 0.002, -1, 1), -1])
        if len(self.felt) < len(self.places):
            self.felt.append(np.linalg.norm(force))
            return np.array([0, 0, 1, -1.0])
        return np.array([0, 0, 0, 1.0])


find = palpate.env.FindLump()
check(find, Searcher())
scores = [episode(find, Searcher(), seed=seed)[1] for seed in range(4)]
assert np.mean(scores) > 0.8, scores
assert episode(palpate.env.FindLump(palpate.Scene(places.scene("tasks/find"))), lambda o: np.array([0, 0, -1, 1.0 if o[3:6].any() else -1]), seed=1)[1] < 1
pinch = palpate.env.Pinch(palpate.Scene(places.scene("cube6")))
check(pinch, lambda observation: np.array([0, 0, np.clip(observation[6] / 0.01, -0.2, 0.2)]), palpate.Scene(places.scene("cube6")))
torn, reward, ended = episode(pinch, lambda observation: np.array([0, 0, 1.0]), seed=3)
assert ended and len(torn) < 40 and reward < -1, (len(torn), reward)
for wrong in (lambda: palpate.env.FindLump(scene), lambda: palpate.env.Pinch(scene)):
    try:
        wrong()
        raise AssertionError("no error")
    except palpate.InputError as error:
        assert "expected" in str(error)
places_drawn = {tuple(reach.reset(seed=seed)[0][6:8]) for seed in range(5)}
assert len(places_drawn) == 5
sample = press.action_space.sample()
assert press.action_space.contains(sample) and not press.action_space.contains([0, 0, 1.5])
press.action_space.seed(1)

alone = episode(palpate.env.Press(scene), down_to(press, 1.0), seed=1)[0]
results = {}
threads = [threading.Thread(target=lambda k=k: results.update({k: episode(palpate.env.Press(scene), down_to(press, 1.0), seed=1)[0]})) for k in range(8)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()
assert len(results) == 8 and all(np.array_equal(alone, seen) for seen in results.values()), "eight in threads are eight alone"

try:
    palpate.env.find_scene("no-such-scene")
    raise AssertionError("no error")
except palpate.InputError as error:
    assert "palpate-data" in str(error)
