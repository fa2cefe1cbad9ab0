# Headers, libraries, the command, and a package that find_package(edgewise) finds.
include(CMakePackageConfigHelpers)

get_property(edgewise_targets GLOBAL PROPERTY EDGEWISE_TARGETS)
get_property(edgewise_folders GLOBAL PROPERTY EDGEWISE_FOLDERS)
install(TARGETS ${edgewise_targets} EXPORT edgewise
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(folder IN LISTS edgewise_folders)
    file(GLOB headers ${PROJECT_SOURCE_DIR}/${folder}/*.hpp)
    install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/edgewise/${folder})
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
