// SPDX-License-Identifier: MIT
// Every composite shape, one line each: KILN_COMPOSITE(Type, name). `library/<name>.h` holds its record `<Type>Record` and
// `Object <name>_object(const <Type>Record&)`, a tree of primitives. Nodes carry no materials: they take the placing edit's.
KILN_COMPOSITE(Planet, planet)
KILN_COMPOSITE(Spaceship, spaceship)
KILN_COMPOSITE(Bullet, bullet)
KILN_COMPOSITE(Ghost, ghost)
