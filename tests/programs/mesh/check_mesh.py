"""Fills an ellipsoid with `./dev mesh`, sums up its tetrahedra, and lets a server simulate it; what cannot be filled is refused.

usage: check_mesh.py DEV PALPATE_SERVER WORK
"""

import json
import os
import pathlib
import shutil
import subprocess
import sys
import time

import numpy

RADII = numpy.array([80.0, 55.0, 35.0])  # mm
EDGE = 12.0


def sphere(levels):
    """Corners of the triangles of a subdivided octahedron, on the unit sphere."""
    x, y, z = numpy.eye(3)
    faces = [(a, b, c) if numpy.linalg.det([a, b, c]) > 0 else (a, c, b) for a in (x, -x) for b in (y, -y) for c in (z, -z)]
    for _ in range(levels):
        finer = []
        for a, b, c in faces:
            p, q, r = (v / numpy.linalg.norm(v) for v in (a + b, b + c, c + a))
            finer += [(a, p, r), (p, b, q), (r, q, c), (p, q, r)]
        faces = finer
    return faces


def write_stl(path, faces):
    with path.open("w") as out:
        out.write("solid body\n")
        for face in faces:
            corners = "".join("vertex {:.7g} {:.7g} {:.7g}\n".format(*(RADII * v)) for v in face)
            out.write(f"facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n")
        out.write("endsolid body\n")


def tetrahedra(path):
    """Nodes and tetrahedra of a .msh 4.1 in text, read by hand."""
    words = iter(path.read_text().split())
    nodes, cells = {}, []
    for word in words:
        if word == "$Nodes":
            blocks, _, _, _ = (int(next(words)) for _ in range(4))
            for _ in range(blocks):
                _, _, _, count = (int(next(words)) for _ in range(4))
                tags = [next(words) for _ in range(count)]
                for tag in tags:
                    nodes[tag] = [float(next(words)) for _ in range(3)]
        if word == "$Elements":
            blocks, _, _, _ = (int(next(words)) for _ in range(4))
            for _ in range(blocks):
                _, _, kind, count = (int(next(words)) for _ in range(4))
                corners = {15: 1, 1: 2, 2: 3, 4: 4}[kind]
                for _ in range(count):
                    next(words)
                    cell = [next(words) for _ in range(corners)]
                    if kind == 4:
                        cells.append([nodes[tag] for tag in cell])
    return numpy.array(cells)


def fill(dev, surface, mesh, edge=EDGE):
    return subprocess.run([dev, "--no-install", "mesh", surface, str(edge), mesh], text=True, capture_output=True)


def check_filled(dev, server, work):
    write_stl(work / "an \"odd\" name.stl", sphere(4))
    done = fill(dev, work / "an \"odd\" name.stl", work / "new" / "body.msh")
    assert done.returncode == 0, done.stderr
    cells = tetrahedra(work / "new" / "body.msh")
    edges = cells[:, 1:] - cells[:, :1]
    volume, whole = abs(numpy.linalg.det(edges)).sum() / 6, 4 / 3 * numpy.pi * RADII.prod()
    assert abs(volume / whole - 1) < 0.03, f"{volume:.4g} of {whole:.4g} mm^3"
    mean = numpy.linalg.norm(edges, axis=2).mean()
    assert 0.6 * EDGE < mean < 1.4 * EDGE, f"mean edge {mean:.3g} mm, asked {EDGE}"
    scene = {"name": "filled", "body": {"mesh": {"file": "new/body.msh", "scale": 0.001, "density_kg_m3": 1060,
                                                 "solid": {"young_pa": 8000, "damping_s": 0.008}, "fixed_below_z_m": -0.02}},
             "tool": {"contact": "touch"}}
    (work / "scene.json").write_text(json.dumps(scene))
    run = subprocess.run([server, "--scene", work / "scene.json", "--listen", "127.0.0.1:0", "--duration-s", "1"], text=True,
                         capture_output=True)
    assert run.returncode == 0 and "filled" in run.stdout and " failed" not in run.stdout, run.stdout + run.stderr


def check_obj(dev, work):
    """The same surface as OBJ, in metres; an edge in other units is told from one that is meant."""
    corners = {}
    for face in sphere(3):
        for v in face:
            corners.setdefault(tuple(numpy.round(v, 9)), len(corners) + 1)
    lines = ["v {:.7g} {:.7g} {:.7g}".format(*(1e-3 * RADII * v)) for v in corners]
    lines += ["f {} {} {}".format(*(corners[tuple(numpy.round(v, 9))] for v in face)) for face in sphere(3)]
    (work / "body.obj").write_text("\n".join(lines) + "\n")
    done = fill(dev, work / "body.obj", work / "obj.msh", 0.015)
    assert done.returncode == 0 and "metres" in done.stdout + done.stderr, done
    cells = tetrahedra(work / "obj.msh")
    volume = abs(numpy.linalg.det(cells[:, 1:] - cells[:, :1])).sum() / 6
    assert abs(volume / (4e-9 / 3 * numpy.pi * RADII.prod()) - 1) < 0.05, volume
    done = fill(dev, work / "body.obj", work / "wrong.msh", 15)
    assert done.returncode == 2 and "is 0.16 across" in done.stderr and not (work / "wrong.msh").exists(), done


