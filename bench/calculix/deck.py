#!/usr/bin/env python3
"""Decks for CalculiX that bodies of Palpate are compared with: quadratic hexahedra with reduced integration (C3D20R), neo-Hookean,
large displacements. `deck.py bar|block|cook|glued|cantilever POISSON NX NY NZ [MM] > NAME.inp`, then `ccx NAME`;
`deck.py read NAME.dat` prints the figure.

bar    100 x 30 x 20 mm, 400 kPa, 1000 kg/m^3, clamped at x = 0, hanging in gravity: sag of the middle of the upper edge of its free end
block  60 x 60 x 30 mm, 10 kPa, bonded below; a square of 20 x 20 mm in the middle of the top goes down by MM (3), glued: the force
       on it. A quarter of it, NX = NY: multiples of 3 cells over 30 mm.
cook   Cook's membrane in plane strain, (0, 0), (48, 44), (48, 60), (0, 44) mm, 1 mm thick, 10 kPa, clamped at x = 0, a shear load of
       F = 10 uN in all on x = 48 mm: displacement of (48, 52) along y. NZ = 1.
glued  20 x 10 x 10 mm, 10 kPa, its ends glued, one of them pulled by 1 mm: the force. The body of case ma02 of FEBio's
       verification suite, which stretches it ten times as far.
cantilever
       a bar of 160 x 20 x 40 mm, 200 kPa, glued at x = 160 mm, cut along its middle over MM (80) from x = 0 on; the outer edges of
       both arms at x = 0 move apart by 0.01 mm: the force. A quarter of it, the upper arm over half of its breadth.
"""
import sys

MATERIAL = {"bar": (400e3, 1000.0), "block": (10e3, 1000.0), "cook": (10e3, 1000.0), "glued": (10e3, 1000.0),
            "cantilever": (200e3, 1000.0)}
SIZE = {"bar": (0.1, 0.03, 0.02), "block": (0.03, 0.03, 0.03), "cook": (1.0, 1.0, 0.001), "glued": (0.02, 0.01, 0.01),
        "cantilever": (0.16, 0.01, 0.02)}
COOK_N = 1e-5
FORCES = ("block", "glued", "cantilever")  # asked for
DEFAULT_MM = {"block": 3.0, "cantilever": 80.0}


def lattice(n, size):
    """Nodes of a lattice of twice as many steps that serendipity elements have, and the elements."""
    number = {}
    for k in range(2 * n[2] + 1):
        for j in range(2 * n[1] + 1):
            for i in range(2 * n[0] + 1):
                if (i % 2) + (j % 2) + (k % 2) <= 1:
                    number[i, j, k] = len(number) + 1
    places = {p: tuple(size[a] * p[a] / (2 * n[a]) for a in range(3)) for p in number}
    low = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0)]
    middle = [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0)]
    up = lambda corners, by: [(x, y, z + by) for x, y, z in corners]
    order = low + up(low, 2) + middle + up(middle, 2) + up(low, 1)
    elements = []
    for k in range(0, 2 * n[2], 2):
        for j in range(0, 2 * n[1], 2):
            for i in range(0, 2 * n[0], 2):
                elements.append([number[i + x, j + y, k + z] for x, y, z in order])
    return number, places, elements


def write_set(name, nodes):
    print(f"*NSET, NSET={name}")
    for at in range(0, len(nodes), 10):
        print(", ".join(str(node) for node in nodes[at:at + 10]) + ",")


