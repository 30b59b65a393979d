#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
# Writes scenes/quarry.kiln.json: a cliff worked back in benches by a thousand cuts. Same bytes on every machine: the only
# randomness is the generator below, and every number is rounded to a millimetre before it is written.
#   tools/make_quarry.py > scenes/quarry.kiln.json

import json
import math


class Random:
    """Numerical Recipes' 32-bit linear congruential generator, top 24 bits."""

    def __init__(self, seed):
        self.state = seed

    def unit(self):
        self.state = (self.state * 1664525 + 1013904223) & 0xFFFFFFFF
        return (self.state >> 8) / float(1 << 24)

    def between(self, a, b):
        return a + (b - a) * self.unit()

    def choose(self, items):
        return items[int(self.unit() * len(items))]


def quaternion(axis, degrees):
    half = math.radians(degrees) / 2
    n = math.sqrt(sum(c * c for c in axis))
    return [c / n * math.sin(half) for c in axis] + [math.cos(half)]


def product(a, b):
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return [aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz]


def tidy(value):
    """Lengths to a millimetre, whole numbers without a point."""
    r = round(value, 3) + 0.0
    return int(r) if r == int(r) else r


def tidy_rotation(q):
    q = [round(c, 5) + 0.0 for c in q]
    return [int(c) if c == int(c) else c for c in q]


class Scene:
    def __init__(self):
        self.edits = []
        self.counts = {}

    def add(self, kind, **keys):
        self.counts[kind] = self.counts.get(kind, 0) + 1
        edit = {"id": "%s-%d" % (kind, self.counts[kind])}
        for key, value in keys.items():
            if key == "rotation":
                value = tidy_rotation(value)
            elif isinstance(value, (list, tuple)) and key != "domain":
                value = [tidy(v) for v in value]
            elif isinstance(value, float):
                value = tidy(value)
            edit[key] = value
        self.edits.append(edit)


# The cliff faces +Z. Benches: floor height, how far back the face above it stands, and where the face ends.
BENCHES = [(0.0, 0.0), (2.6, -2.1), (5.0, -4.0), (7.2, -5.7)]
TOP = 9.4
WIDTH = 11.0  # half


BOULDERS = [  # radii, seed, where it lies, how it is turned, and its push
    ((0.42, 0.36, 0.40), 21, (-2.501, 3.002, -0.551), (-0.0018, 0, 0.0014, 1), (0.1, 0, 2.2)),
    ((0.34, 0.30, 0.38), 22, (0.899, 5.299, -2.601), (-0.0006, 0, 0.0014, 1), (-0.1, 0, 1.8)),
    ((0.30, 0.27, 0.31), 23, (3.307, 7.505, -4.501), (0.0002, -0.0002, -0.0126, 0.9999), (0.2, 0, 2.2)),
    ((0.38, 0.33, 0.36), 24, (8.092, 2.992, -0.471), (0.0471, -0.0006, 0.014, 0.9988), (0.1, 0, 1.1)),
    ((0.55, 0.48, 0.52), 25, (-9.447, 0.492, 2.281), (0.3381, -0.0131, 0.2002, 0.9195), None),
    ((0.33, 0.28, 0.30), 26, (-8.024, 0.277, 2.358), (-0.0336, 0.0381, 0.0584, 0.997), None),
    ((0.46, 0.40, 0.44), 27, (3.023, 0.447, 2.469), (0.4893, -0.0114, -0.1618, 0.8569), None),
    ((0.28, 0.25, 0.27), 28, (9.281, 0.254, 2.300), (0.2898, -0.0169, 0.0539, 0.9554), None),
]


def face_z(y):
    """Front of the rock at height y."""
    z = BENCHES[0][1]
    for floor, back in BENCHES:
        if y >= floor:
            z = back
    return z


