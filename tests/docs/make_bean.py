from math import cos, pi, sin

def point(i, j, n=48, m=24):
    u, v = 2 * pi * i / n, pi * j / m
    x, y, z = 40 * cos(u) * sin(v), 25 * sin(u) * sin(v), 20 - 20 * cos(v)
    return x, y + 0.006 * x * x, z

def facet(*corners):
    print("facet normal 0 0 0\nouter loop")
    for corner in corners:
        print("vertex %.4f %.4f %.4f" % corner)
    print("endloop\nendfacet")

print("solid bean")
for i in range(48):
    for j in range(24):
        a, b, c, d = point(i, j), point(i, j + 1), point((i + 1) % 48, j + 1), point((i + 1) % 48, j)
        if j < 23:
            facet(a, c, b)
        if j > 0:
            facet(a, d, c)
print("endsolid bean")
