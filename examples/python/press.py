"""Presses a body as gestures of hands do, without a network and over 150 ms, and plots the force: press.py SCENE [PICTURE.png]"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
import palpate

scene = palpate.Scene(sys.argv[1])
motion = palpate.Motion.gesture(scene, "press")
reference = palpate.Reference(scene, motion)
t_s = np.arange(len(reference.force)) * 1e-3
plt.plot(t_s, reference.force[:, 2], "k", lw=4, alpha=0.3, label="full model, no network")
for scheme in ("hold", "port", "hyper"):
    felt = palpate.replay(scene, motion, scheme=scheme, rtt_ms=150, reference=reference)
    plt.plot(t_s, felt.felt[:, 2], label=f"{scheme} at 150 ms: {felt.snr_db:.0f} dB")
plt.xlabel("time [s]")
plt.ylabel("force on the tool along z [N]")
plt.title(f"A press on {scene.name}")
plt.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=2)
plt.savefig(sys.argv[2] if len(sys.argv) > 2 else "press.png", dpi=100, bbox_inches="tight")
