# Sources are compiled a few at a time, see joined_sources.py.
#
#   edgewise_joined(RESULT NAME SOURCES ... [ALONE ...] [MOST 8])
#
# RESULT is what a target is made of; NAME, its folder in the build. Sources that lie in the repository are
# included by their names from its root, so the target needs that name among its include paths. Alone stay
# those with vectors, which are compiled once more for every kind of processor, those with definitions of
# their own, those that are made by the build, and those of ALONE (from the root of the repository).
option(EDGEWISE_JOINED "compile several sources as one" ON)
if(EDGEWISE_JOINED)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
endif()

# Sources that tests compile once more, under a sanitizer, and link in place of those of the libraries: an
# object of a library must define nothing beside them.
set(EDGEWISE_REPLACED graph/data.cpp graph/job.cpp graph/modes/modes.cpp graph/small_objects.cpp
    runtime/flow.cpp runtime/kept_arena.cpp runtime/memory_budget.cpp runtime/one_thread_a_core.cpp
    runtime/program.cpp
    transitions/filters/filters.cpp transitions/kernels/fourier.cpp transitions/kernels/kaiser_bessel.cpp
    transitions/kernels/spectrum_slice.cpp transitions/kernels/tap_polynomials.cpp
    transitions/project/parallel_product.cpp)
set(EDGEWISE_REPLACED_ENGINE engine/prepared.cpp)

function(edgewise_joined result name)
    cmake_parse_arguments(JOINED "" "MOST" "SOURCES;ALONE" ${ARGN})
    if(NOT JOINED_MOST)
        set(JOINED_MOST 8)
    endif()
    set(together)
    set(made)
    foreach(source IN LISTS JOINED_SOURCES)
        cmake_path(ABSOLUTE_PATH source)
        get_source_file_property(definitions ${source} COMPILE_DEFINITIONS)
        cmake_path(IS_PREFIX PROJECT_BINARY_DIR ${source} of_the_build)
        cmake_path(RELATIVE_PATH source BASE_DIRECTORY ${PROJECT_SOURCE_DIR} OUTPUT_VARIABLE named)
        if(NOT EDGEWISE_JOINED OR definitions OR of_the_build OR source MATCHES "_simd\\.cpp$" OR
           named IN_LIST JOINED_ALONE)
            list(APPEND made ${source})
        else()
            list(APPEND together ${named})
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
