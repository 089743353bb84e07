"""The independent computation against closed forms, so that it can be trusted where it disagrees with Palpate."""

import unittest

import numpy as np

from lattice_reference import Body, Motion, lattice, simulate

HELD = Motion([0, 10], [[0.05, 0.05, 0.1]] * 2)


def cube(nodes=(3, 3, 3), damping=0.0, **more):
    spec = {"nodes": list(nodes), "size_m": [0.1] * len(nodes), "thickness_m": 0.01, "density_kg_m3": 1000, "stiffness_n_m": 60,
            "damping_n_s_m": damping, "fixed_faces": ["z-" if len(nodes) == 3 else "y-"], **more}
    return {"body": {"lattice": spec}, "tool": {"contact": "attach", "node": [n // 2 for n in nodes[:-1]] + [nodes[-1] - 1]}}


class LatticeReference(unittest.TestCase):
    def test_mass_pulled_along_a_spring_and_damper_follows_its_closed_form(self):
        m, k, b, w, a, start = 0.01, 100.0, 0.2, 40.0, 0.004, 0.05
        body = Body([[0, 0, 0], [start, 0, 0]], [m, m], [[0, 1]], [k], [b], [], tool=0)
        t = np.arange(0, 0.5001, 0.0001)
        rows = simulate(body, Motion(t, np.stack([a * np.sin(w * t), 0 * t, 0 * t], axis=1)), 0.4)[0]
        # y = displacement of the mass: m y'' = k (h - y) + b (h' - y'), h = a sin(w t), y(0) = y'(0) = 0
        z = a * (k + 1j * w * b) / (k - m * w * w + 1j * w * b)  # steady part Im(z exp(i w t))
        decay, ring = b / (2 * m), np.sqrt(k / m - (b / (2 * m)) ** 2)
        c0 = -z.imag
        c1 = (-(1j * w * z).imag + decay * c0) / ring
        time = rows[:, 0]
        free, dfree = np.exp(-decay * time), np.exp(-decay * time)
        y = (z * np.exp(1j * w * time)).imag + free * (c0 * np.cos(ring * time) + c1 * np.sin(ring * time))
        dy = (1j * w * z * np.exp(1j * w * time)).imag + dfree * (
            (c1 * ring - decay * c0) * np.cos(ring * time) - (c0 * ring + decay * c1) * np.sin(ring * time))
        force = k * (y - a * np.sin(w * time)) + b * (dy - a * w * np.cos(w * time))
        error = rows[1:, 1] - force[1:]
        self.assertLess(np.sqrt((error ** 2).mean() / (force ** 2).mean()), 2e-3)  # the chords of a sampled sine

    def test_energy_stays_without_damping(self):
        body = lattice(cube())
        rng = np.random.default_rng(1)
        v0 = 0.2 * rng.standard_normal(body.rest.shape)
        v0[[n for n in range(len(v0)) if n not in body.moving]] = 0
        before = body.energy(body.rest, v0)
        _, x, v = simulate(body, HELD, 0.5, start_velocity=v0)
        self.assertGreater(np.abs(x - body.rest).max(), 1e-3)
        self.assertAlmostEqual(body.energy(x, v) / before, 1, delta=1e-4)

    def test_elements_pull_in_pairs(self):
        body = lattice(cube(damping=0.3))
        rng = np.random.default_rng(2)
        pulls = body.pulls(body.rest + 0.01 * rng.standard_normal(body.rest.shape), rng.standard_normal(body.rest.shape))
        self.assertLess(np.abs(pulls.sum(axis=0)).max(), 1e-12)

    def test_every_neighbour_is_joined_once(self):
        body = lattice(cube((4, 3, 5)))
        middle = (2 * 3 + 1) * 4 + 1
        self.assertEqual((body.ends == middle).sum(), 26)
        self.assertEqual((lattice(cube((3, 3))).ends == 4).sum(), 8)
        self.assertEqual(len({frozenset(pair) for pair in map(tuple, body.ends)}), len(body.ends))

    def test_a_damped_body_comes_to_rest_under_its_weight(self):
        scene = cube(damping=1.0)
        scene["body"]["gravity_m_s2"] = [0, 0, -9.81]
        body = lattice(scene)
        rows, x, v = simulate(body, HELD, 1.5)
        on_supports = body.pulls(x, v)
        held = [n for n in range(len(body.rest)) if n not in body.moving]
        weight = body.mass[body.moving].sum() * 9.81
        self.assertAlmostEqual(on_supports[held].sum(axis=0)[2], -weight, delta=1e-3 * weight)
        self.assertLess(np.abs(v[body.moving]).max(), 1e-3)


if __name__ == "__main__":
    unittest.main()
