"""Palpate: touch a deformable body that is simulated here or on another machine.

In this process: Scene -> Room -> Frame -> Patch -> Player. In virtual time: replay() and accuracy(). At a server: Client and Viewer.
Recorded sessions: Recording. Tasks for a learning program: palpate.env. Metres, seconds, newtons; forces act on the tool.
"""

from ._palpate import (
    Client,
    Felt,
    Frame,
    FrameTool,
    InputError,
    Motion,
    Patch,
    Player,
    RecordedHand,
    Recording,
    Reference,
    Replay,
    Room,
    Rooms,
    Scene,
    TaskScorer,
    Tick,
    View,
    ViewedTool,
    Viewer,
    __version__,
    compare,
    replay,
)

__all__ = [
    "Client",
    "Felt",
    "Frame",
    "FrameTool",
    "InputError",
    "Motion",
    "Patch",
    "Player",
    "RecordedHand",
    "Recording",
    "Reference",
    "Replay",
    "Room",
    "Rooms",
    "Scene",
    "TaskScorer",
    "Tick",
    "View",
    "ViewedTool",
    "Viewer",
    "accuracy",
    "compare",
    "replay",
]


def accuracy(scene, scheme="hyper", rtt_ms=150.0, reference=None):
    """Accuracy of a scheme's force on a scene at a round trip: the Replay of Motion.examination(scene), as `palpate-lab accuracy`.

    reference: Reference(scene, Motion.examination(scene)), which calls of one scene can share. Raises InputError.
    """
    motion = Motion.examination(scene)
    return replay(scene, motion, scheme=scheme, rtt_ms=rtt_ms, reference=reference)