def main():
    rnd = Random(20261)
    s = Scene()

    # Ground and rock body, bench by bench.
    s.add("ground", shape="plane", material="dust")
    for floor, back in BENCHES:
        top = TOP if floor == BENCHES[-1][0] else [f for f, _ in BENCHES if f > floor][0] + 0.02
        depth = (back + 8.5) / 2
        s.add("rock", shape="box", half_extents=[WIDTH, (top - floor) / 2 + 0.02, depth],
              position=[0, (top + floor) / 2, back - depth], blend_radius=0.25, material="limestone",
              domain=[{"warp": "displace", "amplitude": 0.16, "frequency": 0.9, "seed": 11 + int(floor)}])
    # A buttress left standing, and a gully.
    s.add("buttress", shape="rounded_box", half_extents=[1.3, 4.2, 1.6], rounding=0.3, position=[-6.2, 3.6, -1.2],
          rotation=quaternion([0, 1, 0], 18), blend_radius=0.8, material="limestone",
          domain=[{"warp": "displace", "amplitude": 0.18, "frequency": 1.1, "seed": 5}])
    s.add("gully", shape="capsule", half_height=4.5, radius=1.1, op="subtract", blend_radius=0.7,
          position=[5.4, 6.6, -3.6], rotation=quaternion([1, 0, 0.18], 38))

    # Strata: thin tilted layers of other stone. Paint changes no distance.
    tilt = quaternion([0, 0, 1], 4)
    y = 0.35
    while y < TOP + 0.6:
        thick = rnd.between(0.08, 0.3)
        s.add("layer", shape="box", op="paint", material_blend_radius=0.03, half_extents=[WIDTH + 3, thick, 12],
              position=[0, y, 0], rotation=tilt, material=rnd.choose(["ochre", "rust", "pale", "slate", "pale", "ochre"]))
        y += 2 * thick + rnd.between(0.12, 0.5)

    # The cuts: sawn steps, wedges broken out, drill holes, scars. Every one acts on the rock as it stood before it.
    def face_point(low=0.2, high=TOP):
        y = rnd.between(low, high)
        return rnd.between(-WIDTH + 0.6, WIDTH - 0.6), y, face_z(y)

    for _ in range(410):  # joints open along three directions: a cliff breaks into blocks
        x, y, z = face_point()
        size = rnd.between(0.16, 0.5)
        turn = product(quaternion([0, 1, 0], rnd.choose([8, 8, 52, -35]) + rnd.between(-7, 7)), quaternion([1, 0, 0.3], rnd.between(-9, 9)))
        s.add("block", shape="box", op="subtract", blend_radius=0.03,
              half_extents=[size * rnd.between(0.7, 1.5), size * rnd.between(0.5, 1.1), size * rnd.between(0.4, 0.9)],
              position=[x, y, z + rnd.between(-0.12, 0.22)], rotation=turn)
    for _ in range(70):  # the same on the buttress, whose front stands turned
        across, y, size = rnd.between(-1.5, 1.5), rnd.between(0.3, 7.9), rnd.between(0.14, 0.42)
        a = math.radians(18)
        out = 1.6 if abs(across) < 1.2 else rnd.between(0.3, 1.6)
        x, z = -6.2 + across * math.cos(a) + out * math.sin(a), -1.2 - across * math.sin(a) + out * math.cos(a)
        turn = product(quaternion([0, 1, 0], 18 + rnd.choose([0, 0, 45]) + rnd.between(-8, 8)), quaternion([1, 0, 0.3], rnd.between(-9, 9)))
        s.add("chip", shape="box", op="subtract", blend_radius=0.03,
              half_extents=[size * rnd.between(0.7, 1.6), size * rnd.between(0.4, 1.2), size * rnd.between(0.3, 0.7)],
              position=[x, y, z], rotation=turn)
    for _ in range(170):  # wedges
        x, y, z = face_point()
        size = rnd.between(0.2, 0.55)
        turn = product(quaternion([0, 1, 0], rnd.between(0, 360)), quaternion([1, 0, 0], rnd.between(20, 70)))
        s.add("wedge", shape="prism", sides=rnd.choose([3, 4, 5]), op="subtract", blend_radius=0.04, half_height=size * rnd.between(0.8, 1.9),
              radius=size, position=[x, y, z + rnd.between(-0.1, 0.2)], rotation=turn)
    for _ in range(150):  # spalls: shallow shells
        x, y, z = face_point()
        s.add("spall", shape="ellipsoid", op="subtract", blend_radius=0.08,
              radii=[rnd.between(0.3, 0.9), rnd.between(0.25, 0.7), rnd.between(0.1, 0.3)], position=[x, y, z + rnd.between(0.0, 0.2)],
              rotation=quaternion([0.2, 1, 0.1], rnd.between(-25, 25)))
    for floor, back in BENCHES:  # half barrels of drill holes, in rows down the sawn faces
        top = TOP if floor == BENCHES[-1][0] else [f for f, _ in BENCHES if f > floor][0]
        count = 44 if floor == 0 else 38
        for i in range(count):
            x = -WIDTH + 1.2 + (2 * WIDTH - 2.4) * i / (count - 1) + rnd.between(-0.06, 0.06)
            length = rnd.between(0.25, 0.55) * (top - floor)
            s.add("drill", shape="capsule", op="subtract", blend_radius=0.02, half_height=length / 2, radius=0.055,
                  position=[x, top - length / 2 - 0.05, back + 0.10])
    for _ in range(120):  # edges of the benches worn off
        floor, back = rnd.choose(BENCHES[1:] + [(TOP, BENCHES[-1][1])])
        x = rnd.between(-WIDTH + 0.5, WIDTH - 0.5)
        s.add("edge", shape="octahedron", op="subtract", blend_radius=0.08, radius=rnd.between(0.2, 0.6),
              position=[x, floor + 0.08, face_z(floor - 0.01) + 0.05], rotation=quaternion([0.3, 1, 0.6], rnd.between(0, 360)))
    # Ruts of the carts.
    for x in (1.1, 2.3):
        s.add("rut", shape="capsule", op="subtract", blend_radius=0.12, half_height=5.5, radius=0.13, position=[x, 0.04, 4.2],
              rotation=product(quaternion([0, 1, 0], 14), quaternion([1, 0, 0], 90)), material="mud")
    # A sump with water in it.
    s.add("sump", shape="ellipsoid", op="subtract", blend_radius=0.5, radii=[2.3, 0.6, 1.5], position=[-3.2, 0.02, 4.4], material="mud",
          domain=[{"warp": "displace", "amplitude": 0.35, "frequency": 0.8, "seed": 4}])
    s.add("water", shape="cylinder", half_height=0.3, radius=2.9, position=[-3.2, -0.47, 4.4], material="water")

    # Sawn blocks waiting, and rubble below the faces.
    for i, (x, z, turn) in enumerate([(5.2, 3.4, 12), (6.9, 3.0, 5), (6.0, 3.3, 8), (-8.2, 3.2, -20), (4.6, 5.6, 40)]):
        height = 1.52 if i == 2 else 0.5
        s.add("sawn", object="sawn_block", position=[x, height, z], rotation=quaternion([0, 1, 0], turn), material="pale")
    for i in range(110):
        floor, back = rnd.choose([BENCHES[0], BENCHES[0], BENCHES[0], BENCHES[1], BENCHES[2]])
        size = rnd.between(0.08, 0.34) * (1.25 if floor == 0 else 0.8)
        x = rnd.between(-WIDTH + 0.7, WIDTH - 0.7)
        z = back + size + abs(rnd.between(-1, 1)) ** 2 * (2.2 if floor == 0 else 1.2)
        turn = product(quaternion([0, 1, 0], rnd.between(0, 360)), quaternion([1, 0.4, 0.2], rnd.between(0, 60)))
        s.add("rubble", shape=rnd.choose(["rounded_box", "rounded_box", "octahedron", "icosahedron"]), position=[x, floor + size * 0.4, z],
              rotation=turn, blend_radius=0.05, material=rnd.choose(["limestone", "ochre", "pale", "slate"]))
        shape = s.edits[-1]
        if shape["shape"] == "rounded_box":
            shape["half_extents"] = [tidy(size * rnd.between(0.7, 1.2)), tidy(size * 0.75), tidy(size * rnd.between(0.6, 1))]
            shape["rounding"] = tidy(size * 0.12)
        else:
            shape["radius"] = tidy(size * 1.1)
    # Boulders: where they lie (what `kiln simulate` says after ten seconds), and those on the brinks with the push that sends them down.
    bodies = []
    for radii, seed, position, turn, push in BOULDERS:
        s.add("boulder", shape="ellipsoid", radii=list(radii), position=list(position), rotation=turn,
              material=rnd.choose(["limestone", "pale", "ochre", "slate"]),
              domain=[{"warp": "displace", "amplitude": tidy(0.12 * min(radii)), "frequency": 2.2, "seed": seed}])
        body = {"id": s.edits[-1]["id"], "edits": [s.edits[-1]["id"]], "density": 2600, "friction": 0.7}
        if push:
            body["linear_velocity"] = list(push)
            body["angular_velocity"] = [tidy(push[2] / radii[1]), 0, tidy(-push[0] / radii[1])]
        bodies.append(body)
    # Grass where nobody digs.
    s.add("grass", shape="box", op="paint", material_blend_radius=0.25, half_extents=[WIDTH + 1, 0.45, 4], position=[0, TOP + 0.28, -9.2], material="grass")

    scene = {
        "format": 1,
        "description": "a cliff worked back in benches by a thousand cuts",
        "field": {"voxel_size": 0.03},
        "materials": {
            "limestone": {"base_color": [0.40, 0.33, 0.25], "roughness": 0.85},
            "pale": {"base_color": [0.55, 0.47, 0.36], "roughness": 0.8},
            "ochre": {"base_color": [0.44, 0.25, 0.09], "roughness": 0.9},
            "rust": {"base_color": [0.34, 0.15, 0.08], "roughness": 0.9},
            "slate": {"base_color": [0.20, 0.21, 0.23], "roughness": 0.6},
            "dust": {"base_color": [0.34, 0.26, 0.18], "roughness": 0.95},
            "mud": {"base_color": [0.20, 0.14, 0.09], "roughness": 0.45},
            "water": {"base_color": [0.03, 0.09, 0.10], "roughness": 0.05},
            "grass": {"base_color": [0.13, 0.20, 0.05], "roughness": 0.95},
        },
        "objects": {
            "sawn_block": {"op": "subtract", "blend_radius": 0.02, "children": [
                {"shape": "rounded_box", "half_extents": [0.78, 0.5, 0.55], "rounding": 0.03},
                {"shape": "cylinder", "half_height": 0.6, "radius": 0.04, "position": [-0.4, 0.2, 0.56]},
                {"shape": "cylinder", "half_height": 0.6, "radius": 0.04, "position": [0, 0.2, 0.56]},
                {"shape": "cylinder", "half_height": 0.6, "radius": 0.04, "position": [0.4, 0.2, 0.56]}]},
        },
        "edits": s.edits,
        "physics": {"friction": 0.7, "rolling_friction": 0.3},
        "bodies": bodies,
        "lights": [{"type": "directional", "direction": [0.62, -0.66, -0.52], "illuminance": 4.6, "color": [1, 0.86, 0.66], "angular_diameter_deg": 0.8}],
        "environment": {"color": [0.30, 0.48, 0.85], "intensity": 0.7},
        "cameras": {
            "main": {"position": [-8.5, 6.6, 20.5], "target": [0.0, 3.45, -1.0], "fov_y_deg": 29.5},
            "face": {"position": [2.5, 3.0, 8.5], "target": [0.5, 3.6, -2.5], "fov_y_deg": 45},
        },
    }

    # One edit a line.
    lines = []
    for key, value in scene.items():
        if key == "edits":
            rows = ",\n".join("    " + json.dumps(e) for e in value)
            lines.append('  "edits": [\n%s\n  ]' % rows)
        elif isinstance(value, dict) and key in ("materials", "objects", "cameras"):
            rows = ",\n".join("    %s: %s" % (json.dumps(k), json.dumps(v)) for k, v in value.items())
            lines.append('  %s: {\n%s\n  }' % (json.dumps(key), rows))
        else:
            lines.append("  %s: %s" % (json.dumps(key), json.dumps(value)))
    print("{\n" + ",\n".join(lines) + "\n}")


if __name__ == "__main__":
    main()
