"""Writes a surface (STL, OBJ) as the binary STL that Gmsh reads, and says how large it is, for ./dev mesh.

usage: to_stl.py SURFACE EDGE OUT.stl

Shells that lie within a solid and bound no hollow are left out: Gmsh would carve each of them out of it. Triangles that run the other way
around than their neighbours are turned.

Prints "ACROSS FITS SCALE USUAL INNER TURNED": the longest side of its box; 1 where EDGE is a 100th to a half of that, else 0; the metres a unit,
of those that people draw in, that bring the surface nearest to an organ of 0.15 m; a usual edge; the shells left out; the triangles turned. One line on stderr and exit 2 for a
file that is no such surface. What is read is what server/scene/surface_file.hpp reads.
"""

import collections
import math
import pathlib
import struct
import sys

HEAD, TRIANGLE, CORNERS_MOST = 84, 50, 1000
ORGAN_M, SCALES = 0.15, (1, 0.01, 0.001, 0.000001)


class Unreadable(Exception):
    pass


def cross(o, a, b):
    return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0])


def flattened(x):
    """In the plane across the mean normal, counter-clockwise."""
    normal = [sum(p[u] * q[v] - p[v] * q[u] for p, q in zip(x, x[1:] + x[:1])) for u, v in ((1, 2), (2, 0), (0, 1))]
    up = max(range(3), key=lambda axis: abs(normal[axis]))
    u, v = (up + 1) % 3, (up + 2) % 3
    return [(p[v], p[u]) if normal[up] < 0 else (p[u], p[v]) for p in x]


def is_ear(ring, k, flat):
    a, b, c = flat[ring[k - 1]], flat[ring[k]], flat[ring[(k + 1) % len(ring)]]
    if cross(a, b, c) <= 0:
        return False
    others = (flat[i] for i in ring if flat[i] not in (a, b, c))
    return not any(cross(a, b, p) >= 0 and cross(b, c, p) >= 0 and cross(c, a, p) >= 0 for p in others)


def triangles_of(polygon):
    """Ears are cut off, the next one from where the last one was."""
    flat, ring, k = flattened(polygon), list(range(len(polygon))), 0
    while len(ring) > 3:
        k = next((i % len(ring) for i in range(k, k + len(ring)) if is_ear(ring, i % len(ring), flat)), k % len(ring))
        yield polygon[ring[k - 1]], polygon[ring[k]], polygon[ring[(k + 1) % len(ring)]]
        del ring[k]
    yield tuple(polygon[i] for i in ring)


def read_obj(text):
    vertices, triangles = [], []
    for words in (line.split() for line in text.replace("\\\n", " ").splitlines()):
        words = words[:next((k for k, word in enumerate(words) if word.startswith("#")), None)]
        if words[:1] == ["v"]:
            vertices.append(tuple(map(float, words[1:4])))
        elif words[:1] == ["f"]:
            named = [int(word.split("/")[0]) for word in words[1:]]
            if not 3 <= len(named) <= CORNERS_MOST or not all(-len(vertices) <= n <= len(vertices) and n != 0 for n in named):
                raise Unreadable
            triangles += triangles_of([vertices[n if n < 0 else n - 1] for n in named])
    return triangles


def read_stl(data):
    count = struct.unpack_from("<I", data, HEAD - 4)[0] if len(data) >= HEAD else 0
    text = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:5].lower() == b"solid"
    if len(data) < HEAD or (text and 0 not in data[:HEAD]):
        words = iter(data.decode(errors="replace").lower().split())
        corners = [tuple(float(next(words)) for _ in range(3)) for word in words if word == "vertex"]
        return list(zip(corners[::3], corners[1::3], corners[2::3]))
    if len(data) < HEAD + TRIANGLE * count:
        raise Unreadable
    corners = (struct.unpack_from("<12x9f", data, HEAD + TRIANGLE * k) for k in range(count))
    return [(c[:3], c[3:6], c[6:]) for c in corners]


def open_edges(triangles, across):
    """How many edges have no triangle on the other side that runs the other way, corners within a millionth of the size being one."""
    place = {c: tuple(round(1e6 * x / across) for x in c) for t in triangles for c in t}
    edges = collections.Counter()
    for t in triangles:
        a, b, c = (place[corner] for corner in t)
        if len({a, b, c}) == 3:
            edges.update([(a, b), (b, c), (c, a)])
    return sum(abs(n - edges[v, u]) for (u, v), n in list(edges.items()) if n > edges[v, u])


