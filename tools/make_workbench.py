#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes scenes/workbench.glb: a small engine as triangles (housing, two pistons on a crank, a pair of gears, a fan behind a grille) with
textures made here, and an animation of one turn of the crank in two seconds.

    tools/make_workbench.py > scenes/workbench.glb
"""
import json
import math
import struct
import sys
import zlib

BIN = bytearray()
VIEWS, ACCESSORS, MESHES, NODES, MATERIALS, IMAGES, CHANNELS, SAMPLERS = [], [], [], [], [], [], [], []


def view(data):
    VIEWS.append({"buffer": 0, "byteOffset": len(BIN), "byteLength": len(data)})
    BIN.extend(data)
    while len(BIN) % 4:
        BIN.append(0)
    return len(VIEWS) - 1


def accessor(rows, kind, component=5126, bounds=False):
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[kind]
    flat = [v for row in rows for v in (row if width > 1 else (row,))]
    code = {5126: "f", 5123: "H"}[component]
    entry = {"bufferView": view(struct.pack("<%d%s" % (len(flat), code), *flat)), "componentType": component, "count": len(rows), "type": kind}
    if bounds:
        columns = list(zip(*rows)) if width > 1 else [rows]
        entry["min"], entry["max"] = [min(c) for c in columns], [max(c) for c in columns]
        for key in ("min", "max"):  # as the floats of the buffer are
            entry[key] = list(struct.unpack("<%df" % width, struct.pack("<%df" % width, *entry[key])))
    ACCESSORS.append(entry)
    return len(ACCESSORS) - 1


# Images

def png(width, height, pixel, channels):
    rows = b"".join(b"\0" + bytes(max(0, min(255, int(v + 0.5))) for x in range(width) for v in pixel(x, y)) for y in range(height))

    def chunk(tag, data):
        return struct.pack(">I", len(data)) + tag + data + struct.pack(">I", zlib.crc32(tag + data))

    head = struct.pack(">IIBBBBB", width, height, 8, {3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def image(name, size, pixel, channels=3):
    IMAGES.append({"name": name, "mimeType": "image/png", "bufferView": view(png(size, size, pixel, channels))})
    return len(IMAGES) - 1


def noise(x, y, period, seed=0):
    """Value noise that repeats every `period` cells, 0 to 1."""

    def at(i, j):
        n = ((i % period) * 374761393 + (j % period) * 668265263 + seed * 974711) & 0xffffffff
        n = ((n ^ (n >> 13)) * 1274126177) & 0xffffffff
        return (n ^ (n >> 16)) / 0xffffffff

    i, j = math.floor(x), math.floor(y)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    return (at(i, j) * (1 - u) + at(i + 1, j) * u) * (1 - v) + (at(i, j + 1) * (1 - u) + at(i + 1, j + 1) * u) * v


def worn(x, y):
    """How far the paint is gone, 0 to 1."""
    n = 0.6 * noise(x / 32, y / 32, 8) + 0.4 * noise(x / 8, y / 8, 32, 5)
    return max(0.0, min(1.0, (n - 0.72) * 12))


S = 256


def paint(x, y):
    w, grain = worn(x, y), 14 * (noise(x / 4, y / 4, 64, 2) - 0.5)
    return [a * (1 - w) + b * w + grain for a, b in ((36, 150), (98, 148), (112, 143))]


def paint_rough(x, y):
    w = worn(x, y)
    return [255, 255 * (0.42 * (1 - w) + 0.55 * w), 255 * w]


def dents(x, y):
    """Hammered: normals of noise, green is up."""

    def h(a, b):
        return noise(a / 16, b / 16, 16, 9) + 0.12 * noise(a / 4, b / 4, 64, 4)

    dx, dy = (h(x + 1, y) - h(x - 1, y)) * 1.6, (h(x, y + 1) - h(x, y - 1)) * 1.6
    size = math.sqrt(dx * dx + dy * dy + 1)
    return [127.5 + 127.5 * -dx / size, 127.5 + 127.5 * dy / size, 127.5 + 127.5 / size]


def grille(x, y):
    row = y // 32
    dx, dy = (x + 16 * (row % 2)) % 32 - 15.5, y % 32 - 15.5
    hole = math.hypot(dx, dy) < 12.5
    return [120, 118, 112, 0 if hole else 255]


def gauge(x, y):
    dx, dy = x - 127.5, y - 127.5
    r, a = math.hypot(dx, dy), math.degrees(math.atan2(dx, -dy))
    needle = abs(dx * math.cos(math.radians(50)) + dy * math.sin(math.radians(50))) < 3 and dx * math.sin(math.radians(50)) - dy * math.cos(math.radians(50)) > -12 and r < 92
    tick = 96 < r < 116 and abs(a) < 140 and abs((a + 225) % 22.5 - 11.25) > 9.6
    return [235, 60, 30] if needle else ([225, 235, 220] if tick else [12, 20, 18])


TEXTURES = []


def texture(index):
    TEXTURES.append({"source": index, "sampler": 0})
    return {"index": len(TEXTURES) - 1}


def material(name, color=(1, 1, 1, 1), metallic=0.0, roughness=0.5, **keys):
    entry = {"name": name, "pbrMetallicRoughness": {"baseColorFactor": list(color), "metallicFactor": metallic, "roughnessFactor": roughness}}
    for key, value in keys.items():
        if key in ("baseColorTexture", "metallicRoughnessTexture"):
            entry["pbrMetallicRoughness"][key] = value
        else:
            entry[key] = value
    MATERIALS.append(entry)
    return len(MATERIALS) - 1


# Shapes: lists of (position, normal, uv), three a triangle

def lathe(profile, sides, smooth=True, v_scale=4.0):
    """Round the Y axis. The profile runs from the bottom to the top, (radius, y); flat across each of its pieces."""
    out, along = [], 0.0
    for (r0, y0), (r1, y1) in zip(profile, profile[1:]):
        length = math.hypot(r1 - r0, y1 - y0)
        nr, ny = (y1 - y0) / length, -(r1 - r0) / length
        for i in range(sides):
            a, b = 2 * math.pi * i / sides, 2 * math.pi * (i + 1) / sides
            m = (a + b) / 2

            def corner(angle, r, y, v):
                n = angle if smooth else m
                u = angle / (2 * math.pi) * max(1, round(v_scale * 2 * math.pi * max(r0, r1)))
                return ((r * math.cos(angle), y, -r * math.sin(angle)), (nr * math.cos(n), ny, -nr * math.sin(n)), (u, -v * v_scale))

            p, q = corner(a, r0, y0, along), corner(b, r0, y0, along)
            s, t = corner(a, r1, y1, along + length), corner(b, r1, y1, along + length)
            if r0 > 0:
                out += [p, q, t] if r1 == 0 else [p, q, t, p, t, s]
            elif r1 > 0:
                out += [p, t, s]
        along += length
    return out


def box(half, center=(0, 0, 0), bevel=0.01, uv=2.0):
    """With chamfered edges and corners."""
    h, inner, out = half, [a - bevel for a in half], []

    def face(points, normal):
        axis = max(range(3), key=lambda k: abs(normal[k]))
        u, v = [(2, 1), (0, 2), (0, 1)][axis]
        corners = [(tuple(c + d for c, d in zip(p, center)), normal, (p[u] * uv, -p[v] * uv)) for p in points]
        for i in range(2, len(corners)):
            out.extend([corners[0], corners[i - 1], corners[i]])

    def ordered(points, normal):
        mid = [sum(p[k] for p in points) / len(points) for k in range(3)]
        e = [points[0][k] - mid[k] for k in range(3)]
        f = [normal[1] * e[2] - normal[2] * e[1], normal[2] * e[0] - normal[0] * e[2], normal[0] * e[1] - normal[1] * e[0]]
        return sorted(points, key=lambda p: math.atan2(sum((p[k] - mid[k]) * f[k] for k in range(3)), sum((p[k] - mid[k]) * e[k] for k in range(3))))

    signs = (-1, 1)
    for axis in range(3):
        b, c = (axis + 1) % 3, (axis + 2) % 3
        for s in signs:
            n = [0.0, 0.0, 0.0]
            n[axis] = float(s)
            points = []
            for t in signs:
                for w in signs:
                    p = [0, 0, 0]
                    p[axis], p[b], p[c] = s * h[axis], t * inner[b], w * inner[c]
                    points.append(tuple(p))
            face(ordered(points, n), tuple(n))
            for t in signs:  # the edge between +-axis and +-b
                n = [0.0, 0.0, 0.0]
                n[axis], n[b] = s * math.sqrt(0.5), t * math.sqrt(0.5)
                points = []
                for w in signs:
                    for outer in (axis, b):
                        p = [0, 0, 0]
                        p[axis], p[b], p[c] = s * inner[axis], t * inner[b], w * inner[c]
                        p[outer] = (s if outer == axis else t) * h[outer]
                        points.append(tuple(p))
                face(ordered(points, n), tuple(n))
    for s in signs:
        for t in signs:
            for w in signs:
                n = tuple(k / math.sqrt(3) for k in (s, t, w))
                points = [(s * h[0], t * inner[1], w * inner[2]), (s * inner[0], t * h[1], w * inner[2]), (s * inner[0], t * inner[1], w * h[2])]
                face(ordered(points, n), n)
    return out


def extrude(outline, half):
    """A polygon of (x, y) along z, star-shaped round (0, 0)."""
    out = []
    for (x0, y0), (x1, y1) in zip(outline, outline[1:] + outline[:1]):
        length = math.hypot(x1 - x0, y1 - y0)
        n = ((y1 - y0) / length, -(x1 - x0) / length, 0)
        a, b, c, d = (x0, y0, -half), (x1, y1, -half), (x1, y1, half), (x0, y0, half)
        uv = {a: (0, 0), b: (2 * length, 0), c: (2 * length, 4 * half), d: (0, 4 * half)}
        out += [(p, n, uv[p]) for p in (a, b, c, a, c, d)]
        for z, s in ((half, 1), (-half, -1)):
            corners = [(0, 0, z), (x0, y0, z), (x1, y1, z)]
            if s < 0:
                corners.reverse()
            out += [(p, (0, 0, s), (2 * p[0], -2 * p[1])) for p in corners]
    return out


def gear(teeth, radius, depth):
    outline = []
    for i in range(teeth):
        for part, r in ((0.0, radius - depth), (0.28, radius - depth), (0.40, radius), (0.60, radius), (0.72, radius - depth)):
            a = 2 * math.pi * (i + part) / teeth
            outline.append((r * math.cos(a), r * math.sin(a)))
    return outline


def moved(shape, offset=(0, 0, 0), about=None, angle=0.0):
    """Turned about an axis, then moved."""
    c, s = math.cos(angle), math.sin(angle)

    def turn(p):
        x, y, z = p
        if about == "x":
            y, z = c * y - s * z, s * y + c * z
        elif about == "y":
            x, z = c * x + s * z, -s * x + c * z
        elif about == "z":
            x, y = c * x - s * y, s * x + c * y
        return (x, y, z)

    return [(tuple(a + b for a, b in zip(turn(p), offset)), turn(n), uv) for p, n, uv in shape]


def mesh(name, parts):
    """`parts`: (triangles, material)."""
    primitives = []
    for shape, mat in parts:
        numbers, corners, order = {}, [], []
        for p, n, uv in shape:
            key = tuple(round(v, 5) for v in (*p, *n, *uv))
            if key not in numbers:
                numbers[key] = len(corners)
                corners.append(key)
            order.append(numbers[key])
        attributes = {"POSITION": accessor([k[0:3] for k in corners], "VEC3", bounds=True), "NORMAL": accessor([k[3:6] for k in corners], "VEC3"), "TEXCOORD_0": accessor([k[6:8] for k in corners], "VEC2")}
        primitives.append({"attributes": attributes, "indices": accessor(order, "SCALAR", 5123), "material": mat})
    MESHES.append({"name": name, "primitives": primitives})
    return len(MESHES) - 1


def node(name, mesh_number=None, position=None, rotation=None, children=None):
    entry = {"name": name}
    if mesh_number is not None:
        entry["mesh"] = mesh_number
    if position:
        entry["translation"] = list(position)
    if rotation:
        entry["rotation"] = list(rotation)
    if children:
        entry["children"] = children
    NODES.append(entry)
    return len(NODES) - 1


def animate(number, path, times, values):
    SAMPLERS.append({"input": times, "output": accessor(values, "VEC4" if path == "rotation" else "VEC3"), "interpolation": "LINEAR"})
    CHANNELS.append({"sampler": len(SAMPLERS) - 1, "target": {"node": number, "path": path}})


def about_z(angle):
    return (0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2))


painted = material("painted cast iron", roughness=1.0, metallic=1.0, baseColorTexture=texture(image("paint", S, paint)), metallicRoughnessTexture=texture(image("paint rough", S, paint_rough)), normalTexture=texture(image("dents", S, dents)))
steel = material("steel", (0.58, 0.57, 0.55, 1), 1.0, 0.28)
brass = material("brass", (0.78, 0.57, 0.22, 1), 1.0, 0.32)
rubber = material("rubber", (0.03, 0.03, 0.03, 1), 0.0, 0.85)
mesh_holes = material("grille", (1, 1, 1, 1), 0.9, 0.45, baseColorTexture=texture(image("grille", 128, grille, 4)), alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
dial = material("dial", (1, 1, 1, 1), 0.0, 0.3, baseColorTexture=texture(image("gauge", S, gauge)), emissiveFactor=[1, 0.9, 0.7], emissiveTexture={"index": len(TEXTURES) - 1}, extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}})
cover = material("cover glass", (0.8, 0.95, 1, 0.14), 0.0, 0.04, alphaMode="BLEND")
lamp = material("lamp", (0.05, 0.02, 0.02, 1), 0.0, 0.2, emissiveFactor=[1.0, 0.12, 0.04], extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 6.0}})

CRANK, ROD, HEIGHT = 0.11, 0.34, 0.32  # metres: throw, length of a rod, the crank's axis over the bench

housing = box((0.42, 0.055, 0.26), (0, 0.055, 0), 0.02)  # foot
for z in (-0.22, 0.22):
    housing += box((0.10, 0.15, 0.03), (0, 0.25, z), 0.015)  # bearings of the crank
for z in (-0.09, 0.09):
    housing += moved(lathe([(0.118, 0), (0.118, 0.26), (0.108, 0.26), (0.096, 0.26), (0.096, 0.0)], 40), (0, 0.56, z))
housing += box((0.13, 0.03, 0.24), (0, 0.55, 0), 0.012)
for s in (-1, 1):
    housing += box((0.022, 0.215, 0.03), (s * 0.105, 0.33, 0), 0.008)
bolts = []
for x in (-0.36, 0.36):
    for z in (-0.2, 0.2):
        bolts += moved(lathe([(0.034, 0), (0.034, 0.022), (0.028, 0.028), (0, 0.028)], 6, smooth=False), (x, 0.11, z))
gauge_case = moved(lathe([(0, 0), (0.075, 0), (0.08, 0.005), (0.08, 0.04), (0.07, 0.045), (0.066, 0.03)], 48), (0.3, 0.2, 0.265), "x", math.pi / 2)
disc = []
for i in range(48):
    a, b = 2 * math.pi * i / 48, 2 * math.pi * (i + 1) / 48
    disc += [((x, y, 0), (0, 0, 1), (0.5 + x / 0.132, 0.5 - y / 0.132)) for x, y in ((0, 0), (0.066 * math.cos(a), 0.066 * math.sin(a)), (0.066 * math.cos(b), 0.066 * math.sin(b)))]
front = moved(disc, (0.3, 0.2, 0.307))
disc = moved(disc, (0.3, 0.2, 0.296))
stalk = moved(lathe([(0.018, 0), (0.018, 0.13)], 16), (0.3, 0.105, 0.28))
beacon = moved(lathe([(0.035, 0), (0.035, 0.03), (0.03, 0.05), (0.018, 0.066), (0, 0.07)], 32), (-0.32, 0.11, 0.15))
shroud = moved(lathe([(0.17, -0.05), (0.18, -0.05), (0.18, 0.05), (0.17, 0.05), (0.165, 0.045), (0.165, -0.045), (0.17, -0.05)], 56), (-0.28, 0.34, 0), "z", math.pi / 2)
round_holes = []
for i in range(48):
    a, b = 2 * math.pi * i / 48, 2 * math.pi * (i + 1) / 48
    for y, z in ((0, 0), (0.166 * math.cos(a), 0.166 * math.sin(a)), (0.166 * math.cos(b), 0.166 * math.sin(b))):
        round_holes.append(((0, y, z), (1, 0, 0), (z * 8, -y * 8)))
static = node("housing", mesh("housing", [(housing, painted), (bolts + stalk, steel), (gauge_case, brass), (disc, dial), (front, cover), (beacon, lamp), (shroud, painted), (moved(round_holes, (-0.335, 0.34, 0)), mesh_holes)]))

shaft = moved(lathe([(0, -0.36), (0.026, -0.36), (0.026, 0.36), (0, 0.36)], 24), (0, 0, 0), "x", math.pi / 2)
for z in (-0.09, 0.09):
    s = 1 if z < 0 else -1
    shaft += moved(lathe([(0, -0.045), (0.022, -0.045), (0.022, 0.045), (0, 0.045)], 20), (0, s * CRANK, z), "x", math.pi / 2)
    for w in (-0.045, 0.045):
        shaft += box((0.036, 0.115, 0.011), (0, s * 0.045, z + w), 0.006)
crank = node("crank", mesh("crank", [(shaft, steel), (moved(extrude(gear(20, 0.15, 0.03), 0.02), (0, 0, 0.33)), brass)]), (0, HEIGHT, 0))
second = node("second gear", mesh("second gear", [(extrude(gear(12, 0.096, 0.03), 0.02), steel), (moved(lathe([(0, -0.05), (0.018, -0.05), (0.018, 0.05), (0, 0.05)], 16), (0, 0, 0), "x", math.pi / 2), steel)]), (0.222, HEIGHT, 0.33))
blades = []
for k in range(5):
    blade = []
    for i in range(6):
        r0, r1 = 0.03 + 0.02 * i, 0.05 + 0.02 * i
        t0, t1 = 0.9 - 0.1 * i, 0.8 - 0.1 * i

        def edge(r, t, s):
            return (s * 0.04 * math.sin(t), r, s * 0.04 * math.cos(t))

        p = [edge(r0, t0, -1), edge(r0, t0, 1), edge(r1, t1, 1), edge(r1, t1, -1)]
        n = (math.cos(t0), 0, -math.sin(t0))
        for q in ((p[0], p[1], p[2]), (p[0], p[2], p[3])):
            blade += [(v, n, (0, 0)) for v in q]
            blade += [(v, tuple(-w for w in n), (0, 0)) for v in reversed(q)]
    blades += moved(blade, (0, 0, 0), "x", 2 * math.pi * k / 5)
blades += moved(lathe([(0, -0.05), (0.035, -0.05), (0.035, 0.04), (0.02, 0.05), (0, 0.05)], 24), (0, 0, 0), "z", math.pi / 2)
fan = node("fan", mesh("fan", [(blades, rubber)]), (-0.28, 0.34, 0))
piston_mesh = mesh("piston", [(lathe([(0, -0.05), (0.094, -0.05), (0.094, 0.045), (0.088, 0.05), (0, 0.05)], 36), steel)])
rod_shape = box((0.02, ROD / 2 - 0.03, 0.012), (0, ROD / 2, 0), 0.005)
for y in (0, ROD):
    rod_shape += moved(lathe([(0, -0.02), (0.034, -0.02), (0.034, 0.02), (0, 0.02)], 24), (0, y, 0), "x", math.pi / 2)
rod_mesh = mesh("rod", [(rod_shape, steel)])

STEPS = 48
times = accessor([2.0 * i / STEPS for i in range(STEPS + 1)], "SCALAR", bounds=True)
turns = [2 * math.pi * i / STEPS for i in range(STEPS + 1)]
animate(crank, "rotation", times, [about_z(-t) for t in turns])
animate(second, "rotation", times, [about_z(math.pi / 12 + t * 20 / 12) for t in turns])
animate(fan, "rotation", times, [(math.sin(t), 0.0, 0.0, math.cos(t)) for t in turns])
roots = [static, crank, second, fan]
for z, phase in ((-0.09, 0.0), (0.09, math.pi)):
    def pose(t):
        x, y = CRANK * math.sin(t + phase), CRANK * math.cos(t + phase)
        top = y + math.sqrt(ROD * ROD - x * x)
        return (x, HEIGHT + y, z), math.atan2(x, top - y), (0, HEIGHT + top, z)

    rod = node("rod", rod_mesh, pose(0)[0])
    piston = node("piston", piston_mesh, pose(0)[2])
    animate(rod, "translation", times, [pose(t)[0] for t in turns])
    animate(rod, "rotation", times, [about_z(pose(t)[1]) for t in turns])
    animate(piston, "translation", times, [pose(t)[2] for t in turns])
    roots += [rod, piston]

document = {
    "asset": {"version": "2.0", "generator": "tools/make_workbench.py"},
    "extensionsUsed": ["KHR_materials_emissive_strength"],
    "scene": 0, "scenes": [{"nodes": roots}], "nodes": NODES, "meshes": MESHES, "materials": MATERIALS,
    "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}],
    "textures": TEXTURES, "images": IMAGES, "accessors": ACCESSORS, "bufferViews": VIEWS, "buffers": [{"byteLength": len(BIN)}],
    "animations": [{"name": "turn", "channels": CHANNELS, "samplers": SAMPLERS}],
}
text = json.dumps(document, separators=(",", ":")).encode()
text += b" " * (-len(text) % 4)
sys.stdout.buffer.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(BIN)) + struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(BIN), b"BIN\0") + bytes(BIN))
