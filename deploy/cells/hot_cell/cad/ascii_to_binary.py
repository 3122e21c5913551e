#!/usr/bin/env python3
"""Turns OpenSCAD's ASCII STL into binary STL; refuses a mesh that is not closed. Usage: ascii_to_binary.py IN OUT"""
import collections
import re
import struct
import sys

def read_ascii(path):
    numbers = re.compile(r"vertex\s+(\S+)\s+(\S+)\s+(\S+)")
    with open(path) as file:
        # OpenSCAD prints six digits: points that differ only in the last one are the same point.
        points = [tuple(round(float(x), 3) for x in m) for m in numbers.findall(file.read())]
    return [points[i:i + 3] for i in range(0, len(points), 3)]

def open_edges(triangles):
    """Directed edges without exactly one opposite."""
    edges = collections.Counter((t[i], t[(i + 1) % 3]) for t in triangles for i in range(3))
    return [e for e, n in edges.items() if n != 1 or edges.get((e[1], e[0]), 0) != 1]

def normal(a, b, c):
    u, v = [b[i] - a[i] for i in range(3)], [c[i] - a[i] for i in range(3)]
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    length = sum(x * x for x in n) ** 0.5
    return tuple(x / length for x in n) if length > 0 else (0.0, 0.0, 0.0)

source, target = sys.argv[1:3]
triangles = [t for t in read_ascii(source) if len(set(t)) == 3]
bad = open_edges(triangles)
lows, highs = ([round(f(p[i] for t in triangles for p in t), 1) for i in range(3)] for f in (min, max))
print(f"{target}: {len(triangles)} triangles, {lows} to {highs}" + (f", {len(bad)} edges NOT CLOSED, e.g. {bad[:2]}" if bad else ""))
with open(target, "wb") as file:
    file.write(b"binary STL, millimetres".ljust(80) + struct.pack("<I", len(triangles)))
    for t in triangles:
        file.write(struct.pack("<12fH", *normal(*t), *t[0], *t[1], *t[2], 0))
sys.exit(1 if bad else 0)
