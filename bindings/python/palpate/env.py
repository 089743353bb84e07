"""Tasks for a learning program, shaped as Gymnasium has them, on a body in this process.

    env = Press(target_n=1.0)
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())

An action moves the tool: (3,), each from -1 to 1, times max_speed * step_s metres along x, y, z; FindLump adds a button. A step of the
body is step_s long; its force is the full model's at the end. Episodes end in success (terminated) or after max_steps (truncated). One environment is for
one thread at a time; several in several threads run side by side.

With gymnasium installed these are gymnasium.Env and their spaces gymnasium.spaces.Box. Without it, Box below has what they need.
"""

import json
import math
import pathlib

import numpy as np

from . import InputError, Room, Scene, TaskScorer

try:
    import gymnasium

    Base, Box = gymnasium.Env, gymnasium.spaces.Box
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

    class Box:
        """A box of numbers, low to high, of one shape."""

        def __init__(self, low, high, shape, dtype=np.float64):
            self.shape, self.dtype = tuple(shape), np.dtype(dtype)
            self.low, self.high = np.full(shape, low, dtype), np.full(shape, high, dtype)
            self._random = np.random.default_rng()

        def seed(self, seed=None):
            self._random = np.random.default_rng(seed)

        def sample(self):
            return self._random.uniform(np.maximum(self.low, -1e6), np.minimum(self.high, 1e6)).astype(self.dtype)

        def contains(self, x):
            x = np.asarray(x)
            return x.shape == self.shape and bool(np.all(x >= self.low) and np.all(x <= self.high))


SCENES = [pathlib.Path("scenes"), pathlib.Path("/usr/share/palpate/scenes")]


def find_scene(name):
    """Returns the file of a scene that ships, by name: in ./scenes or where the package palpate-data puts it. Raises InputError."""
    for folder in SCENES:
        if (folder / f"{name}.json").is_file():
            return folder / f"{name}.json"
    raise InputError(f'scene "{name}": is in neither of {", ".join(map(str, SCENES))}; expected the package palpate-data, or a Scene')


class Touch(Base):
    """A tool on a body. Tasks add a target, a reward and an end.

    Observation: tool - scene.home (3,) [m], force on the tool (3,) [N], and the task's own numbers.
    """

    extra = 0  # numbers of the task

    def __init__(self, scene=None, *, step_s=0.02, max_speed=0.1, max_steps=250):
        self.scene = scene if scene is not None else Scene(find_scene("touch-cube"))
        self.step_s, self.max_speed, self.max_steps = step_s, max_speed, max_steps
        self._ticks = int(round(1e3 * step_s))
        self._share = (np.arange(1, self._ticks + 1) / self._ticks)[:, None]
        self.action_space = Box(-1.0, 1.0, shape=(3,), dtype=np.float64)
        self.observation_space = Box(-np.inf, np.inf, shape=(6 + self.extra,), dtype=np.float64)

    def reset(self, *, seed=None, options=None):
        """Takes a body at rest, with the tool at scene.home; draws the task's numbers. Returns (observation, info)."""
        super().reset(seed=seed)
        self.scene = self.drawn_scene()
        self._home = np.array(self.scene.home)
        self._top = self._home - [0, 0, 0.02]
        self._room = Room(self.scene)  # a body that was used and reset differs from it in the last digits
        self.tool, self.force, self.force_n, self.contact, self.steps = np.array(self._home), np.zeros(3), 0.0, False, 0
        self.begin(options or {})
        return self.observation(), {}

    def step(self, action):
        """Moves the tool and the body. Returns (observation, reward, terminated, truncated, info)."""
        by = np.minimum(np.maximum(action, -1.0), 1.0) * (self.max_speed * self.step_s)
        frame = self._room.step(self.tool + self._share * by, patches=False, shape=False)
        self.tool = self.tool + by
        tool = frame.tool()
        self.force, self.contact = tool.force.copy(), tool.contact
        self.force_n = math.sqrt(self.force @ self.force)
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

    def numbers(self):
        """The task's part of the observation: `extra` numbers."""
        return ()

    def judge(self):
        """Returns reward and success of the step that just ended."""
        raise NotImplementedError


class Reach(Touch):
    """Touch the top of the body within 5 mm of a drawn place, seen from above.

    Numbers: the place - scene.home, (2,) [m]. Reward: minus the distance of the tool from the place [m]; 1 more at the end.
    """

    extra = 2

    def begin(self, options):
        reach = 0.15 * np.ptp(self.scene.nodes[:, :2], axis=0)
        self.place = self._top[:2] + self.np_random.uniform(-reach, reach)

    def numbers(self):
        return self.place - self._home[:2]

    def judge(self):
        away = math.dist(self.tool[:2], self.place)
        done = away < 0.005 and self.force_n > 0
        return -math.hypot(away, max(self.tool[2] - self._top[2], 0)) + done, done


class Press(Touch):
    """Press until the force is within a tenth of target_n for hold_s.

    Numbers: target_n - |force|, (1,) [N]. Reward: minus that error over target_n; 1 more at the end.
    """

    extra = 1

    def __init__(self, scene=None, *, target_n=1.0, hold_s=0.2, **touch):
        super().__init__(scene, **touch)
        self.target_n, self.hold_s = target_n, hold_s

    def begin(self, options):
        self._held = 0

    def numbers(self):
        return (self.target_n - self.force_n,)

    def judge(self):
        error = abs(self.target_n - self.force_n) / self.target_n
        self._held = self._held + 1 if error < 0.1 else 0
        done = self._held * self.step_s >= self.hold_s
        return -error + done, done


class FindLump(Touch):
    """Mark the lump in a block of 8 x 8 x 4 cm, whose place each reset draws anew.

    Action: (4,), the motion of the tool, and the button, down above 0. The first press of it while touching is the mark and ends the
    episode (terminated); its reward is the score of the task over 100, all others are 0. A scene with a task `find` has its own lump.
    """

    def __init__(self, scene=None, *, max_steps=500, **touch):
        self._own = scene
        super().__init__(scene if scene is not None else self._block(0.0, 0.0), max_steps=max_steps, **touch)
        TaskScorer(self.scene)  # raises for a scene without a task
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

    def step(self, action):
        self._down = bool(action[3] > 0)
        return super().step(np.asarray(action)[:3])

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

    def __init__(self, scene=None, *, most_n=2.0, hold_s=0.2, **touch):
        super().__init__(scene if scene is not None else Scene(find_scene("cube6")), **touch)
        if self.scene.contact != "attach":
            raise InputError(f'scene "{self.scene.name}": is touched; expected one that is grasped (attach)')
        self.most_n, self.hold_s = most_n, hold_s

    def begin(self, options):
        self.height, self._held = float(self.np_random.uniform(0.003, 0.01)), 0

    def numbers(self):
        return (self.height - (self.tool[2] - self._home[2]),)

    def judge(self):
        if self.force_n > self.most_n:
            return -1.0, True
        missing = abs(self.numbers()[0])
        self._held = self._held + 1 if missing < 0.0005 else 0
        done = self._held * self.step_s >= self.hold_s
        return -missing / self.height + done, done
