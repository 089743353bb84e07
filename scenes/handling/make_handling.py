#!/usr/bin/env python3
"""Makes the motions of this folder, and the block with a hole of hole.json.

    python3 scenes/handling/make_handling.py

Every point-to-point motion has the minimum-jerk profile. Deterministic: the same files on every run.
"""
import math
import os

FOLDER = os.path.dirname(os.path.abspath(__file__))
STEP_S = 0.005


def part(t, begin, takes):
    """0 before `begin`, 1 from `begin` + `takes` on, along the minimum-jerk profile."""
    u = min(max((t - begin) / takes, 0.0), 1.0)
    return u * u * u * (10 + u * (6 * u - 15))


def times(a, b):
    """Product of two quaternions (x, y, z, w)."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def turn(axis, degrees):
    """Quaternion of a turn about axis 0, 1 or 2."""
    half = math.radians(degrees) / 2
    q = [0.0, 0.0, 0.0, math.cos(half)]
    q[axis] = math.sin(half)
    return tuple(q)


def write(name, length_s, tool):
    """Writes what tool(t) returns: position, orientation, and the opening of jaws or None."""
    with open(os.path.join(FOLDER, name + ".csv"), "w") as out:
        jaws = tool(0.0)[2] is not None
        out.write("t_s,x_m,y_m,z_m,qx,qy,qz,qw" + (",opening" if jaws else "") + "\n")
        for k in range(round(length_s / STEP_S) + 1):
            position, orientation, opening = tool(k * STEP_S)
            row = ["%.3f" % (k * STEP_S)] + ["%.6f" % v for v in position] + ["%.9f" % v for v in orientation]
            out.write(",".join(row + (["%.6f" % opening] if jaws else [])) + "\n")


def edge(t):
    """A shaft across the edge of a block: 5 mm in, 15 mm along the edge and back, twice rocked by 12 degrees, and up."""
    down = part(t, 0, 0.4) - part(t, 4.2, 0.4)
    along = part(t, 0.8, 0.6) - part(t, 1.4, 0.6)
    rock = math.sin(2 * math.pi * (t - 2.2)) if 2.2 <= t <= 4.2 else 0
    return (0.05, 0.015 * along, 0.053 - 0.008 * down), turn(1, 12 * rock), None


def hole(t):
    """A peg into a hole 7 mm wider on all sides: 24 mm down, 4 mm into the wall, once around, a lean of 8 degrees, and out."""
    down = part(t, 0, 0.8) - part(t, 5.6, 0.8)
    aside = part(t, 0.9, 0.4) - part(t, 5.0, 0.4)
    angle = 2 * math.pi * part(t, 1.4, 2.6)
    lean = 8 * (part(t, 4.1, 0.4) - part(t, 4.6, 0.4))
    return (0.011 * aside * math.cos(angle), 0.011 * aside * math.sin(angle), 0.053 - 0.029 * down), turn(0, lean), None


def fold(t):
    """A ball into the fold between two lobes, to and fro across it, along it, and up."""
    down = part(t, 0, 0.5) - part(t, 4.0, 0.5)
    across = math.sin(2 * math.pi * (t - 0.8)) if 0.8 <= t <= 2.8 else 0
    along = part(t, 2.9, 0.5) - part(t, 3.4, 0.5)
    return (0.003 * across, 0.012 * along, 0.064 - 0.02 * down), turn(1, 10 * across), None


def pinch(t, closed):
    """Jaws astride of a fold that close to an opening, hold, and open again."""
    return 0.35 + (closed - 0.35) * (part(t, 0.4, 0.4) - part(t, 3.2, 0.3))


def astride(t):
    """Height of the jaws' tips above those of a fold of 40 mm that they are put over, and lifted from."""
    return 0.041 - 0.022 * (part(t, 0, 0.4) - part(t, 3.5, 0.4))


def jaws(t):
    """Jaws close on a fold, pull it 6 mm up, let it go back, and open."""
    return (0, 0, astride(t) + 0.006 * (part(t, 1.0, 0.8) - part(t, 2.2, 0.8))), turn(2, 0), pinch(t, 0.02)


def twist(t):
    """Jaws close on a fold and turn it by 20 degrees to each side."""
    return (0, 0, astride(t)), turn(2, 20 * math.sin(math.pi * (t - 1)) if 1 <= t <= 3 else 0), pinch(t, 0.02)


def two_organs(t):
    """A shaft across two organs that touch: 7 mm in, 12 mm along the seam and back, rolled onto either by 10 degrees, and up."""
    down = part(t, 0, 0.5) - part(t, 4.2, 0.4)
    along = part(t, 0.8, 0.6) - part(t, 1.4, 0.6)
    rock = math.sin(2 * math.pi * (t - 2.2)) if 2.2 <= t <= 4.2 else 0
    return (0, 0.012 * along, 0.062 - 0.012 * down), turn(1, 10 * rock), None


def block_with_hole(name, side, height, radius, depth, sides):
    """A block, in millimetres, from z = 0 up, with a blind hole of that depth in the middle of its top."""
    n = sides
    corner = lambda k: (side / 2 / max(abs(math.cos(2 * math.pi * k / n)), abs(math.sin(2 * math.pi * k / n))))
    ring = lambda r, z: [(r(k) * math.cos(2 * math.pi * k / n), r(k) * math.sin(2 * math.pi * k / n), z) for k in range(n)]
    round_ = lambda k: radius
    points = [(0, 0, 0)] + ring(corner, 0) + ring(corner, height) + ring(round_, height) + ring(round_, height - depth)
    points.append((0, 0, height - depth))
    at = lambda i, k: 2 + n * i + k % n
    faces = [(1, at(0, k + 1), at(0, k)) for k in range(n)]
    for i in range(3):
        faces += [(at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)) for k in range(n)]
    faces += [(at(3, k), at(3, k + 1), len(points)) for k in range(n)]
    with open(os.path.join(FOLDER, name + ".obj"), "w") as out:
        out.write("".join("v %.3f %.3f %.3f\n" % p for p in points))
        out.write("".join("f " + " ".join(map(str, f)) + "\n" for f in faces))


write("edge", 4.8, edge)
write("hole", 6.4, hole)
write("fold", 4.7, fold)
write("jaws", 4.0, jaws)
write("twist", 4.0, twist)
write("two-organs", 4.8, two_organs)
block_with_hole("block-with-hole", 96, 48, 16, 36, 48)
