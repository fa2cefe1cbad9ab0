# Sources are compiled a few at a time, see joined_sources.py.
#
#   edgewise_joined(RESULT NAME SOURCES ... [MOST 8])
#
# RESULT is what a target is made of; NAME, its folder in the build. Sources that lie in the repository are
# included by their names from its root, so the target needs that name among its include paths. Alone stay
# those with vectors, which are compiled once more for every kind of processor, those with definitions of
# their own, and those that are made by the build.
option(EDGEWISE_JOINED "compile several sources as one" ON)
if(EDGEWISE_JOINED)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
endif()

function(edgewise_joined result name)
    cmake_parse_arguments(JOINED "" "MOST" "SOURCES" ${ARGN})
    if(NOT JOINED_MOST)
        set(JOINED_MOST 8)
    endif()
    set(together)
    set(made)
    foreach(source IN LISTS JOINED_SOURCES)
        cmake_path(ABSOLUTE_PATH source)
        get_source_file_property(definitions ${source} COMPILE_DEFINITIONS)
        cmake_path(IS_PREFIX PROJECT_BINARY_DIR ${source} of_the_build)
        if(NOT EDGEWISE_JOINED OR definitions OR of_the_build OR source MATCHES "_simd\\.cpp$")
            list(APPEND made ${source})
        else()
            cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR})
            list(APPEND together ${source})
        endif()
    endforeach()
    if(together)
        execute_process(COMMAND ${Python3_EXECUTABLE} ${PROJECT_SOURCE_DIR}/cmake/joined_sources.py
            ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/joined/${name} ${JOINED_MOST} ${together}
            OUTPUT_VARIABLE joined COMMAND_ERROR_IS_FATAL ANY)
        list(PREPEND made ${joined})
    endif()
    set(${result} ${made} PARENT_SCOPE)
endfunction()
