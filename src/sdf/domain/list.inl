// SPDX-License-Identifier: MIT
// Every entry a `domain` stack may have, one line each: KILN_WARP(Type, name, kind). `domain/<name>.sdf.h` holds the rest.
// Point: moves the point before the shape sees it. Value: changes the distance. Copies: several points may see it, the nearest counts.
KILN_WARP(Twist, twist, Point)
KILN_WARP(Bend, bend, Copies)
KILN_WARP(Elongate, elongate, Point)
KILN_WARP(Mirror, mirror, Point)
KILN_WARP(Taper, taper, Point)
KILN_WARP(Round, round, Value)
KILN_WARP(Shell, shell, Value)
KILN_WARP(Displace, displace, Value)
KILN_WARP(Repeat, repeat, Copies)
