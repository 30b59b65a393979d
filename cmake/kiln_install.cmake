# SPDX-License-Identifier: MIT
# `cmake --install`: headers, static libraries, the programs, find_package(kiln [COMPONENTS module…]) and kiln.pc.
include(CMakePackageConfigHelpers)

get_property(kiln_built GLOBAL PROPERTY KILN_MODULES)
get_property(kiln_apps GLOBAL PROPERTY KILN_APPS)
set(kiln_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/kiln)
list(TRANSFORM kiln_built PREPEND kiln_ OUTPUT_VARIABLE kiln_targets)

install(TARGETS kiln ${kiln_targets} EXPORT kilnTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
if(kiln_apps)
    install(TARGETS ${kiln_apps} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()
install(DIRECTORY include/kiln ${KILN_GENERATED}/include/kiln DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
install(EXPORT kilnTargets NAMESPACE kiln:: DESTINATION ${kiln_cmake_dir})
if(EXISTS ${PROJECT_SOURCE_DIR}/LICENSE)
    install(FILES LICENSE THIRD_PARTY.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
endif()

get_property(packages GLOBAL PROPERTY KILN_FIND_DEPENDENCIES)
list(REMOVE_DUPLICATES packages)
set(KILN_FIND_LINES)
foreach(package IN LISTS packages)
    string(APPEND KILN_FIND_LINES "find_dependency(${package})\n")
endforeach()
list(JOIN kiln_built " " KILN_COMPONENTS)
configure_package_config_file(cmake/kilnConfig.cmake.in ${PROJECT_BINARY_DIR}/kilnConfig.cmake INSTALL_DESTINATION ${kiln_cmake_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/kilnConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/kilnConfig.cmake ${PROJECT_BINARY_DIR}/kilnConfigVersion.cmake DESTINATION ${kiln_cmake_dir})

# pkg-config: higher modules first, so that a linker that looks once finds everything.
get_property(KILN_PC_REQUIRES GLOBAL PROPERTY KILN_PC_REQUIRES)
get_property(pc_libs GLOBAL PROPERTY KILN_PC_LIBS)
list(REMOVE_DUPLICATES KILN_PC_REQUIRES)
list(JOIN KILN_PC_REQUIRES ", " KILN_PC_REQUIRES)
set(kiln_link ${kiln_built})
list(REVERSE kiln_link)
list(TRANSFORM kiln_link PREPEND "-lkiln_")
list(APPEND kiln_link ${pc_libs})
list(JOIN kiln_link " " KILN_PC_LIBS)
file(RELATIVE_PATH KILN_PC_TO_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)  # so that the tree may be moved
string(REGEX REPLACE "/$" "" KILN_PC_TO_PREFIX "${KILN_PC_TO_PREFIX}")
configure_file(cmake/kiln.pc.in ${PROJECT_BINARY_DIR}/kiln.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/kiln.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
