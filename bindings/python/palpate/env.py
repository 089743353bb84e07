"""Tasks for a learning program, shaped as Gymnasium has them, on a body in this process.

    env = Press(target_n=1.0)
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

An action moves the tool: (3,), each from -1 to 1, times max_speed * step_s metres along x, y, z; FindLump adds a button. A step of the
body is step_s long; its force is the full model's at the end. Episodes end in success (terminated) or after max_steps (truncated). One environment is for
one thread at a time; several in several threads run side by side.

Many at once, stepped by threads of C++ with one call:

    envs = Vector(Press, 8, target_n=1.0)
    observations, infos = envs.reset(seed=1)
    observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())

With gymnasium installed these are gymnasium.Env and gymnasium.vector.VectorEnv, and their spaces gymnasium.spaces.Box. Without it, Box
below has what they need.
"""

import concurrent.futures
import json
import os
import pathlib

import numpy as np

from . import InputError, Room, Rooms, Scene, TaskScorer

try:
    import gymnasium

    Base, Box, VectorBase = gymnasium.Env, gymnasium.spaces.Box, gymnasium.vector.VectorEnv
    _modes = getattr(gymnasium.vector, "AutoresetMode", None)  # from 1.1 on
    AUTORESET = {"autoreset_mode": _modes.SAME_STEP} if _modes else {}
except ImportError:

    class Base:
        """What gymnasium.Env gives an environment, as far as these use it."""

        metadata = {"render_modes": []}
        np_random = None

        def reset(self, *, seed=None, options=None):
            if seed is not None or self.np_random is None:
                self.np_random = np.random.default_rng(seed)

        def close(self):
            pass

        @property
        def unwrapped(self):
            return self

    AUTORESET = {}

    class VectorBase:
        """What gymnasium.vector.VectorEnv gives, as far as Vector uses it."""

        metadata = {}

        def close(self, **arguments):
            pass

        @property
        def unwrapped(self):
            return self

    class Box:
        """A box of numbers, low to high, of one shape."""

        def __init__(self, low, high, shape, dtype=np.float64):
            self.shape, self.dtype = tuple(shape), np.dtype(dtype)
            self.low, self.high = np.full(shape, low, dtype), np.full(shape, high, dtype)
            self._least = np.clip(self.low, -1e6, None)
            self._width = np.clip(self.high, None, 1e6) - self._least
            self._random = np.random.default_rng()

        def seed(self, seed=None):
            self._random = np.random.default_rng(seed)

        def sample(self):
            return (self._least + self._width * self._random.random(self.shape)).astype(self.dtype, copy=False)

        def contains(self, x):
            x = np.asarray(x)
            return x.shape == self.shape and bool(np.all(x >= self.low) and np.all(x <= self.high))


MOST_ROOMS = 4096  # of Rooms
SCENES = [pathlib.Path("scenes"), pathlib.Path("/usr/share/palpate/scenes")]


def find_scene(name):
    """Returns the file of a scene that ships, by name: in ./scenes or where the package palpate-data puts it. Raises InputError."""
    for folder in SCENES:
        if (folder / f"{name}.json").is_file():
            return folder / f"{name}.json"
    raise InputError(f'scene "{name}": is in neither of {", ".join(map(str, SCENES))}; expected the package palpate-data, or a Scene')


def check(name, value, least, most=np.inf, above=-np.inf):
    """Raises InputError unless the number is finite, from least to most, and larger than `above`."""
    if not (np.isfinite(value) and least <= value <= most and value > above):
        bound = f"more than {above:g}" if above > -np.inf else f"{least:g} or more" if most == np.inf else f"{least:g} to {most:g}"
        raise InputError(f"{name}: is {value}; expected {bound}")


def norm(vectors):
    """Returns the length of x, y, z, numbers or arrays, with the same bits for both."""
    x, y, z = vectors
    return np.sqrt(x * x + y * y + z * z)


def scene_of(given, usual):
    """Returns the Scene that was given, as such or as a file; for None the one that ships under the name `usual`."""
    if given is None:
        return Scene(find_scene(usual))
    if isinstance(given, (str, os.PathLike)):
        return Scene(given)
    if not isinstance(given, Scene):
        raise InputError(f"scene: is {given!r}; expected a Scene, the file of one, or None")
    return given


def action_of(given, space):
    """Returns an action as an array. Raises InputError for another shape than the space has."""
    action = np.asarray(given, np.float64)
    if action.shape != space.shape:
        raise InputError(f"action: has the shape {action.shape}; expected {space.shape}")
    return action


