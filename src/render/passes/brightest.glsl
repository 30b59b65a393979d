// SPDX-License-Identifier: MIT
// Pictures of light are of half floats: what would be more than those hold is stored as this.
const float kBrightestStored = 65000.0;
