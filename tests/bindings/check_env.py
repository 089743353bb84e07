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


def check(env, policy):
    first, reward, reached = episode(env, policy, seed=3)
    assert reached, (type(env), first[-1])
    assert env.unwrapped is env
    again, same_reward, _ = episode(env, policy, seed=3)
    assert np.array_equal(first, again) and reward == same_reward, "a seed repeats an episode, on a body that was used"
    other = type(env)(scene)
    assert np.array_equal(first, episode(other, policy, seed=3)[0]), "and in another environment"
    idle, _, reached = episode(env, lambda observation: np.zeros(3), seed=3)
    assert not reached and len(idle) == env.max_steps + 1, "a hand that rests succeeds at nothing"


press, reach = palpate.env.Press(scene, target_n=1.0), palpate.env.Reach(scene)
check(press, down_to(press, 1.0))
check(reach, over_place)
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