class Touch(Base):
    """A tool on a body. Tasks add a target, a reward and an end.

    scene: a Scene, the file of one, or None for touch-cube. step_s: time of a step, 0.001 to 1 [s]. max_speed: of the tool [m/s].
    Observation: tool - scene.home (3,) [m], force on the tool (3,) [N], and the task's own numbers.
    """

    extra = 0  # numbers of the task
    # Names of what begin() sets, where numbers() and judge() also hold for arrays, of environments of one scene: Vector calls them once.
    drawn = None
    grasp = None  # "touch" or "attach": the contact of the scene that the task is about; None: either

    def __init__(self, scene=None, *, step_s=0.02, max_speed=0.1, max_steps=250):
        check("step_s", step_s, 0.001, 1)
        check("max_speed", max_speed, 0, above=0)
        check("max_steps", max_steps, 1)
        self.scene = scene_of(scene, "touch-cube")
        if self.grasp not in (None, self.scene.contact):
            is_so, expected = ("touched", "grasped (attach)") if self.grasp == "attach" else ("grasped", "touched (touch)")
            raise InputError(f'scene "{self.scene.name}": is {is_so}; expected one that is {expected}')
        self.step_s, self.max_speed, self.max_steps = step_s, max_speed, max_steps
        self._room, self._scene = None, None  # the body, and its scene
        self._ticks = int(round(1e3 * step_s))
        self._share = (np.arange(1, self._ticks + 1) / self._ticks)[:, None]
        self.action_space = Box(-1.0, 1.0, shape=(3,), dtype=np.float64)
        self.observation_space = Box(-np.inf, np.inf, shape=(6 + self.extra,), dtype=np.float64)

    def reset(self, *, seed=None, options=None):
        """Takes a body at rest, with the tool at scene.home; draws the task's numbers. Returns (observation, info)."""
        super().reset(seed=seed)
        self.place_at_home(options)
        if self.scene is self._scene:
            self._room.renew()
        else:
            self._room, self._scene = Room(self.scene), self.scene
        return self.observation(), {}

    def place_at_home(self, options):
        """Draws scene and task of an episode, and puts the tool at scene.home."""
        self.scene = self.drawn_scene()
        self._home = np.array(self.scene.home)
        self._top = self._home - [0, 0, 0.02]
        self.tool, self.force, self.force_n, self.contact, self.steps = np.array(self._home), np.zeros(3), 0.0, False, 0
        self.begin(options or {})

    def step(self, action):
        """Moves the tool and the body. Returns (observation, reward, terminated, truncated, info)."""
        if self._room is None:
            raise InputError("step: is called before reset; expected reset() first")
        action = action_of(action, self.action_space)
        self.heed(action)
        by = np.minimum(np.maximum(action[:3], -1.0), 1.0) * (self.max_speed * self.step_s)
        frame = self._room.step(self.tool + self._share * by, patches=False, shape=False)
        self.tool = self.tool + by
        tool = frame.tool()
        self.force, self.contact = tool.force.copy(), tool.contact
        self.force_n = norm(self.force)
        self.steps += 1
        reward, done = self.judge()
        return self.observation(), float(reward), bool(done), self.steps >= self.max_steps, {"failed": frame.failed}

    def observation(self):
        observation = np.empty(6 + self.extra)
        observation[:3] = self.tool - self._home
        observation[3:6] = self.force
        observation[6:] = self.numbers()
        return observation

    def drawn_scene(self):
        """Returns the scene of the next episode."""
        return self.scene

    def begin(self, options):
        """Draws what the task needs, from self.np_random."""

    def heed(self, action):
        """Takes from an action what is not motion."""

    def numbers(self):
        """The task's part of the observation: `extra` numbers. Reads tool and force, (3,), force_n, contact, steps."""
        return ()

    def judge(self):
        """Returns reward and success of the step that just ended."""
        raise NotImplementedError


class Reach(Touch):
    """Touch the top of the body within 5 mm of a drawn place, seen from above.

    Numbers: the place - scene.home, (2,) [m]. Reward: minus the distance of the tool from the place [m]; 1 more at the end.
    """

    extra = 2
    drawn = ("place",)
    grasp = "touch"

    def begin(self, options):
        reach = 0.15 * np.ptp(self.scene.nodes[:, :2], axis=0)
        self.place = self._top[:2] + self.np_random.uniform(-reach, reach)

    def numbers(self):
        return self.place[0] - self._home[0], self.place[1] - self._home[1]

    def judge(self):
        away = np.hypot(self.tool[0] - self.place[0], self.tool[1] - self.place[1])
        done = (away < 0.005) & (self.force_n > 0)
        return -np.hypot(away, np.maximum(self.tool[2] - self._top[2], 0)) + done, done


