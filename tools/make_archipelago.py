#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes scenes/archipelago.kiln.json: islands with caves, stacks and trees, 4 km across, and cameras for a flight through them.

    tools/make_archipelago.py > scenes/archipelago.kiln.json
"""
import json
import math
import random

ISLANDS = 190
REACH = 1900.0  # metres from the middle
rng = random.Random(20)
edits = []


def r3(values):
    return [round(float(v), 2) for v in values]


def add(shape, position, **keys):
    edit = dict(shape)
    edit["position"] = r3(position)
    edit.update(keys)
    edits.append(edit)


def ellipsoid(a, b, c):
    return {"shape": "ellipsoid", "radii": r3((a, b, c))}


def turned(yaw, tilt=0.0):
    """Quaternion: a tilt about x after a turn about y."""
    y, t = yaw / 2, tilt / 2
    q = (math.cos(y) * math.sin(t), math.sin(y) * math.cos(t), -math.sin(y) * math.sin(t), math.cos(y) * math.cos(t))
    return [round(v, 5) for v in q]


def lane(z):
    """The middle of the open water that the flight follows."""
    return 70.0 * math.sin(z / 170.0)


def place_islands():
    """Middles and sizes, largest far out, none on the lane and no two on each other."""
    hero = [(62.0, 18.0, 62.0), (-74.0, -58.0, 55.0), (96.0, -190.0, 70.0), (-66.0, -300.0, 58.0)]
    out = list(hero)
    while len(out) < ISLANDS:
        angle, far = rng.uniform(0, 2 * math.pi), REACH * rng.uniform(0.03, 1) ** 0.8
        x, z = far * math.sin(angle), far * math.cos(angle)
        size = rng.uniform(24, 60) + 55 * rng.random() ** 3 * far / REACH
        if abs(x - lane(z)) < 0.75 * size + 26 and abs(z) < 1500:
            continue
        if any(math.hypot(x - a, z - b) < 0.62 * (size + s) for a, b, s in out):
            continue
        out.append((x, z, size))
    return out


def island(x, z, size):
    """What stands on one: mounds, cliffs, caves, then what is small."""
    first = len(edits)
    blend = round(min(0.1 * size, 5.0), 2)
    add(ellipsoid(0.92 * size, 2.2, 0.8 * size), (x, -0.7, z), material="sand", blend_radius=1.5, rotation=turned(rng.uniform(0, 3)))
    mounds = []
    for i in range(4):
        angle, far = rng.uniform(0, 6.28), (0.0 if i == 0 else rng.uniform(0.2, 0.42)) * size
        a, c = size * rng.uniform(0.26, 0.46), size * rng.uniform(0.24, 0.4)
        b = size * (rng.uniform(0.42, 0.62) if i == 0 else rng.uniform(0.18, 0.45))
        at = (x + far * math.sin(angle), -0.08 * b, z + far * math.cos(angle))
        add(ellipsoid(a, b, c), at, material="rock", blend_radius=blend, material_blend_radius=0.8)
        mounds.append((at, a, b, c))
    for i in range(3):  # slabs of harder stone
        (mx, my, mz), a, b, c = rng.choice(mounds)
        add({"shape": "rounded_box", "half_extents": r3((a * rng.uniform(0.3, 0.6), b * rng.uniform(0.25, 0.5), c * rng.uniform(0.2, 0.4))), "rounding": 0.8},
            (mx + rng.uniform(-0.5, 0.5) * a, my + rng.uniform(0.35, 0.75) * b, mz + rng.uniform(-0.5, 0.5) * c), material="slate",
            rotation=turned(rng.uniform(0, 3), rng.uniform(-0.35, 0.35)), blend_radius=1.2, material_blend_radius=0.6)
    # Grass lies above a height, as a stain that follows the ground.
    add({"shape": "ellipsoid", "radii": r3((0.66 * size, 0.55 * size, 0.62 * size))}, (x, 0.62 * size, z), op="paint", material="grass",
        material_blend_radius=2.5)
    for i in range(2):  # cliffs
        angle = rng.uniform(0, 6.28)
        add(ellipsoid(0.3 * size, 0.5 * size, 0.2 * size),
            (x + 0.72 * size * math.sin(angle), 0.24 * size, z + 0.72 * size * math.cos(angle)), op="subtract", material="cliff",
            rotation=turned(angle), blend_radius=1.5, material_blend_radius=0.5)
    for i in range(3):  # caves, at the water's edge or above
        (mx, my, mz), a, b, c = rng.choice(mounds)
        radius = rng.uniform(0.045, 0.085) * size
        add({"shape": "capsule", "half_height": round(1.3 * max(a, c), 2), "radius": round(radius, 2)},
            (mx, rng.uniform(0.2, 0.9) * radius + (0 if i == 0 else rng.uniform(0, 0.3) * b), mz), op="subtract", material="cave",
            rotation=turned(rng.uniform(0, 3.14), 1.57 + rng.uniform(-0.12, 0.12)), blend_radius=0.8, material_blend_radius=0.4)
    for i in range(4):  # stacks in the surf
        angle, far = rng.uniform(0, 6.28), rng.uniform(0.8, 1.05) * size
        height = rng.uniform(0.06, 0.2) * size
        add({"shape": "cone", "half_height": round(height, 2), "radius_bottom": round(0.42 * height, 2), "radius_top": round(0.2 * height, 2)},
            (x + far * math.sin(angle), 0.5 * height, z + far * math.cos(angle)), material="slate",
            rotation=turned(rng.uniform(0, 3), rng.uniform(-0.15, 0.15)), domain=[{"warp": "round", "radius": 0.5}], blend_radius=0.8)
    def ground():
        """A place on a mound, a little in it."""
        (mx, my, mz), a, b, c = rng.choice(mounds)
        u, v = rng.uniform(0, 6.28), math.sqrt(rng.uniform(0.02, 0.75))
        return mx + a * v * math.sin(u), my + b * math.sqrt(1 - v * v), mz + c * v * math.cos(u)
    for i in range(14):
        px, py, pz = ground()
        s = rng.uniform(0.5, 2.2)
        add({"shape": "sphere", "radius": 1}, (px, py + 0.2 * s, pz), scale=r3((s, 0.7 * s, 0.85 * s)), material="rock" if i % 2 else "slate",
            rotation=turned(rng.uniform(0, 3), rng.uniform(-0.4, 0.4)), blend_radius=0.25)
    for i in range(22):
        px, py, pz = ground()
        if py < 0.14 * size:
            continue
        s = rng.uniform(1.6, 3.4)
        add({"object": "pine"}, (px, py + 0.75 * s, pz), scale=round(s, 2), rotation=turned(rng.uniform(0, 6)))
    for i in range(3):
        angle, far = rng.uniform(0, 6.28), rng.uniform(0.7, 0.85) * size
        add({"shape": "rounded_box", "half_extents": r3((rng.uniform(0.5, 1.6), rng.uniform(0.4, 1), rng.uniform(0.5, 1.4))), "rounding": 0.3},
            (x + far * math.sin(angle), 1.0, z + far * math.cos(angle)), rotation=turned(rng.uniform(0, 3), rng.uniform(-0.5, 0.5)), material="slate")
    return len(edits) - first


for x, z, size in place_islands():
    island(x, z, size)
# The arch that the flight goes through, and lamps in the cave behind it.
gate = -118.0
add({"shape": "torus", "major_radius": 17, "minor_radius": 4.6}, (lane(gate), 2.0, gate), material="cliff", rotation=turned(0.12, 1.5708),
    blend_radius=1.5)
for side in (-1, 1):
    add(ellipsoid(9, 12, 8), (lane(gate) + 19 * side, 0, gate + 2 * side), material="rock", blend_radius=3, material_blend_radius=1)
for i in range(9):
    a = 0.35 + 0.3 * i
    add({"shape": "octahedron", "radius": 0.45}, (lane(gate) + 12.6 * math.cos(a), 2.0 + 12.6 * math.sin(a), gate + 0.4), material="lamp",
        rotation=turned(a, 0.4))

# Last, so that it fills what was cut.
add({"shape": "plane"}, (0, 0, 0), material="sea", id="sea")

cameras = {}


def camera(name, z, height, aim_z, aim_height, off=0.0, fov=52):
    cameras[name] = {"position": r3((lane(z) + off, height, z)), "target": r3((lane(aim_z), aim_height, aim_z)), "fov_y_deg": fov, "exposure": 1.15, "tone_map": "aces"}


camera("approach", 150, 17, -110, 8, -6, 46)
camera("shallows", 60, 7, -118, 9, 3)
camera("gate", -72, 6.5, -170, 10, 0)
camera("through", -128, 7.5, -280, 12, 0)
camera("sound", -230, 14, -460, 16, 4)
camera("rise", -380, 58, -900, 20, 0)
camera("horizon", -560, 120, -1400, 0, 0, 48)

scene = {
    "format": 1,
    "description": "islands, caves and open water to the horizon, to fly through",
    "field": {"voxel_size": 0.08, "levels": 8},
    "materials": {
        "rock": {"base_color": [0.2, 0.175, 0.15], "roughness": 0.9},
        "slate": {"base_color": [0.17, 0.18, 0.2], "roughness": 0.7},
        "cliff": {"base_color": [0.34, 0.28, 0.21], "roughness": 0.9},
        "cave": {"base_color": [0.24, 0.16, 0.12], "roughness": 0.8},
        "sand": {"base_color": [0.5, 0.4, 0.26], "roughness": 0.95},
        "grass": {"base_color": [0.1, 0.15, 0.04], "roughness": 0.95},
        "needles": {"base_color": [0.04, 0.1, 0.05], "roughness": 0.95},
        "bark": {"base_color": [0.12, 0.07, 0.04], "roughness": 0.9},
        "sea": {"base_color": [0.015, 0.07, 0.09], "roughness": 0.12},
        "lamp": {"base_color": [0.9, 0.6, 0.3], "roughness": 0.4, "emissive": [9, 4.5, 1.4]},
    },
    "objects": {
        "pine": {"op": "union", "blend_radius": 0.05, "children": [
            {"shape": "cylinder", "half_height": 0.5, "radius": 0.07, "position": [0, -0.55, 0], "material": "bark"},
            {"shape": "cone", "half_height": 0.42, "radius_bottom": 0.5, "radius_top": 0.08, "material": "needles"},
            {"shape": "cone", "half_height": 0.4, "radius_bottom": 0.36, "radius_top": 0.02, "position": [0, 0.5, 0], "material": "needles"}]},
    },
    "lights": [{"type": "directional", "direction": [-0.86, -0.36, -0.22], "illuminance": 4.6, "color": [1, 0.84, 0.64], "angular_diameter_deg": 0.9}],
    "cameras": cameras,
}
keys = list(scene.items())
print("{")
for name, value in keys:
    print(f"  {json.dumps(name)}: {json.dumps(value)},")
print('  "edits": [')
print(",\n".join("    " + json.dumps(e) for e in edits))
print("  ]\n}")
