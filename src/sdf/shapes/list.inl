// SPDX-License-Identifier: MIT
// Every primitive, one line each: KILN_SHAPE(Type, name, how). `shapes/<name>.sdf.h` holds the rest.
// how: Exact (true distance outside the solid), Bound (1-Lipschitz lower bound), Sampled (also reads the program's samples),
// Formula (no distance text: compiled from Shape::data).
// Files store names, so the order is free.
KILN_SHAPE(Sphere, sphere, Exact)
KILN_SHAPE(Box, box, Exact)
KILN_SHAPE(RoundedBox, rounded_box, Exact)
KILN_SHAPE(BoxFrame, box_frame, Exact)
KILN_SHAPE(Torus, torus, Exact)
KILN_SHAPE(CappedTorus, capped_torus, Exact)
KILN_SHAPE(Link, link, Exact)
KILN_SHAPE(Capsule, capsule, Exact)
KILN_SHAPE(Cylinder, cylinder, Exact)
KILN_SHAPE(RoundedCylinder, rounded_cylinder, Exact)
KILN_SHAPE(Cone, cone, Exact)
KILN_SHAPE(Ellipsoid, ellipsoid, Exact)
KILN_SHAPE(Plane, plane, Exact)
KILN_SHAPE(Prism, prism, Exact)
KILN_SHAPE(Pyramid, pyramid, Exact)
KILN_SHAPE(Tetrahedron, tetrahedron, Exact)
KILN_SHAPE(Octahedron, octahedron, Exact)
KILN_SHAPE(Icosahedron, icosahedron, Exact)
KILN_SHAPE(CutSphere, cut_sphere, Exact)
KILN_SHAPE(SolidAngle, solid_angle, Exact)
KILN_SHAPE(Vesica, vesica, Exact)
KILN_SHAPE(Heightfield, heightfield, Sampled)
KILN_SHAPE(SampledMesh, mesh, Sampled)
KILN_SHAPE(Expression, expression, Formula)
