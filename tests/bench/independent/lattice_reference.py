"""The reference force of an attach lattice, computed a second time and independently of Palpate's C++.

Written from the definition of the scene file alone: node (i, j, k) rests at (i, j, k) size / (nodes - 1); every node joins all
lateral and diagonal neighbours with a spring and an axial damper; equal lumps of mass; fixed faces never move; the attached
node follows the motion, linear between its samples. A body with weight has come to rest, held at the motion's first point, before the
motion begins. Classical Runge-Kutta of fourth order, many steps to a millisecond.

    T = k e + b e'        tension of an element: elongation e [m], its rate e' [m/s] along the element
    force on the tool     the sum of the elements' pulls on the attached node [N]; the node's own mass is not felt
"""

import itertools
import json
import math

import numpy as np


def stiffening_tension(k, e, length, c):
    return k * e * (1 + c * (e / length) ** 2)


class Body:
    """Nodes joined by elements. `moving` lists the free nodes; `tool` is the attached one; all others stand still."""

    def __init__(self, rest, mass, ends, k, b, fixed, tool, gravity=(0, 0, 0), stiffening=0.0, planar=False):
        self.rest, self.mass, self.tool = np.asarray(rest, float), np.asarray(mass, float), tool
        self.ends, self.k, self.b = np.asarray(ends), np.asarray(k, float), np.asarray(b, float)
        self.stiffening = stiffening
        self.gravity = np.array(gravity, float)
        if planar:
            self.gravity[2] = 0
        span = self.rest[self.ends[:, 1]] - self.rest[self.ends[:, 0]]
        self.length = np.linalg.norm(span, axis=1)
        self.incidence = np.zeros((len(self.rest), len(self.ends)))  # +1 at an element's first node, -1 at its second
        self.incidence[self.ends[:, 0], np.arange(len(self.ends))] = 1
        self.incidence[self.ends[:, 1], np.arange(len(self.ends))] = -1
        self.moving = np.array([n for n in range(len(self.rest)) if n != tool and n not in set(fixed)], int)

    def pulls(self, x, v):
        """Force of the elements on every node."""
        span = x[self.ends[:, 1]] - x[self.ends[:, 0]]
        now = np.sqrt((span * span).sum(axis=1))
        direction = span / now[:, None]
        e = now - self.length
        rate = ((v[self.ends[:, 1]] - v[self.ends[:, 0]]) * direction).sum(axis=1)
        tension = stiffening_tension(self.k, e, self.length, self.stiffening) if self.stiffening else self.k * e
        return self.incidence @ ((tension + self.b * rate)[:, None] * direction)

    def energy(self, x, v):
        """Kinetic energy of the moving nodes, springs (linear ones) and weight [J]."""
        e = np.linalg.norm(x[self.ends[:, 1]] - x[self.ends[:, 0]], axis=1) - self.length
        m, moving = self.mass[self.moving], self.moving
        return (0.5 * (m[:, None] * v[moving] ** 2).sum() + 0.5 * (self.k * e * e).sum()
                - (m[:, None] * (x[moving] - self.rest[moving]) * self.gravity).sum())

    def steps_per_tick(self, tick):
        """Small against the fastest rate that any node's elements allow (Gershgorin), so far inside the stable range."""
        around = np.abs(self.incidence)
        stiff, damp = around @ (self.k * (1 + 3 * self.stiffening)), around @ self.b
        mass = self.mass[self.moving]
        rate = (2 * damp[self.moving] / mass + np.sqrt(2 * stiff[self.moving] / mass)).max() if len(mass) else 1
        return max(4, math.ceil(tick * rate / 0.5))


class Motion:
    """Position of the tool, linear between samples; its velocity is the slope of the segment that lies ahead of t, or behind it."""

    def __init__(self, t, position):
        self.t, self.position = np.asarray(t, float), np.asarray(position, float)

    def at(self, t, ahead=True):
        i = int(np.searchsorted(self.t, t, side="right" if ahead else "left")) - 1
        i = min(max(i, 0), len(self.t) - 2)
        slope = (self.position[i + 1] - self.position[i]) / (self.t[i + 1] - self.t[i])
        if t >= self.t[-1] and ahead or t > self.t[-1]:
            return self.position[-1], np.zeros(3)
        return self.position[i] + slope * (t - self.t[i]), slope


