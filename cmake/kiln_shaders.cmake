# SPDX-License-Identifier: MIT
# Shaders: GLSL -> SPIR-V (glslc) -> checked (spirv-val) -> a generated header `shaders/<stem>.spv.h` with
# `inline constexpr uint32_t k<CamelStem>Spv[]`. The stem of foo.comp is foo, of foo.vert foo_vert,
# of foo.frag foo_frag, and so on.

# kiln_shaders(NAME [FOLDER folder] [TARGET target]): every shader under src/NAME (or FOLDER), made before kiln_NAME (or TARGET) is compiled.
function(kiln_shaders name)
    cmake_parse_arguments(arg "" "FOLDER;TARGET" "" ${ARGN})
    if(NOT arg_FOLDER)
        set(arg_FOLDER ${PROJECT_SOURCE_DIR}/src/${name})
        set(arg_TARGET kiln_${name})
    endif()
    file(GLOB_RECURSE shaders CONFIGURE_DEPENDS ${arg_FOLDER}/*.comp ${arg_FOLDER}/*.vert ${arg_FOLDER}/*.frag
        ${arg_FOLDER}/*.mesh ${arg_FOLDER}/*.rgen ${arg_FOLDER}/*.rint ${arg_FOLDER}/*.rchit ${arg_FOLDER}/*.rmiss)
    if(NOT shaders)
        return()
    endif()
    foreach(program GLSLC:glslc SPIRV_VAL:spirv-val SPIRV_CROSS:spirv-cross)
        string(REPLACE ":" ";" program ${program})
        list(GET program 0 variable)
        list(GET program 1 tool)
        find_program(KILN_${variable} ${tool} REQUIRED)
    endforeach()

    set(headers)
    foreach(shader IN LISTS shaders)
        get_filename_component(stem ${shader} NAME_WE)
        get_filename_component(stage ${shader} LAST_EXT)
        if(NOT stage STREQUAL ".comp")
            string(REPLACE "." "_" stage ${stage})
            string(APPEND stem ${stage})
        endif()
        set(spv ${KILN_GENERATED}/shaders/${stem}.spv)
        get_property(taken GLOBAL PROPERTY KILN_SHADER_STEM_${stem})
        if(taken)
            message(FATAL_ERROR "${shader} and ${taken} would both make ${spv}.h; rename one")
        endif()
        set_property(GLOBAL PROPERTY KILN_SHADER_STEM_${stem} ${shader})
        add_custom_command(
            OUTPUT ${spv}
            COMMAND ${KILN_GLSLC} --target-env=vulkan1.3 -O -Werror -I ${PROJECT_SOURCE_DIR}/src -I ${KILN_GENERATED}
                    -MD -MF ${spv}.d -o ${spv} ${shader}
            COMMAND ${KILN_SPIRV_VAL} --target-env vulkan1.3 ${spv}
            DEPENDS ${shader}
            DEPFILE ${spv}.d
            COMMENT "Shader ${stem}"
            VERBATIM)
        string(REPLACE "_" ";" parts ${stem})
        set(camel)
        foreach(part IN LISTS parts)
            string(SUBSTRING ${part} 0 1 letter)
            string(SUBSTRING ${part} 1 -1 rest)
            string(TOUPPER ${letter} letter)
            string(APPEND camel ${letter}${rest})
        endforeach()
        add_custom_command(
            OUTPUT ${spv}.h
            COMMAND ${CMAKE_COMMAND} -D IN=${spv} -D OUT=${spv}.h -D NAME=k${camel}Spv -P ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake
            DEPENDS ${spv} ${PROJECT_SOURCE_DIR}/cmake/embed_spirv.cmake
            VERBATIM)
        list(APPEND headers ${spv}.h)
        file(RELATIVE_PATH within ${PROJECT_SOURCE_DIR}/src ${shader})
        string(APPEND list_includes "#include \"shaders/${stem}.spv.h\"\n")
        string(APPEND list_rows "    {\"${within}\", k${camel}Spv},\n")
        set_property(GLOBAL APPEND PROPERTY KILN_SPIRV ${spv})
        # HLSL has ray-tracing stages, but spirv-cross does not write them.
        if(stage MATCHES "^_(rgen|rint|rchit|rmiss)$")
            set_property(GLOBAL APPEND PROPERTY KILN_SPIRV_RAYS ${spv})
        endif()
    endforeach()
    # Which words were made from which file, for live_shaders.h.
    file(CONFIGURE OUTPUT ${KILN_GENERATED}/shaders/list_of_${arg_TARGET}.h @ONLY CONTENT
"// Made by cmake/kiln_shaders.cmake.
#pragma once

@list_includes@
inline constexpr ShaderSource kShaderSources[] = {
@list_rows@};
")
    add_custom_target(${arg_TARGET}_shaders DEPENDS ${headers})
    add_dependencies(${arg_TARGET} ${arg_TARGET}_shaders)
    target_include_directories(${arg_TARGET} PRIVATE ${KILN_GENERATED})
endfunction()

# Target kiln_shader_checks: every module through spirv-val and, but for those of ray tracing, spirv-cross --hlsl (proof that other backends
# stay possible; mesh shaders need shader model 6.5 there).
function(kiln_shader_checks)
    get_property(spirv GLOBAL PROPERTY KILN_SPIRV)
    get_property(rays GLOBAL PROPERTY KILN_SPIRV_RAYS)
    set(checks)
    foreach(spv IN LISTS spirv)
        list(APPEND checks COMMAND ${KILN_SPIRV_VAL} --target-env vulkan1.3 ${spv})
        set(model 60)
        if(spv MATCHES "_mesh[.]spv$")
            set(model 65)
        endif()
        if(NOT spv IN_LIST rays)
            list(APPEND checks COMMAND ${KILN_SPIRV_CROSS} --hlsl --shader-model ${model} --output ${spv}.hlsl ${spv})
        endif()
    endforeach()
    list(LENGTH spirv count)
    list(LENGTH rays left_out)
    add_custom_target(kiln_shader_checks ${checks}
        COMMAND ${CMAKE_COMMAND} -E echo "${count} shader modules: spirv-val and spirv-cross --hlsl passed (not --hlsl: ${left_out} of ray tracing)"
        DEPENDS ${spirv} VERBATIM)
endfunction()
