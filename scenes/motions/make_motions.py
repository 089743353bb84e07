#!/usr/bin/env python3
"""Makes the recorded motions of this folder from published figures of hand motion; nobody's hand was recorded.

    python3 scenes/motions/make_motions.py

Reaching from point to point has the minimum-jerk profile (Flash and Hogan 1985); voluntary motion stays below 2 Hz (98.9 % of
its power in microsurgery; Riviere 1997); tremor lies at 8-12 Hz with the size of a 0.1 mm sine (50-200 um rms are typical).
Deterministic: the same files on every run.
"""
import math
import os

FOLDER = os.path.dirname(os.path.abspath(__file__))
RATE_HZ = 1000

# The attached node (2, 2, 5) of the 6x6x6 cube of 0.1 m: where the motions for scenes with `attach` start.
NODE = (0.04, 0.04, 0.1)

# Points of the undeformed top surface of organ.json: the middle of the stroke, and a second place [m].
ORGAN_TOP = (-0.030, 0.0, 0.0877)
ORGAN_SECOND = (0.030, 0.010, 0.0773)


def minimum_jerk(u):
    """0 to 1 with zero speed and acceleration at both ends."""
    u = min(max(u, 0.0), 1.0)
    return u * u * u * (10 + u * (6 * u - 15))


def tremor(t, seed):
    """Three axes [m]; together the power of a sine of 0.1 mm. Fixed frequencies between 8 and 12 Hz, phases from the seed."""
    frequencies = (8.3, 9.1, 9.9, 10.6, 11.4)
    scale = 1e-4 / math.sqrt(3 * len(frequencies))
    onset = minimum_jerk(t / 0.5)
    return tuple(
        scale * onset * sum(math.sin(2 * math.pi * (f + 0.07 * axis) * t + 2.4 * (seed + 5 * axis + i))
                            for i, f in enumerate(frequencies))
        for axis in range(3))


def add(*vectors):
    return tuple(sum(parts) for parts in zip(*vectors))


def way(t, points):
    """Minimum-jerk from point to point; `points` are (time of arrival, departure time, position)."""
    before = points[0]
    for point in points[1:]:
        if t < point[0]:
            u = minimum_jerk((t - before[1]) / (point[0] - before[1]))
            return tuple(a + (b - a) * u for a, b in zip(before[2], point[2]))
        if t <= point[1]:
            return point[2]
        before = point
    return points[-1][2]


def at(origin, x=0.0, y=0.0, z=0.0):
    return add(origin, (x, y, z))


def press(t):
    """Press 10 mm in 0.3 s, hold, release in 0.5 s."""
    return way(t, [(0, 0.2, NODE), (0.5, 2.5, at(NODE, z=-0.010)), (3.0, 4.0, NODE)])


def stroke(t):
    """Press 6 mm and move 15 mm to each side at 0.5 Hz, under voluntary motion's 2 Hz."""
    depth = 0.006 * (minimum_jerk(t / 0.5) - minimum_jerk((t - 4.5) / 0.5))
    side = 0.015 * minimum_jerk((t - 0.3) / 0.7) * minimum_jerk((4.7 - t) / 0.7) * math.sin(2 * math.pi * 0.5 * (t - 0.3))
    return at(NODE, x=side, z=-depth)


def tap(t):
    """Eight taps of 4 mm, two a second, each down and up in 0.16 s."""
    depth = 0.0
    for i in range(8):
        u = (t - 0.25 - 0.5 * i) / 0.16
        if 0 < u < 1:
            depth = 0.004 * minimum_jerk(2 * u if u < 0.5 else 2 - 2 * u)
    return at(NODE, z=-depth)


def tremor_hold(t):
    """Press 8 mm and hold with the tremor of an unsupported hand."""
    return add(way(t, [(0, 0.1, NODE), (0.6, 9, at(NODE, z=-0.008))]), tremor(t, seed=1))