def lattice(scene):
    """Body of a scene (a dictionary as read from JSON) with one lattice and tool.contact attach."""
    spec, tool = scene["body"]["lattice"], scene["tool"]
    planar = len(spec["nodes"]) == 2  # a sheet in the plane z = 0
    shape = tuple(spec["nodes"]) + ((1,) if planar else ())
    size = tuple(spec["size_m"]) + ((0.0,) if planar else ())
    step = [s / (n - 1) if n > 1 else 0.0 for s, n in zip(size, shape)]

    def index(i, j, k):
        return (k * shape[1] + j) * shape[0] + i

    cells = [(i, j, k) for k in range(shape[2]) for j in range(shape[1]) for i in range(shape[0])]
    rest = np.array([[c * h for c, h in zip(cell, step)] for cell in cells])
    volume = spec["size_m"][0] * spec["size_m"][1] * (spec["thickness_m"] if planar else spec["size_m"][2])
    mass = np.full(len(rest), spec["density_kg_m3"] * volume / len(rest))

    half = [o for o in itertools.product((-1, 0, 1), repeat=3) if o > (0, 0, 0)]  # each pair of neighbours once
    ends, k, b = [], [], []
    for cell in cells:
        for offset in half:
            other = tuple(c + o for c, o in zip(cell, offset))
            if not all(0 <= c < n for c, n in zip(other, shape)):
                continue
            a, z = index(*cell), index(*other)
            values = spec
            for layer in spec.get("layers", []):
                if (rest[a][2] + rest[z][2]) / 2 < layer["below_z_m"]:
                    values = layer
                    break
            ends.append((a, z))
            k.append(values["stiffness_n_m"])
            b.append(values["damping_n_s_m"])

    axis = {"x": 0, "y": 1, "z": 2}
    fixed = {index(*cell) for cell in cells for face in spec.get("fixed_faces", [])
             if cell[axis[face[0]]] == (0 if face[1] == "-" else shape[axis[face[0]]] - 1)}
    node = tuple(tool["node"]) + ((0,) if len(tool["node"]) == 2 else ())
    return Body(rest, mass, ends, k, b, fixed, index(*node), scene["body"].get("gravity_m_s2", spec.get("gravity_m_s2", (0, 0, 0))),
                planar=planar)


def simulate(body, motion, duration, tick=0.001, start=None, start_velocity=None, drag=0.0):
    """Rows (t, fx, fy, fz): the force on the tool at every tick, and the last state. `drag` [1/s] slows every free node."""
    moving, mass = body.moving, body.mass[body.moving][:, None]
    x, v = (body.rest if start is None else start).copy(), np.zeros_like(body.rest)
    if start_velocity is not None:
        v[moving] = start_velocity[moving]
    steps = body.steps_per_tick(tick)
    h = tick / steps

    def slope(t, xm, vm, ahead):
        x[moving], v[moving] = xm, vm
        x[body.tool], v[body.tool] = motion.at(t, ahead)
        return vm, body.pulls(x, v)[moving] / mass + body.gravity - drag * vm

    rows = []
    xm, vm = x[moving].copy(), v[moving].copy()
    for n in range(round(duration / tick) + 1):
        t = n * tick
        x[moving], v[moving] = xm, vm
        x[body.tool], v[body.tool] = motion.at(t, ahead=(n == 0))
        rows.append((t, *body.pulls(x, v)[body.tool]))
        for s in range(steps):
            u = t + s * h
            x1, v1 = slope(u, xm, vm, True)
            x2, v2 = slope(u + h / 2, xm + h / 2 * x1, vm + h / 2 * v1, True)
            x3, v3 = slope(u + h / 2, xm + h / 2 * x2, vm + h / 2 * v2, True)
            x4, v4 = slope(u + h, xm + h * x3, vm + h * v3, False)
            xm, vm = xm + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4), vm + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    x[moving], v[moving] = xm, vm
    return np.array(rows), x, v


def at_rest(body, tool):
    """Positions in which the body hangs still while the tool holds its node at `tool`."""
    still = Motion([0, 1], [tool, tool])
    x = body.rest
    for _ in range(10):
        _, x, v = simulate(body, still, 0.5, start=x, drag=40.0)
        if np.abs(v).max() < 1e-6:
            return x
    raise RuntimeError("the body does not come to rest")


def reference(scene_file, motion_file):
    """Rows (t, fx, fy, fz) for a scene file and a motion file, a row each millisecond of the motion."""
    with open(scene_file, encoding="utf-8") as f:
        body = lattice(json.load(f))
    samples = np.loadtxt(motion_file, delimiter=",", skiprows=1)
    start = at_rest(body, samples[0, 1:]) if body.gravity.any() else None
    return simulate(body, Motion(samples[:, 0], samples[:, 1:]), samples[-1, 0], start=start)[0]
