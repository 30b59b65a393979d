# SPDX-License-Identifier: MIT
# Flags of everything we compile. Nothing here reaches a consumer of the installed library.

if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_INTERPROCEDURAL_OPTIMIZATION OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

# Stored values are the same bytes on every machine: no fused multiply-add behind our back.
add_compile_options(-ffp-contract=off)
if(NOT KILN_SANITIZE)  # the other builds have said it all
    add_compile_options(-Wall -Wextra -Wconversion -Wshadow)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    add_compile_options(-Wno-restrict)  # false alarm on `"x" + std::string` (GCC bug 105651)
endif()
if(KILN_WERROR)
    add_compile_options(-Werror)
endif()

find_program(KILN_CCACHE ccache)
if(KILN_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
    set(CMAKE_CXX_COMPILER_LAUNCHER ${KILN_CCACHE})
endif()

if(KILN_SANITIZE)
    add_compile_options(-fsanitize=${KILN_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
    add_link_options(-fsanitize=${KILN_SANITIZE})
endif()

# kiln_together(TARGET FILES): compiles eight at a time where KILN_TOGETHER is on. Files that set macros stay alone: the texts shared with
# shaders are read once for each language. Preset dev compiles each file by itself, which shows what one forgot to include.
function(kiln_together target files)
    if(NOT KILN_TOGETHER)
        return()
    endif()
    foreach(file IN LISTS files)
        file(STRINGS ${file} macros REGEX "^#define " LIMIT_COUNT 1)
        if(macros)
            set_source_files_properties(${file} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
        endif()
    endforeach()
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 8)
    if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
        target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # of types in a file that is not the main one
    endif()
endfunction()
