# SPDX-License-Identifier: MIT
# Builds scenes/*.kiln.json into the scene library (generated/scene/bundled.gen.inl) and installs them beside the documentation.

file(GLOB kiln_scene_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/scenes/*.kiln.json)
list(SORT kiln_scene_files)
set(kiln_scene_table "// SPDX-License-Identifier: MIT\n// Made by cmake/kiln_scenes.cmake from the files of scenes/. Do not edit.\n\nconstexpr char kVersion[] = \"${PROJECT_VERSION}\";\n")
set(kiln_scene_rows)
foreach(kiln_scene_file IN LISTS kiln_scene_files)
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${kiln_scene_file})
    get_filename_component(kiln_scene_name ${kiln_scene_file} NAME)
    string(REPLACE ".kiln.json" "" kiln_scene_name ${kiln_scene_name})
    file(READ ${kiln_scene_file} kiln_scene_text)
    string(APPEND kiln_scene_table "constexpr char k_${kiln_scene_name}[] = R\"kiln(${kiln_scene_text})kiln\";\n")
    string(APPEND kiln_scene_rows "    {\"${kiln_scene_name}\", {k_${kiln_scene_name}, sizeof(k_${kiln_scene_name}) - 1}},\n")
endforeach()
string(APPEND kiln_scene_table "\nconstexpr BundledScene kBundled[] = {\n${kiln_scene_rows}};\n")

set(kiln_scene_out ${PROJECT_BINARY_DIR}/generated/scene/bundled.gen.inl)
set(kiln_scene_old "")
if(EXISTS ${kiln_scene_out})
    file(READ ${kiln_scene_out} kiln_scene_old)
endif()
if(NOT kiln_scene_old STREQUAL kiln_scene_table)
    file(WRITE ${kiln_scene_out} "${kiln_scene_table}")
endif()

if(kiln_scene_files)
    install(FILES ${kiln_scene_files} DESTINATION ${CMAKE_INSTALL_DATADIR}/kiln/scenes)
endif()
