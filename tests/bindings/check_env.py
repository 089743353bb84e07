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



def single(task, seed, steps, actions, **arguments):
    """Every observation, reward and end of one environment that begins anew when it has ended."""
    env = task(**arguments)
    observation, _ = env.reset(seed=seed)
    seen = [(observation, 0.0, False, False)]
    for action in actions[:steps]:
        observation, reward, terminated, truncated, _ = env.step(action)
        if terminated or truncated:
            observation, _ = env.reset()
        seen.append((observation, reward, terminated, truncated))
    return [np.array(column) for column in zip(*seen)]


def check_vector(task, policy, steps, threads, **arguments):
    """Three environments at once have the bits of three alone, whatever ends when."""
    envs = palpate.env.Vector(task, 3, threads=threads, **arguments)
    assert envs.unwrapped is envs and envs.observation_space.shape == (3, *envs.single_observation_space.shape)
    random = np.random.default_rng(7)
    observations, infos = envs.reset(seed=5)
    seen, taken, ends = [(observations, np.zeros(3), np.zeros(3, bool), np.zeros(3, bool))], [], 0
    for _ in range(steps):
        actions = np.array([policy(row) for row in observations])
        actions[2] = random.uniform(-1, 1, actions[2].shape)  # one that wanders
        assert envs.action_space.contains(np.clip(actions, -1, 1))
        observations, rewards, terminated, truncated, infos = envs.step(actions)
        assert observations.shape == envs.observation_space.shape and not infos["failed"].any()
        ended = terminated | truncated
        if ended.any():
            ends += int(ended.sum())
            assert np.array_equal(infos["_final_obs"], ended)
            assert np.array_equal(infos["final_obs"][~ended], observations[~ended])
            assert infos["final_obs"][ended][:, :3].any() and not observations[ended][:, :6].any(), "at home again, without force"
        seen.append((observations, rewards, terminated, truncated))
        taken.append(actions)
    assert ends > 0, task
    for k in range(3):
        for column, alone_seen in enumerate(single(task, 5 + k, steps, [actions[k] for actions in taken], **arguments)):
            together = np.array([row[column][k] for row in seen])
            assert np.array_equal(together, alone_seen), (task, k, column)


check_vector(palpate.env.Press, down_to(press, 1.0), 300, 2, scene=scene)
check_vector(palpate.env.Reach, over_place, 150, 1, scene=scene)
check_vector(palpate.env.Pinch, lambda o: np.array([0, 0, np.clip(o[6] / 0.01, -0.2, 0.2)]), 260, 3, scene=palpate.Scene(places.scene("cube6")))
check_vector(palpate.env.FindLump, lambda o: np.array([0, 0, -1, 1.0 if o[3:6].any() else -1]), 40, 2)
try:
    palpate.Rooms(scene, 0)
    raise AssertionError("no error")
except palpate.InputError as error:
    assert "count: is 0" in str(error) and "1 to 4096" in str(error), error


def refused(text, call):
    try:
        call()
    except palpate.InputError as error:
        assert text in str(error), error
        return
    raise AssertionError(f"no error with {text!r}")


env, vector, cube6 = palpate.env, palpate.env.Vector(palpate.env.Press, 2, scene=places.scene("touch-cube")), palpate.Scene(places.scene("cube6"))
refused("step: is called before reset; expected reset() first", lambda: env.Press(scene).step([0, 0, 0]))
refused("step: is called before reset; expected reset() first", lambda: vector.step(np.zeros((2, 3))))
refused("count: is 0; expected 1 to 4096", lambda: env.Vector(env.Press, 0))
press.reset()
vector.reset(seed=1)
refused("action: has the shape (2,); expected (3,)", lambda: press.step([0, 0]))
refused("action: has the shape (4,); expected (3,)", lambda: press.step(np.zeros(4)))
refused("action: has the shape (3,); expected (2, 3)", lambda: vector.step(np.zeros(3)))
assert env.Press(str(places.scene("touch-cube"))).scene.name == scene.name == env.Press(places.scene("touch-cube")).scene.name
refused("cannot be read", lambda: env.Press("/no/such.json"))
refused("scene: is 5; expected a Scene, the file of one, or None", lambda: env.Press(5))
refused("target_n: is -1; expected more than 0", lambda: env.Press(scene, target_n=-1))
refused("hold_s: is nan; expected 0 or more", lambda: env.Press(scene, hold_s=float("nan")))
refused("step_s: is 0; expected 0.001 to 1", lambda: env.Reach(scene, step_s=0))
for task in (env.Press, env.Reach, env.FindLump):
    refused('"cube6": is grasped; expected one that is touched', lambda task=task: task(cube6))
refused('has the task "press"; expected "find"', lambda: env.FindLump(places.scene("tasks/press")))
rooms = palpate.Rooms(scene, 2, threads=2)
for bad, text in (((np.zeros((3, 3)), np.zeros((2, 3)), 20), "positions: has 3 rows"), ((np.zeros((2, 3)), np.full((2, 3), 20.0), 20), "leaves the world"),
                  ((np.zeros((2, 3)), np.zeros((2, 3)), 0), "ticks: is 0")):
    try:
        rooms.step(*bad)
        raise AssertionError("no error")
    except palpate.InputError as error:
        assert text in str(error), error

try:
    palpate.env.find_scene("no-such-scene")
    raise AssertionError("no error")
except palpate.InputError as error:
    assert "palpate-data" in str(error)