def write_deck(kind, poisson, n, length_mm):
    number, places, elements = lattice(n, SIZE[kind])
    if kind == "cook":
        places = {at: (0.048 * x, 0.001 * (44 * x + y * (44 - 28 * x)), z) for at, (x, y, z) in places.items()}
    print("*NODE")
    for at, node in number.items():
        print(f"{node}, " + ", ".join(f"{x:.9g}" for x in places[at]))
    print("*ELEMENT, TYPE=C3D20R, ELSET=ALL")
    for e, nodes in enumerate(elements, 1):
        print(f"{e}, " + ", ".join(str(node) for node in nodes[:10]) + ",\n" + ", ".join(str(node) for node in nodes[10:]))
    on = lambda test: [number[p] for p in number if test(*places[p])]
    near = lambda a, b: abs(a - b) < 1e-9
    young, density = MATERIAL[kind]
    shear, bulk = young / (2 * (1 + poisson)), young / (3 * (1 - 2 * poisson))
    print(f"*MATERIAL, NAME=SOFT\n*HYPERELASTIC, NEO HOOKE\n{shear / 2:.9g}, {2 / bulk:.9g}\n*DENSITY\n{density}")
    print("*SOLID SECTION, ELSET=ALL, MATERIAL=SOFT")
    if kind == "bar":
        write_set("HELD", on(lambda x, y, z: near(x, 0)))
        write_set("ASKED", on(lambda x, y, z: near(x, 0.1) and near(y, 0.015) and near(z, 0.02)))
        bound = "HELD, 1, 3"
    elif kind == "cook":
        write_set("HELD", on(lambda x, y, z: near(x, 0)))
        write_set("PLANE", list(number.values()))
        write_set("ASKED", on(lambda x, y, z: near(x, 0.048) and near(y, 0.052) and near(z, 0)))
        bound = "HELD, 1, 2\nPLANE, 3, 3"
    elif kind == "glued":
        write_set("HELD", on(lambda x, y, z: near(x, 0)))
        write_set("ASKED", on(lambda x, y, z: near(x, 0.02)))
        bound = "HELD, 1, 3\nASKED, 2, 3"
    elif kind == "cantilever":  # y = 0 and, beyond the cut, z = 0 are planes of symmetry
        write_set("HELD", on(lambda x, y, z: near(x, 0.16)))
        write_set("BESIDE", on(lambda x, y, z: near(y, 0) and x < 0.16 - 1e-9))
        write_set("WHOLE", on(lambda x, y, z: near(z, 0) and 1e-3 * length_mm - 1e-9 < x < 0.16 - 1e-9))
        write_set("ASKED", on(lambda x, y, z: near(x, 0) and near(z, 0.02)))
        bound = "HELD, 1, 3\nBESIDE, 2, 2\nWHOLE, 3, 3"
    else:  # the quarter x, y > 0 of a block whose middle is at 0
        write_set("HELD", on(lambda x, y, z: near(z, 0)))
        write_set("ASKED", on(lambda x, y, z: near(z, 0.03) and x < 0.01 + 1e-9 and y < 0.01 + 1e-9))
        write_set("ALONGX", on(lambda x, y, z: near(y, 0) and z > 1e-9 and not (near(z, 0.03) and x < 0.01 + 1e-9)))
        write_set("ALONGY", on(lambda x, y, z: near(x, 0) and z > 1e-9 and not (near(z, 0.03) and y < 0.01 + 1e-9)))
        bound = "HELD, 1, 3\nALONGX, 2, 2\nALONGY, 1, 1\nASKED, 1, 2"
    print(f"*BOUNDARY\n{bound}\n*STEP, NLGEOM, INC=100\n*STATIC\n{1.0 if kind == 'cantilever' else 0.25}, 1.0")
    print({"bar": "*DLOAD\nALL, GRAV, 9.81, 0., 0., -1.", "block": f"*BOUNDARY\nASKED, 3, 3, {-1e-3 * length_mm:.9g}",
           "glued": "*BOUNDARY\nASKED, 1, 1, 0.001", "cantilever": "*BOUNDARY\nASKED, 3, 3, 5e-6"}.get(kind) or cook_load(number, n))
    print(f"*NODE PRINT, NSET=ASKED{', TOTALS=ONLY' if kind in FORCES else ''}\n{'RF' if kind in FORCES else 'U'}\n*END STEP")


def cook_load(number, n):
    """What an even traction on faces of eight nodes comes to: -1/12 of it on each corner, 1/3 on each middle."""
    share = {}
    for j in range(0, 2 * n[1], 2):
        for dj, dz in ((0, 0), (2, 0), (0, 2), (2, 2), (1, 0), (1, 2), (0, 1), (2, 1)):
            node = number[2 * n[0], j + dj, dz]
            share[node] = share.get(node, 0) + COOK_N / n[1] * (1 / 3 if dj == 1 or dz == 1 else -1 / 12)
    return "*CLOAD\n" + "\n".join(f"{node}, 2, {much:.9g}" for node, much in share.items())


def read(file):
    """The last line of numbers: a block's force [N], a quarter's, which points down, printed as that of all four; a glued bar's; an arm's,
    over half of its breadth and up, as that of all; a displacement [mm]."""
    text = open(file, encoding="ascii").read()
    last = [line.split() for line in text.splitlines() if line.split() and line.split()[-1][-4:-3] == "E"][-1]
    if "total force" in text:
        along, up = float(last[-3]), float(last[-1])
        print(f"{along:.5f} N" if abs(along) > abs(up) else f"{-4 * up:.4f} N" if up < 0 else f"{2 * up:.6e} N")
    elif len(last) == 4 and abs(float(last[-1])) > 0:
        print(f"{-1e3 * float(last[-1]):.3f} mm")
    else:
        print(f"{1e3 * float(last[2]):.6f} mm")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "read":
        read(sys.argv[2])
    elif sys.argv[1:2] and sys.argv[1] in MATERIAL and len(sys.argv) in ((6, 7) if sys.argv[1] in DEFAULT_MM else (6,)):
        length_mm = float(sys.argv[6]) if len(sys.argv) == 7 else DEFAULT_MM.get(sys.argv[1], 0)
        write_deck(sys.argv[1], float(sys.argv[2]), [int(n) for n in sys.argv[3:6]], length_mm)
    else:
        sys.exit(__doc__)
