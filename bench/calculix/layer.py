#!/usr/bin/env python3
"""Rigid indenters on an elastic layer of thickness h, bonded below, without friction, small strains: the force, by an integral
equation, without any mesh of the layer. `layer.py > layer.csv` writes the numbers that palpate-lab tissue compares with; `layer.py
check layer.csv` computes them anew.

With u(r) given for r < a and no traction for r > a, the traction's Hankel transform is A(k) = int_0^a phi(t) cos(k t) dt and

    phi(t) - 2/pi int_0^a phi(s) K(s, t) ds = 2/pi G/(1 - nu) g(t),   K = int_0^oo (1 - m(k h)) cos(k s) cos(k t) dk,
    m(x) = ((3 - 4 nu) sinh 2x - 2x) / ((3 - 4 nu) cosh 2x + 2 x^2 + 5 - 12 nu + 8 nu^2),      P = 2 pi int_0^a phi dt

g = d for a flat punch, d - t^2/R for a ball (paraboloid) of radius R, whose d follows from phi(a) = 0. h -> oo: 2 E a d / (1 - nu^2)
and Hertz. kappa = P / P_(h -> oo) at the same d (of a ball: at the same a).

Source: Lebedev and Ufliand, PMM 22 (1958); Hayes, Keer, Herrmann and Mockros, J. Biomech. 5 (1972).
"""
import sys

import numpy as np

POINTS, WAVES, FARTHEST = 48, 400, 40.0  # of t, of k h and its end
# indenter, a / h, nu
CASES = [("punch", 1.0, 0.3), ("punch", 1.0, 0.45), ("punch", 1.0, 0.49), ("ball", 1.0, 0.3), ("ball", 1.0, 0.45), ("ball", 1.0, 0.49),
         ("ball", 0.1, 0.3), ("ball", 0.1, 0.45)]


def compliance(x, nu):
    """m(x); both parts over cosh 2x, which has no bound."""
    e = np.exp(-4 * x)
    inverse = 2 * np.exp(-2 * x) / (1 + e)  # 1 / cosh 2x
    tanh = (1 - e) / (1 + e)
    return ((3 - 4 * nu) * tanh - 2 * x * inverse) / (3 - 4 * nu + (2 * x**2 + 5 - 12 * nu + 8 * nu**2) * inverse)


def solve(kind, a, nu):
    """d and P for h = 1, G / (1 - nu) = 1, and R = 1 of a ball or d = 1 of a punch."""
    t, w = np.polynomial.legendre.leggauss(POINTS)
    t, w = a * (t + 1) / 2, a * w / 2
    k, v = np.polynomial.legendre.leggauss(WAVES)
    k, v = FARTHEST * (k + 1) / 2, FARTHEST * v / 2
    left = v * (1 - compliance(k, nu))
    kernel = lambda s, r: (np.cos(np.outer(s, k)) * left) @ np.cos(np.outer(r, k)).T
    system = np.eye(POINTS) - 2 / np.pi * kernel(t, t) * w
    flat = np.linalg.solve(system, np.full(POINTS, 2 / np.pi))
    if kind == "punch":
        return 1.0, 2 * np.pi * w @ flat
    round_ = np.linalg.solve(system, -2 / np.pi * t**2)
    at_edge = lambda phi, g: g + 2 / np.pi * (kernel(np.array([a]), t) * w @ phi)[0]
    d = -at_edge(round_, -2 / np.pi * a**2) / at_edge(flat, 2 / np.pi)
    return d, 2 * np.pi * w @ (d * flat + round_)


def rows():
    yield "indenter,a_over_h,poisson,depth,force,kappa"
    for kind, a, nu in CASES:
        d, p = solve(kind, a, nu)
        kappa = p / (4 * a * d if kind == "punch" else 8 / 3 * a**3)
        yield f"{kind},{a:g},{nu:g},{d:.7g},{p:.7g},{kappa:.5f}"


def agree(found, computed):
    """Numbers to 1 in 100,000: their last digit is rounded."""
    if len(found) != len(computed) or found[0] != computed[0]:
        return False
    for row, other in zip(found[1:], computed[1:]):
        (kind, *numbers), (same, *others) = row.split(","), other.split(",")
        if kind != same or any(abs(float(x) - float(y)) > 1e-5 * abs(float(y)) for x, y in zip(numbers, others)):
            return False
    return True


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "check":
        if not agree(open(sys.argv[2], encoding="ascii").read().split(), list(rows())):
            sys.exit(f"{sys.argv[2]} is not what is computed:\n" + "\n".join(rows()))
    elif len(sys.argv) == 1:
        print("\n".join(rows()))
    else:
        sys.exit(__doc__)
