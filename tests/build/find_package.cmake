# Installs the build to a prefix of its own, then configures, builds and runs a second project that
# knows nothing but that prefix. Run as: cmake -D build_dir=... -P find_package.cmake
function(run)
    execute_process(COMMAND ${ARGV} COMMAND_ECHO STDOUT RESULT_VARIABLE result)
    if(result)
        message(FATAL_ERROR "failed (${result}): ${ARGV}")
    endif()
endfunction()

# Not optimised: what is looked at is whether the installed headers and libraries suffice, and all that optimisation would
# have inlined or left out must be there to be linked. Assertions are as in the build.
set(plain)
if(build_type STREQUAL "Release")
    set(plain "-DCMAKE_CXX_FLAGS_RELEASE=-O0 -DNDEBUG")
endif()

file(REMOVE_RECURSE ${scratch_dir})
run(${CMAKE_COMMAND} --install ${build_dir} --prefix ${scratch_dir}/prefix)
run(${CMAKE_COMMAND} -S ${consumer_dir} -B ${scratch_dir}/build
    -D CMAKE_PREFIX_PATH=${scratch_dir}/prefix
    -D CMAKE_CXX_COMPILER=${compiler}
    "-DCMAKE_CXX_FLAGS=${flags}"
    -D EXAMPLES=${examples_dir}
    -D CMAKE_BUILD_TYPE=${build_type}
    ${plain})
run(${CMAKE_COMMAND} --build ${scratch_dir}/build)
run(${scratch_dir}/build/consumer)
run(${CMAKE_CTEST_COMMAND} --test-dir ${scratch_dir}/build --output-on-failure)
