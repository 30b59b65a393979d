# SPDX-License-Identifier: MIT
# cmake -D IN=x.spv -D OUT=x.spv.h -D NAME=kX -P embed_spirv.cmake: SPIR-V words as a C++ array.
file(READ ${IN} hex HEX)
# SPIR-V is little-endian: four bytes b0 b1 b2 b3 are the word 0xb3b2b1b0.
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
string(REGEX REPLACE "((0x........,){16})" "\\1\n" words "${words}")
file(WRITE ${OUT} "// Made by cmake/embed_spirv.cmake.\n#pragma once\n\n#include <cstdint>\n\ninline constexpr uint32_t ${NAME}[] = {\n${words}};\n")
