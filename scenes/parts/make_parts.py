"""Writes the rigid parts of these scenes, in millimetres: a table, a bone and a trocar, each a closed surface."""
import math


def lathe(name, profile, sides):
    """Turns (radius, height) pairs about z; the first and the last radius are 0."""
    points = [(0, 0, profile[0][1])]
    for r, z in profile[1:-1]:
        points += [(r * math.cos(2 * math.pi * k / sides), r * math.sin(2 * math.pi * k / sides), z) for k in range(sides)]
    points.append((0, 0, profile[-1][1]))
    ring = lambda i, k: 2 + sides * i + k % sides
    faces = [(1, ring(0, k + 1), ring(0, k)) for k in range(sides)]
    for i in range(len(profile) - 3):
        faces += [(ring(i, k), ring(i, k + 1), ring(i + 1, k + 1), ring(i + 1, k)) for k in range(sides)]
    last = len(profile) - 3
    faces += [(ring(last, k), ring(last, k + 1), len(points)) for k in range(sides)]
    write(name, points, faces)


def write(name, points, faces):
    with open(name, "w") as out:
        out.write("".join("v %.3f %.3f %.3f\n" % p for p in points))
        out.write("".join("f " + " ".join(map(str, f)) + "\n" for f in faces))


def table(name, x, y, z):
    points = [(a * x / 2, b * y / 2, c) for c in (-z, 0) for b in (-1, 1) for a in (-1, 1)]
    write(name, points, [(1, 3, 4, 2), (5, 6, 8, 7), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6)])


def bone():
    """A shaft of 20 mm with a round head at either end."""
    half, head, shaft = 90, 19, 10
    profile = [(0, -half - head)]
    for k in range(1, 61):
        z = -half - head + k * (2 * half + 2 * head) / 61
        d = abs(z) - half
        ball = math.sqrt(max(head * head - d * d, 0))
        blend = shaft + (head - shaft) * math.exp(-((abs(z) - half) / 22) ** 2) if d < 0 else 0
        profile.append((max(ball if d > -8 else 0, blend, 0.5), z))
    return profile + [(0, half + head)]


table("table.obj", 360, 280, 20)
lathe("bone.obj", bone(), 24)
lathe("trocar.obj", [(0, 0), (2, 0.5), (5, 8), (5, 110), (11, 112), (14, 120), (14, 132), (11, 136), (0, 137)], 24)
