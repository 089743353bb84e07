# Types of palpate.env; help(palpate.env) has shapes, units and errors. Without gymnasium its names have the type Any.
import os
import pathlib
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
from gymnasium import Env as Base  # type: ignore
from gymnasium.spaces import Box as Box  # type: ignore
from gymnasium.vector import VectorEnv as VectorBase  # type: ignore

from . import Scene

_Array = npt.NDArray[np.float64]
_Bools = npt.NDArray[np.bool_]
_Ints = npt.NDArray[np.int_]
_SceneOrFile = Scene | str | os.PathLike[str] | None
_Info = dict[str, Any]

SCENES: list[pathlib.Path]

def find_scene(name: str) -> pathlib.Path: ...
def norm(vectors: npt.ArrayLike) -> Any: ...

class Touch(Base):
    extra: int
    drawn: tuple[str, ...] | None
    grasp: Literal["touch", "attach"] | None
    scene: Scene
    step_s: float
    max_speed: float
    max_steps: int
    action_space: Box
    observation_space: Box
    np_random: np.random.Generator
    tool: _Array
    force: _Array
    force_n: Any
    contact: Any
    steps: Any
    def __init__(
        self, scene: _SceneOrFile = None, *, step_s: float = 0.02, max_speed: float = 0.1, max_steps: int = 250
    ) -> None: ...
    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[_Array, _Info]: ...
    def step(self, action: npt.ArrayLike) -> tuple[_Array, float, bool, bool, _Info]: ...
    def observation(self) -> _Array: ...
    def drawn_scene(self) -> Scene: ...
    def begin(self, options: dict[str, Any]) -> None: ...
    def heed(self, action: _Array) -> None: ...
    def numbers(self) -> Sequence[Any]: ...
    def judge(self) -> tuple[Any, Any]: ...
    def close(self) -> None: ...

class Reach(Touch):
    place: _Array

class Press(Touch):
    target_n: float
    hold_s: float
    def __init__(
        self,
        scene: _SceneOrFile = None,
        *,
        target_n: float = 1.0,
        hold_s: float = 0.2,
        step_s: float = 0.02,
        max_speed: float = 0.1,
        max_steps: int = 250,
    ) -> None: ...

class FindLump(Touch):
    def __init__(
        self, scene: _SceneOrFile = None, *, max_steps: int = 500, step_s: float = 0.02, max_speed: float = 0.1
    ) -> None: ...

class Pinch(Touch):
    most_n: float
    hold_s: float
    height: Any
    def __init__(
        self,
        scene: _SceneOrFile = None,
        *,
        most_n: float = 2.0,
        hold_s: float = 0.2,
        step_s: float = 0.02,
        max_speed: float = 0.1,
        max_steps: int = 250,
    ) -> None: ...

class Vector(VectorBase):
    envs: list[Touch]
    num_envs: int
    single_action_space: Box
    single_observation_space: Box
    action_space: Box
    observation_space: Box
    tool: _Array
    force: _Array
    contact: _Bools
    steps: _Ints
    def __init__(self, task: type[Touch], count: int, *, threads: int = 0, **arguments: Any) -> None: ...
    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[_Array, _Info]: ...
    def step(self, actions: npt.ArrayLike) -> tuple[_Array, _Array, _Bools, _Bools, _Info]: ...
    def close(self, **arguments: Any) -> None: ...
