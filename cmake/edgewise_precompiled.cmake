# Precompiled headers: one a kind of target, made once and used by all of that kind.
#
#   edgewise_precompiled(TARGET library|command|tests)
#
# A source still includes what it uses: the clang preset builds without precompiled headers, so a
# missing include shows there.
option(EDGEWISE_PRECOMPILED_HEADERS "read common headers once" ON)

# Optimisation by kind. Kernels and edges get all there is. The command and the tests wait for them, so
# there the time that a build takes counts for more.
set(edgewise_optimisation_library)
set(edgewise_optimisation_command $<$<CONFIG:Release>:-O2>)
set(edgewise_optimisation_tests $<$<CONFIG:Release>:-O1>)

function(edgewise_precompiled target kind)
    target_compile_options(${target} PRIVATE ${edgewise_optimisation_${kind}})
    if(NOT EDGEWISE_PRECOMPILED_HEADERS)
        return()
    endif()
    set(owner edgewise_precompiled_${kind})
    if(NOT TARGET ${owner})
        # Programs are compiled as position-independent executables, libraries as shared code, and
        # a precompiled header fits one of them.
        if(kind STREQUAL tests)
            add_executable(${owner} ${PROJECT_SOURCE_DIR}/cmake/precompiled/empty.cpp)
        else()
            add_library(${owner} OBJECT ${PROJECT_SOURCE_DIR}/cmake/precompiled/empty.cpp)
        endif()
        target_link_libraries(${owner} PRIVATE Eigen3::Eigen fmt::fmt)
        if(kind STREQUAL tests)
            target_link_libraries(${owner} PRIVATE GTest::gtest)
        endif()
        target_compile_options(${owner} PRIVATE ${edgewise_optimisation_${kind}})
        edgewise_warnings(${owner})
        target_precompile_headers(${owner} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled/${kind}.hpp)
    endif()
    target_precompile_headers(${target} REUSE_FROM ${owner})
endfunction()