def turned_alike(triangles, across):
    """Triangles that all run around their shell the same way, and how many were turned for it; as they are if an edge has not two of them."""
    corners = [[tuple(round(1e6 * x / across) for x in c) for c in t] for t in triangles]
    whole = [i for i, t in enumerate(corners) if len(set(t)) == 3]
    at_edge = collections.defaultdict(list)
    for i in whole:
        for k in range(3):
            a, b = corners[i][k], corners[i][(k + 1) % 3]
            at_edge[min(a, b), max(a, b)].append((i, a < b))
    if any(len(sides) != 2 for sides in at_edge.values()):
        return triangles, 0
    beside = collections.defaultdict(list)
    for (i, along), (j, other_along) in at_edge.values():
        beside[i].append((j, along == other_along))
        beside[j].append((i, along == other_along))
    turned, count = {}, 0
    for first in whole:
        if first in turned:
            continue
        turned[first], shell = False, [first]
        for i in shell:
            for j, against in beside[i]:
                if j not in turned:
                    turned[j] = turned[i] != against
                    shell.append(j)
                elif turned[j] != (turned[i] != against):
                    return triangles, 0
        fewer = 2 * sum(turned[i] for i in shell) > len(shell)
        for i in shell:
            turned[i] = turned[i] != fewer
            count += turned[i]
    return [t[::-1] if turned.get(i) else t for i, t in enumerate(triangles)], count


def shells(triangles, across):
    """The triangles in lists of those that hang together by corners."""
    parent = {}

    def root(place):
        while parent.setdefault(place, place) != place:
            parent[place] = place = parent[parent[place]]
        return place

    def placed(corner):
        return tuple(round(1e6 * x / across) for x in corner)

    for t in triangles:
        a, b, c = (root(placed(corner)) for corner in t)
        parent[b] = parent[root(c)] = a
    parts = collections.defaultdict(list)
    for t in triangles:
        parts[root(placed(t[0]))].append(t)
    return list(parts.values())


def winding(point, shell):
    """How often a closed surface goes around the point: 1 inside, -1 if it is turned inside out, 0 outside."""
    angle = 0
    for corners in shell:
        a, b, c = ([x - o for x, o in zip(corner, point)] for corner in corners)
        la, lb, lc = (math.sqrt(sum(x * x for x in v)) for v in (a, b, c))
        ab, bc, ca = (sum(x * y for x, y in zip(u, v)) for u, v in ((a, b), (b, c), (c, a)))
        volume = sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))
        angle += 2 * math.atan2(volume, la * lb * lc + ab * lc + bc * la + ca * lb)
    return round(angle / (4 * math.pi))


def boxed(shell):
    return [(min(c[axis] for t in shell for c in t), max(c[axis] for t in shell for c in t)) for axis in range(3)]


def is_around(outer, outer_box, inner, inner_box):
    """Whether one shell encloses the other, neither crossing it as far as corners show."""
    if not all(o[0] < i[0] and i[1] < o[1] for o, i in zip(outer_box, inner_box)):
        return False
    corners = [c for t in inner for c in t]
    extremes = {choose(corners, key=lambda c: c[axis]) for axis in range(3) for choose in (min, max)}
    near = {c for t in outer for c in t if all(low <= x <= high for x, (low, high) in zip(c, inner_box))}
    return all(winding(c, outer) for c in extremes) and not any(winding(c, inner) for c in near)


def without_inner(triangles, across):
    """The triangles of shells with the solid on one side alone, and how many shells are left out."""
    parts = shells(triangles, across)
    if len(parts) == 1:
        return triangles, 0
    boxes, kept = [boxed(part) for part in parts], []
    for i, part in enumerate(parts):
        outside = sum(winding(part[0][0], parts[k]) for k in range(len(parts))
                      if k != i and is_around(parts[k], boxes[k], part, boxes[i]))
        own = 1 if sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for a, b, c in part for i in range(3)) > 0 else -1
        if (outside == 0) != (outside + own == 0):
            kept.append(part)
    return [t for part in kept for t in part], len(parts) - len(kept)


def written(triangles):
    return bytes(80) + struct.pack("<I", len(triangles)) + b"".join(
        struct.pack("<12x9f2x", *(x for corner in triangle for x in corner)) for triangle in triangles)


def main():
    surface, edge, out = pathlib.Path(sys.argv[1]), float(sys.argv[2]), pathlib.Path(sys.argv[3])
    try:
        data = surface.read_bytes()
        triangles = read_obj(data.decode(errors="replace")) if surface.suffix.lower() == ".obj" else read_stl(data)
        if not all(len(c) == 3 and all(map(math.isfinite, c)) for t in triangles for c in t):
            raise Unreadable
    except (Unreadable, ValueError, OverflowError, RuntimeError, StopIteration, OSError, struct.error):
        print("cannot be read; expected a closed surface of triangles (STL, OBJ)", file=sys.stderr)
        return 2
    if not triangles:
        print("holds no triangles; expected a closed surface", file=sys.stderr)
        return 2
    across = max(max(c[axis] for t in triangles for c in t) - min(c[axis] for t in triangles for c in t) for axis in range(3))
    if not across > 0:
        print("holds no triangles; expected a closed surface", file=sys.stderr)
        return 2
    triangles, turned = turned_alike(triangles, across)
    unmatched = open_edges(triangles, across)
    if unmatched:
        print(f"has {unmatched} edges that no triangle on the other side shares; expected a closed surface", file=sys.stderr)
        return 2
    triangles, inner = without_inner(triangles, across)
    out.write_bytes(written(triangles))
    scale = min(SCALES, key=lambda s: abs(math.log(s * across / ORGAN_M)))
    print(f"{across:.4g} {int(across / 100 <= edge <= across / 2)} {scale if scale > 1e-4 else '0.000001'} {across / 15:.2g} {inner} {turned}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
