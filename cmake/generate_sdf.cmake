# SPDX-License-Identifier: MIT
# Turns the shape, operation and warp lists of src/sdf into the include lists, dispatchers and tables of C++ and GLSL.
# Included by the root CMakeLists.txt (runs at configure time; lists and texts are configure dependencies).
# A parameter is a line `param name;  // = default unit, range: doc` inside `struct Type {` (src/sdf/lang/README.md).
# Outputs, under ${PROJECT_BINARY_DIR}/generated:
#   include/kiln/shapes.h      typed structs of the public interface
#   sdf/texts.gen.inl          C++: every text, and the dispatchers of one lane type
#   sdf/tables.gen.inl         C++: rows of names, fields, ranges
#   sdf/library.gen.inl        C++: composite_object()
#   sdf/texts.gen.glsl         GLSL: the same texts and dispatchers

set(kiln_sdf_dir ${PROJECT_SOURCE_DIR}/src/sdf)
set(kiln_gen_dir ${PROJECT_BINARY_DIR}/generated)

# Reads one list.inl. out: rows "Type|name|how".
function(kiln_sdf_read_list folder macro out)
    set(list_file ${kiln_sdf_dir}/${folder}/list.inl)
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${list_file})
    file(STRINGS ${list_file} lines REGEX "^${macro}\\(")
    set(rows)
    foreach(line IN LISTS lines)
        if(NOT line MATCHES "^${macro}\\(([A-Za-z0-9]+), ([a-z0-9_]+)(, [A-Za-z]+)?\\)")
            message(FATAL_ERROR "${list_file}: not a list row: ${line}")
        endif()
        set(row "${CMAKE_MATCH_1}|${CMAKE_MATCH_2}|${CMAKE_MATCH_3}")
        string(REPLACE "|, " "|" row "${row}")
        list(APPEND rows "${row}")
    endforeach()
    set(${out} "${rows}" PARENT_SCOPE)
endfunction()

# Reads the fields of `struct Type` in a text. Sets <prefix>_load (C++ braces), _glsl (constructor arguments), _public (struct members),
# _store (assignments to params), _rows (table), _doc (first comment line after the SPDX line).
function(kiln_sdf_read_text file type prefix)
    set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${file})
    file(READ ${file} text)
    string(REPLACE ";" "@" text "${text}")
    string(REGEX MATCH "\n// ([^\n]*)" head "${text}")
    set(doc "${CMAKE_MATCH_1}")
    string(REGEX MATCH "struct ${type} {([^}]*)}" body "${text}")
    if(NOT body)
        message(FATAL_ERROR "${file}: no `struct ${type} {`")
    endif()
    string(REGEX MATCHALL "[ \t]*param[23]? [a-z0-9_]+@[^\n]*" fields "${CMAKE_MATCH_1}")
    set(at 0)
    set(load)
    set(glsl)
    set(public)
    set(store)
    set(rows)
    foreach(field IN LISTS fields)
        set(pattern "^[ \t]*param([23]?) ([a-z0-9_]+)@[ \t]*// = (\\([^)]*\\)|[-0-9.e]+) ([a-z0-9/²]+), ([^:]+): (.*)$")
        if(NOT field MATCHES "${pattern}")
            message(FATAL_ERROR "${file}: not a parameter record: ${field}")
        endif()
        set(arity "${CMAKE_MATCH_1}")
        set(name "${CMAKE_MATCH_2}")
        set(default "${CMAKE_MATCH_3}")
        set(unit "${CMAKE_MATCH_4}")
        set(range "${CMAKE_MATCH_5}")
        set(field_doc "${CMAKE_MATCH_6}")
        string(REPLACE "\"" "\\\"" field_doc "${field_doc}")
        string(REGEX REPLACE "[() ]" "" defaults "${default}")
        string(REPLACE "," ";" defaults "${defaults}")
        list(TRANSFORM defaults REPLACE "^(-?[0-9]+)$" "\\1.0")
        list(TRANSFORM defaults APPEND "f")
        list(JOIN defaults ", " defaults)
        # The compiler fills these in; the public struct has no such member.
        set(member TRUE)
        if(range STREQUAL "internal")
            set(member FALSE)
        endif()
        if(arity STREQUAL "")
            set(arity 1)
            list(APPEND load "param(w[${at}])")
            list(APPEND glsl "sdf_param(at + ${at}u)")
            if(member)
                string(APPEND public "    float ${name} = ${defaults};  ///< ${unit}, ${range}: ${field_doc}\n")
                string(APPEND store "        out.params[${at}] = ${name};\n")
            endif()
        else()
            set(parts)
            set(glsl_parts)
            set(members x y z)
            foreach(i RANGE 1 ${arity})
                math(EXPR k "${at} + ${i} - 1")
                math(EXPR j "${i} - 1")
                list(GET members ${j} axis)
                list(APPEND parts "param(w[${k}])")
                list(APPEND glsl_parts "sdf_param(at + ${k}u)")
                if(member)
                    string(APPEND store "        out.params[${k}] = ${name}.${axis};\n")
                endif()
            endforeach()
            list(JOIN parts ", " parts)
            list(JOIN glsl_parts ", " glsl_parts)
            list(APPEND load "param${arity}(${parts})")
            list(APPEND glsl "param${arity}(${glsl_parts})")
            if(member)
                string(APPEND public "    vec${arity} ${name}{${defaults}};  ///< ${unit}, ${range}: ${field_doc}\n")
            endif()
        endif()
        string(APPEND rows "            {\"${name}\", ${arity}, ${at}, {${defaults}}, \"${unit}\", \"${range}\", \"${field_doc}\"},\n")
        math(EXPR at "${at} + ${arity}")
    endforeach()
    if(at GREATER 12)
        message(FATAL_ERROR "${file}: more than 12 numbers (kMaxParams)")
    endif()
    list(JOIN load ", " load)
    list(JOIN glsl ", " glsl)
    string(REPLACE "@" ";" doc "${doc}")
    string(REPLACE "\"" "\\\"" doc "${doc}")
    foreach(v load glsl public store rows doc at)
        set(${prefix}_${v} "${${v}}" PARENT_SCOPE)
    endforeach()
