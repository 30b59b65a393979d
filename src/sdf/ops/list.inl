// SPDX-License-Identifier: MIT
// Every way an operand b acts on what came before it, a. `ops/<name>.sdf.h` holds the rest. The order is that of kiln::Op.
KILN_OP(Union, union)
KILN_OP(Subtract, subtract)
KILN_OP(Intersect, intersect)