class Press(Touch):
    """Press until the force is within a tenth of target_n for hold_s.

    Numbers: target_n - |force|, (1,) [N]. Reward: minus that error over target_n; 1 more at the end.
    """

    extra = 1
    drawn = ("_held",)
    grasp = "touch"

    def __init__(self, scene=None, *, target_n=1.0, hold_s=0.2, **touch):
        check("target_n", target_n, 0, above=0)
        check("hold_s", hold_s, 0)
        super().__init__(scene, **touch)
        self.target_n, self.hold_s = target_n, hold_s

    def begin(self, options):
        self._held = 0

    def numbers(self):
        return (self.target_n - self.force_n,)

    def judge(self):
        error = abs(self.target_n - self.force_n) / self.target_n
        self._held = (self._held + 1) * (error < 0.1)
        done = self._held * self.step_s >= self.hold_s
        return -error + done, done


class FindLump(Touch):
    """Mark the lump in a block of 8 x 8 x 4 cm, whose place each reset draws anew.

    Action: (4,), the motion of the tool, and the button, down above 0. The first press of it while touching is the mark and ends the
    episode (terminated); its reward is the score of the task over 100, all others are 0. A scene with a task `find` has its own lump.
    """

    grasp = "touch"

    def __init__(self, scene=None, *, max_steps=500, **touch):
        super().__init__(scene if scene is not None else self._block(0.0, 0.0), max_steps=max_steps, **touch)
        self._own = self.scene if scene is not None else None
        kind = TaskScorer(self.scene).kind  # raises for a scene without a task
        if kind != "find":
            raise InputError(f'scene "{self.scene.name}": has the task "{kind}"; expected "find"')
        self.action_space = Box(-1.0, 1.0, shape=(4,), dtype=np.float64)

    @staticmethod
    def _block(x, y):
        return Scene.from_json(json.dumps({
            "name": "block with a lump",
            "body": {
                "lattice": {"nodes": [11, 11, 6], "size_m": [0.08, 0.08, 0.04], "origin_m": [-0.04, -0.04, 0],
                            "fixed_faces": ["z-"], "solid": {"young_pa": 5000}},
                "lump": {"center_m": [x, y, 0.024], "radius_m": 0.01, "stiffness_ratio": 20}},
            "tool": {"contact": "touch", "radius_m": 0.01},
            "task": {"find": {}}}))

    def drawn_scene(self):
        return self._own if self._own is not None else self._block(*map(float, self.np_random.uniform(-0.02, 0.02, 2)))

    def begin(self, options):
        self._scorer = TaskScorer(self.scene)

    def heed(self, action):
        self._down = bool(action[3] > 0)

    def judge(self):
        self._scorer.add(self.steps * self.step_s, self.tool, self.force, self.contact, int(self._down))
        done = self._scorer.done >= 1
        return self._scorer.score / 100 if done else 0.0, done


class Pinch(Touch):
    """Lift the pinched node by a drawn height, within 0.5 mm for hold_s, with at most most_n.

    The body's grasp holds a node and cannot slip; a larger force ends the episode (terminated), with a reward of -1.
    Numbers: the height that is missing, (1,) [m]. Reward: minus its size over the drawn height; 1 more at the end.
    """

    extra = 1
    drawn = ("height", "_held")
    grasp = "attach"

    def __init__(self, scene=None, *, most_n=2.0, hold_s=0.2, **touch):
        check("most_n", most_n, 0, above=0)
        check("hold_s", hold_s, 0)
        super().__init__(scene_of(scene, "cube6"), **touch)
        self.most_n, self.hold_s = most_n, hold_s

    def begin(self, options):
        self.height, self._held = float(self.np_random.uniform(0.003, 0.01)), 0

    def numbers(self):
        return (self.height - (self.tool[2] - self._home[2]),)

    def judge(self):
        torn = self.force_n > self.most_n
        missing = abs(self.numbers()[0])
        self._held = (self._held + 1) * (missing < 0.0005)
        done = self._held * self.step_s >= self.hold_s
        return np.where(torn, -1.0, -missing / self.height + done), torn | done