endfunction()

function(kiln_sdf_write path content)
    set(old "")
    if(EXISTS ${path})
        file(READ ${path} old)
    endif()
    if(NOT old STREQUAL content)
        file(WRITE ${path} "${content}")
    endif()
endfunction()

function(kiln_generate_sdf)
    set(note "// SPDX-License-Identifier: MIT\n// Made by cmake/generate_sdf.cmake from the lists of src/sdf. Do not edit.\n\n")
    kiln_sdf_read_list(shapes KILN_SHAPE shapes)
    kiln_sdf_read_list(library KILN_COMPOSITE composites)
    kiln_sdf_read_list(ops KILN_OP ops)
    kiln_sdf_read_list(domain KILN_WARP warps)

    set(includes "#include \"sdf/ops/kernel.sdf.h\"\n#include \"sdf/shapes/common.sdf.h\"\n")
    foreach(pair "ops:ops" "shapes:shapes" "domain:warps")
        string(REPLACE ":" ";" pair "${pair}")
        list(GET pair 0 folder)
        list(GET pair 1 list_name)
        foreach(row IN LISTS ${list_name})
            string(REPLACE "|" ";" row "${row}")
            list(GET row 1 name)
            string(APPEND includes "#include \"sdf/${folder}/${name}.sdf.h\"\n")
        endforeach()
    endforeach()

    set(kinds)
    set(structs)
    set(table "constexpr KindRow kShapeRows[] = {\n")
    set(cpp_shape)
    set(glsl_shape)
    set(cpp_bounds)
    set(kind 0)
    foreach(row IN LISTS shapes)
        string(REPLACE "|" ";" row "${row}")
        list(GET row 0 type)
        list(GET row 1 name)
        list(GET row 2 how)
        kiln_sdf_read_text(${kiln_sdf_dir}/shapes/${name}.sdf.h ${type} t)
        set(samples "")
        set(glsl_samples "")
        if(how STREQUAL "Sampled")
            set(samples ", samples")
            set(glsl_samples ", samples")
        endif()
        set(parameters ", ${type}{${t_load}}")
        set(glsl_parameters ", ${type}(${t_glsl})")
        set(bounds_parameters "${type}{${t_load}}")
        if(t_at EQUAL 0)  # GLSL has no empty structs: the texts of a shape without parameters take none
            set(parameters)
            set(glsl_parameters)
            set(bounds_parameters)
        endif()
        if(how STREQUAL "Formula")  # compiled from the text in Shape::data: no distance function
            string(PREPEND t_public "    std::string expression{};  ///< the formula, or `file:` and the name of a .vm model\n")
            string(APPEND t_store "        out.data = expression;\n")
        else()
            string(APPEND cpp_shape "    case ${kind}: return sd_${name}(p${parameters}${samples});\n")
            string(APPEND glsl_shape "    case ${kind}u: if (KILN_USES_SHAPE(${kind}u)) return sd_${name}(p${glsl_parameters}${glsl_samples}); break;\n")
        endif()
        string(APPEND cpp_bounds "    case ${kind}: return bounds_${name}(${bounds_parameters});\n")
        string(APPEND kinds "    ${type} = ${kind},\n")
        string(APPEND table "    {\"${name}\", KindRow::${how}, \"${t_doc}\",\n        {{\n${t_rows}        }}},\n")
        string(APPEND structs "/// ${t_doc}\nstruct ${type} {\n${t_public}    operator Shape() const {\n        Shape out;\n        out.kind = uint16_t(ShapeKind::${type});\n${t_store}        return out;\n    }\n};\n")
        math(EXPR kind "${kind} + 1")
    endforeach()
    set(primitive_count ${kind})
    set(builder_includes)
    set(builders)
    foreach(row IN LISTS composites)
        string(REPLACE "|" ";" row "${row}")
        list(GET row 0 type)
        list(GET row 1 name)
        kiln_sdf_read_text(${kiln_sdf_dir}/library/${name}.h ${type}Record t)
        string(APPEND builder_includes "#include \"sdf/library/${name}.h\"\n")
        string(APPEND builders "    case ${kind}: return ${name}_object(record_of<${type}Record>(params));\n")
        string(APPEND kinds "    ${type} = ${kind},\n")
        string(APPEND table "    {\"${name}\", KindRow::Composite, \"${t_doc}\",\n        {{\n${t_rows}        }}},\n")
        string(APPEND structs "/// ${t_doc}\nstruct ${type} {\n${t_public}    operator Shape() const {\n        Shape out;\n        out.kind = uint16_t(ShapeKind::${type});\n${t_store}        return out;\n    }\n};\n")
        math(EXPR kind "${kind} + 1")
    endforeach()
    string(APPEND table "};\n\nconstexpr KindRow kWarpRows[] = {\n")

    set(warp_kinds)
    set(cpp_point)
    set(cpp_value)
    set(cpp_copies)
    set(glsl_point)
    set(glsl_value)
    set(glsl_copies)
    set(cpp_second)
    set(cpp_warp_bounds)
    set(cpp_warp_lipschitz)
    set(kind 0)
    foreach(row IN LISTS warps)
        string(REPLACE "|" ";" row "${row}")
        list(GET row 0 type)
        list(GET row 1 name)
        list(GET row 2 how)
        kiln_sdf_read_text(${kiln_sdf_dir}/domain/${name}.sdf.h ${type} t)
        if(how STREQUAL "Point")
            string(APPEND cpp_point "    case ${kind}: return warp_${name}(p, ${type}{${t_load}});\n")
            string(APPEND glsl_point "    case ${kind}u: if (KILN_USES_WARP(${kind}u)) return warp_${name}(p, ${type}(${t_glsl})); break;\n")
        elseif(how STREQUAL "Value")
            string(APPEND cpp_value "    case ${kind}: return value_${name}(d, p, ${type}{${t_load}});\n")
            string(APPEND glsl_value "    case ${kind}u: if (KILN_USES_WARP(${kind}u)) return value_${name}(d, p, ${type}(${t_glsl})); break;\n")
        else()
            string(APPEND cpp_copies "    case ${kind}: return copy_${name}(p, ${type}{${t_load}}, middle, second);\n")
            string(APPEND cpp_second "    case ${kind}: return second_${name}(${type}{${t_load}}, region);\n")
            string(APPEND glsl_copies "    case ${kind}u: if (KILN_USES_WARP(${kind}u)) return copy_${name}(p, ${type}(${t_glsl}), middle, second); break;\n")
        endif()
        string(APPEND cpp_warp_bounds "    case ${kind}: return bounds_${name}(${type}{${t_load}}, child);\n")
        string(APPEND cpp_warp_lipschitz "    case ${kind}: return lipschitz_${name}(${type}{${t_load}}, region);\n")
        string(APPEND warp_kinds "    ${type} = ${kind},\n")
        string(APPEND table "    {\"${name}\", KindRow::${how}, \"${t_doc}\",\n        {{\n${t_rows}        }}},\n")
        string(APPEND structs "/// ${t_doc}\nstruct ${type} {\n${t_public}    operator Warp() const {\n        Warp out;\n        out.kind = uint16_t(WarpKind::${type});\n${t_store}        return out;\n    }\n};\n")
        math(EXPR kind "${kind} + 1")
    endforeach()
    string(APPEND table "};\n")

    set(cpp_op)
    set(cpp_share)
    set(kind 0)
    foreach(row IN LISTS ops)
        string(REPLACE "|" ";" row "${row}")
        list(GET row 1 name)
        string(APPEND cpp_op "    case ${kind}: return op_${name}(a, b, k);\n")
        string(APPEND cpp_share "    case ${kind}: return share_${name}(a, b, k);\n")
        math(EXPR kind "${kind} + 1")
    endforeach()
    string(REGEX REPLACE "case ([0-9]+):" "case \\1u:" glsl_op "${cpp_op}")
    string(REGEX REPLACE "case ([0-9]+):" "case \\1u:" glsl_share "${cpp_share}")

    kiln_sdf_write(${kiln_gen_dir}/include/kiln/shapes.h "${note}// Typed shapes and warps: `edit.node.shape = kiln::Sphere{.radius = 1}`.
#pragma once

#include <kiln/edit.h>

namespace kiln {

enum class ShapeKind : uint16_t {
${kinds}};

enum class WarpKind : uint16_t {
${warp_kinds}};

${structs}
}  // namespace kiln
")
    kiln_sdf_write(${kiln_gen_dir}/sdf/tables.gen.inl "${note}inline constexpr int kPrimitiveCount = ${primitive_count};\n${table}")
    kiln_sdf_write(${kiln_gen_dir}/sdf/library.gen.inl "${note}${builder_includes}
namespace kiln::sdf {
Object composite_object(uint16_t kind, const std::array<float, kMaxParams>& params) {
    switch (kind) {
${builders}    }
    KILN_ASSERT(false, \"kind {} is no composite\", kind);
    return {};
}
}  // namespace kiln::sdf
")
    kiln_sdf_write(${kiln_gen_dir}/sdf/texts.gen.inl "${note}${includes}
KILN_SDF real shape_distance(uint32_t kind, real3 p, const float* w, Samples samples) {
    (void)samples;
    switch (kind) {
${cpp_shape}    }
    __builtin_unreachable();
}
KILN_SDF real3 point_warp(uint32_t kind, real3 p, const float* w) {
    switch (kind) {
${cpp_point}    }
    __builtin_unreachable();
}
KILN_SDF real value_warp(uint32_t kind, real d, real3 p, const float* w) {
    switch (kind) {
${cpp_value}    }
    __builtin_unreachable();
}
KILN_SDF real3 copy_warp(uint32_t kind, real3 p, const float* w, param3 middle, param3 second) {
    switch (kind) {
${cpp_copies}    }
    __builtin_unreachable();
}
KILN_SDF real op_distance(uint32_t op, real a, real b, param k) {
    switch (op) {
${cpp_op}    }
    __builtin_unreachable();
}
KILN_SDF real op_share(uint32_t op, real a, real b, param k) {
    switch (op) {
${cpp_share}    }
    __builtin_unreachable();
}
#ifdef KILN_HOST
KILN_SDF Bounds shape_bounds(uint32_t kind, const float* w) {
    switch (kind) {
${cpp_bounds}    }
    __builtin_unreachable();
}
KILN_SDF Bounds warp_bounds(uint32_t kind, const float* w, Bounds child) {
    switch (kind) {
${cpp_warp_bounds}    }
    __builtin_unreachable();
}
KILN_SDF param3 second_copies(uint32_t kind, const float* w, Bounds region) {
    switch (kind) {
${cpp_second}    }
    return param3(0.0f, 0.0f, 0.0f);
}
KILN_SDF param warp_lipschitz(uint32_t kind, const float* w, Bounds region) {
    switch (kind) {
${cpp_warp_lipschitz}    }
    __builtin_unreachable();
}
#endif
")
    kiln_sdf_write(${kiln_gen_dir}/sdf/texts.gen.glsl "${note}${includes}
float shape_distance(uint kind, vec3 p, uint at, uint samples) {
    switch (kind) {
${glsl_shape}    }
    return 0.0;
}
vec3 point_warp(uint kind, vec3 p, uint at) {
    switch (kind) {
${glsl_point}    }
    return p;
}
float value_warp(uint kind, float d, vec3 p, uint at) {
    switch (kind) {
${glsl_value}    }
    return d;
}
vec3 copy_warp(uint kind, vec3 p, uint at, vec3 middle, vec3 second) {
    switch (kind) {
${glsl_copies}    }
    return p;
}
float op_distance(uint op, float a, float b, float k) {
    switch (op) {
${glsl_op}    }
    return a;
}
float op_share(uint op, float a, float b, float k) {
    switch (op) {
${glsl_share}    }
    return 0.0;
}
")
endfunction()

kiln_generate_sdf()
