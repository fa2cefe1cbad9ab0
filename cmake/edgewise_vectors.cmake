# Which instructions sources with vectors (*_simd.cpp) are compiled for. Each set compiles them once more.
#
#   EDGEWISE_SIMD=all     SSE4, AVX2, AVX-512 and plain loops, or what else Highway has for the kind of processor;
#                         a program takes the best when it starts. For packages: the preset `package`.
#   EDGEWISE_SIMD=native  the best that the processor which builds has, and nothing else. All other presets.
#   EDGEWISE_SIMD=avx2 and so on: this one alone, for comparisons.
#
#   edgewise_vectors(TARGET)
set(EDGEWISE_SIMD all CACHE STRING "instructions of kernels: all, native, or one of sse4, avx2, avx3")
set_property(CACHE EDGEWISE_SIMD PROPERTY STRINGS all native sse4 avx2 avx3)

if(NOT EDGEWISE_SIMD MATCHES "^(all|native|sse4|avx2|avx3)$")
    message(FATAL_ERROR "EDGEWISE_SIMD=${EDGEWISE_SIMD}: expected all, native, sse4, avx2 or avx3 (AVX-512)")
endif()
set(edgewise_simd ${EDGEWISE_SIMD})
if(EDGEWISE_SIMD STREQUAL native)
    # Of other kinds of processors the compiler's own set is the best there is.
    set(edgewise_simd static)
    if(CMAKE_CROSSCOMPILING)
        set(edgewise_simd all)
    elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64|i.86")
        try_run(edgewise_simd_ran edgewise_simd_compiled ${PROJECT_BINARY_DIR}/simd
            SOURCES ${PROJECT_SOURCE_DIR}/cmake/best_vectors.cpp
            LINK_LIBRARIES ${HWY_LINK_LIBRARIES}
            RUN_OUTPUT_VARIABLE edgewise_simd_said)
        if(edgewise_simd_compiled AND edgewise_simd_ran EQUAL 0)
            set(edgewise_simd ${edgewise_simd_said})
        else()
            message(WARNING "cannot tell what this processor has: kernels are compiled for all")
            set(edgewise_simd all)
        endif()
    endif()
endif()
message(STATUS "Instructions of kernels: ${edgewise_simd}")

# Kernels of one set need Highway's headers alone. To load its library takes 6 ms of each process (1.0.3).
set(edgewise_hwy_is_headers OFF)
if(NOT edgewise_simd STREQUAL all)
    set(edgewise_hwy_is_headers ON)
    set_property(TARGET PkgConfig::HWY PROPERTY INTERFACE_LINK_LIBRARIES "")
endif()

function(edgewise_vectors target)
    # A precompiled header brings templates that are made once more for each set, and the processor's own
    # header without what silences its warnings.
    get_target_property(sources ${target} SOURCES)
    list(FILTER sources INCLUDE REGEX "_simd\\.cpp$")
    set_source_files_properties(${sources} PROPERTIES SKIP_PRECOMPILE_HEADERS ON)
    if(edgewise_simd STREQUAL all)
        # SSSE3 is between plain loops and SSE4. AVX3_DL brings nothing that kernels use.
        target_compile_definitions(${target} PRIVATE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_AVX3_DL)")
    else()
        target_compile_definitions(${target} PRIVATE HWY_COMPILE_ONLY_STATIC)
        if(NOT edgewise_simd STREQUAL static)
            string(TOUPPER ${edgewise_simd} set)
            target_compile_definitions(${target} PRIVATE HWY_BASELINE_TARGETS=HWY_${set})
        endif()
    endif()
endfunction()