class Vector(VectorBase):
    """`count` environments of one task, with the shapes of gymnasium.vector.VectorEnv; their bodies are stepped together by threads of C++.

    Vector(Press, 8, target_n=1.0) is eight times Press(target_n=1.0); scene=... and all else is passed on. threads=0: one a processor.
    Environment k has the bits of a single one with the same seed: reset(seed=s) gives it the seed s + k, a list gives each its own.
    One that ends begins anew in the same step: its observation is that of the new episode, infos["final_obs"] has the last one of the old,
    where infos["_final_obs"] is True.
    """

    metadata = AUTORESET

    def __init__(self, task, count, *, threads=0, **arguments):
        check("count", count, 1, MOST_ROOMS)
        if isinstance(arguments.get("scene"), (str, os.PathLike)):
            arguments["scene"] = Scene(arguments["scene"])  # one for all
        self.envs = [task(**arguments) for _ in range(count)]
        self._all = task(**arguments)  # holds what numbers() and judge() read, of all environments
        one = self.envs[0]
        self.num_envs, self.single_action_space, self.single_observation_space = count, one.action_space, one.observation_space
        self.action_space = Box(-1.0, 1.0, shape=(count, *one.action_space.shape), dtype=np.float64)
        self.observation_space = Box(-np.inf, np.inf, shape=(count, *one.observation_space.shape), dtype=np.float64)
        self._rooms, self._ticks = Rooms(one.scene, count, threads), int(round(1e3 * one.step_s))
        self._makers = concurrent.futures.ThreadPoolExecutor(self._rooms.threads)
        self.tool, self.force = np.zeros((count, 3)), np.zeros((count, 3))
        self.contact, self.steps = np.zeros(count, bool), np.zeros(count, int)
        self._home, self._scenes = np.zeros((count, 3)), [one.scene] * count
        self._begun = False

    def reset(self, *, seed=None, options=None):
        """Begins an episode in every environment. Returns (observations, infos)."""
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed or [None] * self.num_envs
        self._begin(range(self.num_envs), seeds, options)
        self._begun = True
        return self._observations(), {}

    def step(self, actions):
        """Moves all tools and bodies. Returns (observations, rewards, terminated, truncated, infos), one row or number each."""
        if not self._begun:
            raise InputError("step: is called before reset; expected reset() first")
        actions, all = action_of(actions, self.action_space), self._all
        by = np.minimum(np.maximum(actions[:, :3], -1.0), 1.0) * (all.max_speed * all.step_s)
        self.force, self.contact, failed = self._rooms.step(self.tool, by, self._ticks)
        self.tool = self.tool + by
        self.steps += 1
        self._show_all()
        rewards, terminated = self._judge(actions)
        truncated = self.steps >= all.max_steps
        observations, infos = self._observations(), {"failed": failed}
        ended = terminated | truncated
        if ended.any():
            infos["final_obs"], infos["_final_obs"] = observations.copy(), ended
            self._begin(np.flatnonzero(ended), [None] * self.num_envs, None)
            observations = self._observations()
        return observations, rewards, terminated, truncated, infos

    def _begin(self, which, seeds, options):
        """Begins an episode in these environments: each draws what it needs as it does alone; their bodies are made side by side."""
        for k in which:
            self._draw(k, seeds[k], options)
        list(self._makers.map(self._renew, which))
        self._show_all()

    def _renew(self, k):
        scene = self.envs[k].scene
        self._rooms.renew(k, None if scene is self._scenes[k] else scene)
        self._scenes[k] = scene

    def _draw(self, k, seed, options):
        env = self.envs[k]
        Base.reset(env, seed=seed)
        env.place_at_home(options)
        self.tool[k], self._home[k] = env.tool, env._home
        self.force[k], self.contact[k], self.steps[k] = 0.0, False, 0
        for name in env.drawn or ():
            value = np.asarray(getattr(env, name))
            if not hasattr(self._all, name) or np.shape(getattr(self._all, name))[-1:] != (self.num_envs,):
                setattr(self._all, name, np.zeros((*value.shape, self.num_envs), value.dtype))
            getattr(self._all, name)[..., k] = value
        self._all._home, self._all._top = env._home, env._top

    def _show_all(self):
        """Gives the task of all environments what it reads: x, y, z by rows, an environment a column."""
        all = self._all
        all.tool, all.force, all.contact, all.steps = self.tool.T, self.force.T, self.contact, self.steps
        all.force_n = norm(all.force)

    def _show_one(self, k):
        env = self.envs[k]
        env.tool, env.force, env.contact, env.steps = self.tool[k].copy(), self.force[k].copy(), bool(self.contact[k]), int(self.steps[k])
        env.force_n = norm(env.force)
        return env

    def _judge(self, actions):
        if self._all.drawn is not None:
            rewards, terminated = self._all.judge()
            return np.asarray(rewards, np.float64), np.asarray(terminated, bool)
        judged = []
        for k, action in enumerate(actions):
            env = self._show_one(k)
            env.heed(action)
            judged.append(env.judge())
        rewards, terminated = zip(*judged)
        return np.array(rewards, np.float64), np.array(terminated, bool)

    def _observations(self):
        observations = np.empty((self.num_envs, 6 + self._all.extra))
        observations[:, :3] = self.tool - self._home
        observations[:, 3:6] = self.force
        if self._all.drawn is None:
            for k in range(self.num_envs):
                observations[k, 6:] = self._show_one(k).numbers()
        elif self._all.extra:
            observations[:, 6:] = np.transpose(self._all.numbers())
        return observations
