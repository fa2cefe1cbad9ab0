# Headers, libraries, the command, and a package that find_package(edgewise) finds.
include(CMakePackageConfigHelpers)

get_property(edgewise_targets GLOBAL PROPERTY EDGEWISE_TARGETS)
install(TARGETS ${edgewise_targets} EXPORT edgewise
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})

# The public headers, and what they include. All others stay in the source tree.
set(edgewise_public
    graph/export.hpp graph/job.hpp graph/plan.hpp graph/request.hpp graph/transform_graph.hpp graph/transition.hpp
    graph/version.hpp
    planner/margin.hpp planner/planner.hpp planner/profile.hpp
    runtime/memory_budget.hpp runtime/runtime.hpp
    scene/scene.hpp scene/statistics.hpp
    reference/phantoms.hpp reference/verify.hpp
    io/image_buf.hpp io/store.hpp
    transitions/catalogue.hpp transitions/filters/filter.hpp
    charts/csv.hpp charts/gnuplot.hpp charts/page.hpp charts/table.hpp
    evaluation/audit/audit.hpp evaluation/calibrate/calibration.hpp evaluation/chart/chart_run.hpp measure/machine.hpp
    edgewise/edgewise.hpp engine/merge.hpp engine/paths.hpp request/quantities.hpp engine/rivals.hpp engine/reached.hpp
    transfer/load.hpp transfer/presets.hpp)
set(edgewise_headers)
while(edgewise_public)
    list(POP_FRONT edgewise_public header)
    if(header IN_LIST edgewise_headers OR NOT EXISTS ${PROJECT_SOURCE_DIR}/${header})
        continue()
    endif()
    list(APPEND edgewise_headers ${header})
    file(STRINGS ${PROJECT_SOURCE_DIR}/${header} includes REGEX "^#include \"")
    foreach(line IN LISTS includes)
        string(REGEX REPLACE "^#include \"([^\"]+)\".*" "\\1" included "${line}")
        list(APPEND edgewise_public ${included})
    endforeach()
endwhile()
foreach(header IN LISTS edgewise_headers)
    cmake_path(GET header PARENT_PATH folder)
    install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/edgewise/${folder})
endforeach()
if(TARGET edgewise)
    install(TARGETS edgewise RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
endif()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/edgewise)
install(EXPORT edgewise NAMESPACE edgewise:: FILE edgewiseTargets.cmake DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/edgewiseConfig.cmake.in
    ${PROJECT_BINARY_DIR}/edgewiseConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/edgewiseConfigVersion.cmake
    COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/edgewiseConfig.cmake
    ${PROJECT_BINARY_DIR}/edgewiseConfigVersion.cmake DESTINATION ${package_dir})
