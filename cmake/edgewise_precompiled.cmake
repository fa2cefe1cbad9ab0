# Precompiled headers: one a kind of target, made once and used by all of that kind.
#
#   edgewise_precompiled(TARGET library|command|tests|programs)
#
# A source still includes what it uses: the clang preset builds without precompiled headers, so a
# missing include shows there.
option(EDGEWISE_PRECOMPILED_HEADERS "read common headers once" ON)

# Optimisation by kind. Kernels and edges get all there is. The command and the tests wait for them, so
# there the time that a build takes counts for more.
set(edgewise_optimisation_library)
set(edgewise_optimisation_command $<$<CONFIG:Release>:-O1>)
set(edgewise_optimisation_tests $<$<CONFIG:Release>:-O1>)
set(edgewise_optimisation_programs $<$<CONFIG:Release>:-O1>)

# Programs are compiled as position-independent executables and libraries as shared code, and a
# precompiled header fits one of them. Its text names no folder of this machine, so that a compiler
# cache serves several clones.
if(EDGEWISE_PRECOMPILED_HEADERS)
    add_compile_definitions(BOOST_ALL_NO_LIB) # as Boost's target has it: one header serves all
    foreach(kind IN ITEMS library command tests programs)
        set(owner edgewise_precompiled_${kind})
        if(kind STREQUAL tests)
            if(NOT EDGEWISE_TESTS)
                continue()
            endif()
            find_package(GTest REQUIRED)
            add_executable(${owner} cmake/precompiled/empty.cpp)
            target_link_libraries(${owner} PRIVATE GTest::gtest)
        elseif(kind STREQUAL programs)
            add_executable(${owner} cmake/precompiled/empty.cpp)
        else()
            add_library(${owner} OBJECT cmake/precompiled/empty.cpp)
        endif()
        target_link_libraries(${owner} PRIVATE Eigen3::Eigen fmt::fmt Boost::headers TBB::tbb)
        target_include_directories(${owner} PRIVATE ${PROJECT_SOURCE_DIR}/cmake)
        target_compile_options(${owner} PRIVATE ${edgewise_optimisation_${kind}})
        edgewise_warnings(${owner})
        target_precompile_headers(${owner} PRIVATE <precompiled/${kind}.hpp>)
    endforeach()
endif()

function(edgewise_precompiled target kind)
    target_compile_options(${target} PRIVATE ${edgewise_optimisation_${kind}})
    if(EDGEWISE_PRECOMPILED_HEADERS)
        target_precompile_headers(${target} REUSE_FROM edgewise_precompiled_${kind})
    endif()
endfunction()