def check_shells(dev, work):
    """A shell inside another is a hollow where it is turned inside out, and else a part of the solid."""
    def enclosed(faces):
        return numpy.linalg.det([[RADII * v for v in face] for face in faces]).sum() / 6

    outer, inner = sphere(3), [tuple(0.5 * v for v in face) for face in sphere(3)]
    for name, shell, expected in [("solid", inner, enclosed(outer)), ("hollow", [face[::-1] for face in inner], enclosed(outer) - enclosed(inner))]:
        write_stl(work / f"{name}.stl", outer + shell)
        done = fill(dev, work / f"{name}.stl", work / f"{name}.msh")
        assert done.returncode == 0 and ("are left out, 1 in all" in done.stdout) == (name == "solid"), done
        cells = tetrahedra(work / f"{name}.msh")
        volume = abs(numpy.linalg.det(cells[:, 1:] - cells[:, :1])).sum() / 6
        assert abs(volume / expected - 1) < 0.03, (name, volume / expected)


def check_turned(dev, work):
    """Triangles that run the other way around than their neighbours are turned, and that is said."""
    faces = [face[::-1] if k % 7 == 3 else face for k, face in enumerate(sphere(3))]
    write_stl(work / "turned.stl", faces)
    done = fill(dev, work / "turned.stl", work / "turned.msh")
    assert done.returncode == 0 and f"{len(range(3, len(faces), 7))} triangles that faced the wrong way turned" in done.stderr, done
    cells = tetrahedra(work / "turned.msh")
    volume = abs(numpy.linalg.det(cells[:, 1:] - cells[:, :1])).sum() / 6
    assert abs(volume / (4 / 3 * numpy.pi * RADII.prod()) - 1) < 0.05, volume


def check_crossing(dev, work):
    """Of two balls that cross each other, which Gmsh does not fill, the mesh has the skin of a lattice; what is there twice is left out."""
    balls = sphere(3) + [tuple(v + [0.7, 0, 0] for v in face) for face in sphere(3)]
    write_stl(work / "balls.stl", balls + balls[:5])
    done = fill(dev, work / "balls.stl", work / "balls.msh")
    assert done.returncode == 0 and "the skin of a lattice of 12" in done.stdout and "5 triangles that were there twice" in done.stderr, done
    cells = tetrahedra(work / "balls.msh")
    volume = abs(numpy.linalg.det(cells[:, 1:] - cells[:, :1])).sum() / 6
    joined = 4 / 3 * numpy.pi * RADII.prod() * (2 - 0.65**2 * (2 + 0.35) / 2)  # two balls of radius 1, 0.7 apart
    assert abs(volume / joined - 1) < 0.06, volume / joined


def check_refused(dev, work):
    write_stl(work / "open.stl", sphere(3)[40:])
    done = fill(dev, work / "open.stl", work / "open.msh")
    assert done.returncode == 2 and "edges with a triangle on one side only (a hole)" in done.stderr, done
    assert not (work / "open.msh").exists()
    for surface, edge, mesh, word in [("none.stl", EDGE, "a.msh", "no file"), ("open.stl", 0, "a.msh", "edge length"),
                                      ("open.stl", "1;2", "a.msh", "edge length"), ("open.stl", EDGE, "a.vtk", ".msh")]:
        done = fill(dev, work / surface, work / mesh, edge)
        assert done.returncode == 2 and word in done.stderr, done


def check_stopped(dev, work):
    """Gmsh ends with the command, and its files go: here a stand-in for one that does not end by itself."""
    write_stl(work / "ball.stl", sphere(3))
    stuck = work / "stuck"
    stuck.mkdir()
    (stuck / "gmsh").write_text(f"#!/bin/sh\ntrap '' TERM\necho $$ > {work}/pid\nwhile :; do sleep 1; done\n")
    (stuck / "gmsh").chmod(0o755)
    (work / "temporary").mkdir()
    environment = {**os.environ, "PATH": f"{stuck}:{os.environ['PATH']}", "TMPDIR": str(work / "temporary")}
    running = subprocess.Popen([dev, "--no-install", "mesh", work / "ball.stl", str(EDGE), work / "ball.msh"], env=environment)
    until(lambda: (work / "pid").exists() and (work / "pid").read_text().endswith("\n"))
    gmsh = pathlib.Path("/proc") / (work / "pid").read_text().strip()
    assert gmsh.exists()
    running.terminate()
    assert running.wait() == 143
    until(lambda: not gmsh.exists())
    assert not any((work / "temporary").iterdir())


def until(what, most_s=60):
    end = time.monotonic() + most_s
    while not what():
        assert time.monotonic() < end
        time.sleep(0.02)


def main():
    dev, server, work = map(pathlib.Path, sys.argv[1:])
    if not shutil.which("gmsh"):
        sys.exit(77)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    check_filled(dev, server, work)
    check_obj(dev, work)
    check_shells(dev, work)
    check_turned(dev, work)
    check_crossing(dev, work)
    check_refused(dev, work)
    check_stopped(dev, work)


if __name__ == "__main__":
    main()
