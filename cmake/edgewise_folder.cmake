# One target a folder. Includes are written from the repository root ("graph/extent.hpp"), but a
# target sees only its own folder and those that it links: each folder has an include root of its
# own that holds nothing but a link to it, so that a forbidden include does not compile.
#
#   edgewise_folder(NAME [PATH transitions/warp] SOURCES a.cpp ... LINKS edgewise::graph ... [PRIVATE_LINKS ...]
#                   [PRECOMPILED library|command|none])
function(edgewise_folder name)
    cmake_parse_arguments(FOLDER "" "PATH;PRECOMPILED" "SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
    if(NOT FOLDER_PATH)
        set(FOLDER_PATH ${name})
    endif()
    if(NOT FOLDER_PRECOMPILED)
        set(FOLDER_PRECOMPILED library)
        if(FOLDER_PATH MATCHES "^(cli|charts)")
            set(FOLDER_PRECOMPILED command)
        endif()
    endif()
    set(root ${PROJECT_BINARY_DIR}/roots/${name})
    cmake_path(GET FOLDER_PATH PARENT_PATH parent)
    file(MAKE_DIRECTORY ${root}/${parent})
    file(CREATE_LINK ${PROJECT_SOURCE_DIR}/${FOLDER_PATH} ${root}/${FOLDER_PATH} SYMBOLIC)

    # Its sources, for targets that compile them once more.
    set(sources ${FOLDER_SOURCES})
    list(TRANSFORM sources PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/ REGEX "^[^/]")
    set(edgewise_${name}_sources ${sources} CACHE INTERNAL "")

    set(target edgewise_${name})
    edgewise_joined(joined ${name} SOURCES ${FOLDER_SOURCES} ALONE ${EDGEWISE_REPLACED} ${EDGEWISE_REPLACED_ENGINE})
    add_library(${target} STATIC ${joined})
    add_library(edgewise::${name} ALIAS ${target})
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    target_compile_features(${target} PUBLIC cxx_std_20)
    target_include_directories(${target} PUBLIC
        $<BUILD_INTERFACE:${root}>
        $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/edgewise>)
    target_link_libraries(${target} PUBLIC ${FOLDER_LINKS} PRIVATE ${FOLDER_PRIVATE_LINKS})
    edgewise_warnings(${target})
    if(NOT FOLDER_PRECOMPILED STREQUAL none)
        edgewise_precompiled(${target} ${FOLDER_PRECOMPILED})
    endif()
    set_property(GLOBAL APPEND PROPERTY EDGEWISE_TARGETS ${target})
endfunction()

# Floating-point results must not depend on what a compiler contracts: fused operations are written.
function(edgewise_warnings target)
    target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wnon-virtual-dtor
        -ffp-contract=off $<$<BOOL:${EDGEWISE_WARNINGS_ARE_ERRORS}>:-Werror>)
    # GCC 12 sees overlapping or endless copies in any "text" + std::to_string(n) (its bug 105651).
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
        target_compile_options(${target} PRIVATE -Wno-restrict -Wno-stringop-overflow)
    endif()
endfunction()
