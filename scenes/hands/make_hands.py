#!/usr/bin/env python3
"""Makes the motions of this folder: a grasper that holds the fold of two-hands.json by its edge, and a probe beside it.

    python3 scenes/hands/make_hands.py

Every point-to-point motion has the minimum-jerk profile. Deterministic: the same files on every run.
"""
import math
import os

FOLDER = os.path.dirname(os.path.abspath(__file__))
STEP_S, LENGTH_S = 0.005, 7.0


def part(t, begin, takes):
    """0 before `begin`, 1 from `begin` + `takes` on, along the minimum-jerk profile."""
    u = min(max((t - begin) / takes, 0.0), 1.0)
    return u * u * u * (10 + u * (6 * u - 15))


def grasper(t):
    """Jaws astride of the fold close, pull its edge 5 mm up, hold it there, let it go back, and open."""
    down = part(t, 0, 0.4) - part(t, 6.3, 0.5)
    pull = part(t, 1.0, 0.8) - part(t, 5.2, 0.6)
    opening = 0.35 - 0.33 * (part(t, 0.4, 0.4) - part(t, 5.9, 0.3))
    return (0, -0.02, 0.041 - 0.022 * down + 0.005 * pull), opening


def probe(t):
    """A probe beside them presses the side of the fold by 4 mm, strokes it by 8 mm to and fro, and leaves it."""
    press = part(t, 1.6, 0.5) - part(t, 4.6, 0.5)
    along = math.sin(2 * math.pi * (t - 2.1) / 1.2) if 2.1 <= t <= 4.5 else 0
    return (0.014 - 0.010 * press, 0.02 + 0.008 * along, 0.02), None


def write(name, tool):
    with open(os.path.join(FOLDER, name + ".csv"), "w") as out:
        jaws = tool(0.0)[1] is not None
        out.write("t_s,x_m,y_m,z_m,qx,qy,qz,qw" + (",opening" if jaws else "") + "\n")
        for k in range(round(LENGTH_S / STEP_S) + 1):
            position, opening = tool(k * STEP_S)
            row = ["%.3f" % (k * STEP_S)] + ["%.6f" % v for v in position] + ["0", "0", "0", "1"]
            out.write(",".join(row + (["%.6f" % opening] if jaws else [])) + "\n")


write("grasper", grasper)
write("probe", probe)