def grip_release(t):
    """Press 10 mm in 0.3 s; at 0.5 s the grip opens and the tool swings back as a 5 Hz oscillator with 20 % damping."""
    if t < 0.5:
        return at(NODE, z=-0.010 * minimum_jerk(t / 0.3))
    omega, damping = 2 * math.pi * 5, 0.2
    swing, s = omega * math.sqrt(1 - damping ** 2), t - 0.5
    decay = math.exp(-damping * omega * s)
    return at(NODE, z=-0.010 * decay * (math.cos(swing * s) + damping * omega / swing * math.sin(swing * s)))


def base_excursion(t):
    """Depth 10 + 4 (1.5 Hz) + 0.3 (9 Hz) mm, sideways 4 (1.1 Hz) and 3 (0.7 Hz) mm, ramped in over the first 0.25 s."""
    def wave(amplitude, hz):
        return amplitude * math.sin(2 * math.pi * hz * t)
    ramp = minimum_jerk(t / 0.25)
    return at(NODE, x=ramp * wave(0.004, 1.1), y=ramp * wave(0.003, 0.7), z=-ramp * (0.010 + wave(0.004, 1.5) + wave(0.0003, 9)))


def organ_tour(t):
    """Approach from 20 mm above, palpate (6 to 10 mm deep, 1.2 Hz), stroke 40 mm at 25 mm/s, there and back twice, release;
    tap a second place, circle on it, release."""
    top, second = ORGAN_TOP, ORGAN_SECOND
    start = at(top, x=-0.020)
    points = [
        (0.0, 0.3, at(start, z=0.020)),       # above
        (1.5, 1.6, at(start, z=0.001)),       # approach
        (2.1, 5.1, at(start, z=-0.006)),      # touch, palpate
        (6.7, 6.8, at(start, x=0.040, z=-0.007)),   # stroke there
        (8.4, 8.5, at(start, z=-0.007)),      # and back
        (10.1, 10.2, at(start, x=0.040, z=-0.007)),  # and again
        (10.6, 10.9, at(start, x=0.040, z=0.020)),   # release
        (12.0, 12.1, at(second, z=0.004)),    # second place
        (12.4, 12.5, at(second, z=-0.007)),   # tap
        (12.8, 12.9, at(second, z=0.004)),
        (13.2, 13.3, at(second, z=-0.008)),
        (13.6, 13.7, at(second, z=0.004)),
        (14.1, 17.8, at(second, z=-0.007)),   # circle
        (18.3, 18.4, at(second, z=0.004)),
        (19.4, 20.0, at(second, z=0.025)),
    ]
    palpate = -0.002 * (1 - math.cos(2 * math.pi * 1.2 * (t - 2.1))) if 2.1 <= t <= 2.1 + 3 / 1.2 else 0.0
    turn = 2 * math.pi * 0.8 * (t - 14.2)
    circle = (0.005 * (math.cos(turn) - 1), 0.005 * math.sin(turn), 0.0) if 14.2 <= t <= 14.2 + 2 / 0.8 else (0.0, 0.0, 0.0)
    return add(way(t, points), (0.0, 0.0, palpate), circle, tremor(t, seed=2))


MOTIONS = {
    "press": (press, 4.0),
    "stroke": (stroke, 5.0),
    "tap": (tap, 4.5),
    "tremor-hold": (tremor_hold, 5.0),
    "grip-release": (grip_release, 2.0),
    "base-excursion": (base_excursion, 5.0),
    "organ-tour": (organ_tour, 20.0),
}


def main():
    for name, (motion, duration_s) in MOTIONS.items():
        with open(os.path.join(FOLDER, name + ".csv"), "w", newline="\n", encoding="ascii") as out:
            out.write("t_s,x_m,y_m,z_m\n")
            for i in range(round(duration_s * RATE_HZ) + 1):
                t = i / RATE_HZ
                x, y, z = (round(v, 9) + 0.0 for v in motion(t))
                out.write(f"{t:.3f},{x:.9f},{y:.9f},{z:.9f}\n")


if __name__ == "__main__":
    main()
