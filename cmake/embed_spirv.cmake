# SPDX-License-Identifier: MIT
# cmake -D IN=x.spv -D OUT=x.spv.h -D STEM=x -P embed_spirv.cmake: SPIR-V words as a C++ array.
file(READ ${IN} hex HEX)
# SPIR-V is little-endian: four bytes b0 b1 b2 b3 are the word 0xb3b2b1b0.
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
string(REGEX REPLACE "((0x........,){16})" "\\1\n" words "${words}")
string(REPLACE "_" ";" parts "${STEM}")
set(camel)
foreach(part IN LISTS parts)
    string(SUBSTRING ${part} 0 1 first)
    string(SUBSTRING ${part} 1 -1 rest)
    string(TOUPPER ${first} first)
    string(APPEND camel ${first}${rest})
endforeach()
file(WRITE ${OUT} "// Made from ${STEM} by cmake/embed_spirv.cmake.\n#pragma once\n\n#include <cstdint>\n\ninline constexpr uint32_t k${camel}Spv[] = {\n${words}};\n")
