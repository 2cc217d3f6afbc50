# Installed packages: mp2p_icp_map, mp2p_icp_filters and mp2p_icp, each findable on its own with find_package().
include(CMakePackageConfigHelpers)
set(MP2PICP_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake)

# mp2p_icp_package(NAME [NEEDS package...])
function(mp2p_icp_package NAME)
  cmake_parse_arguments(ARG "" "" "NEEDS" ${ARGN})
  set(PACKAGE ${NAME})
  set(PACKAGE_NEEDS "")
  foreach(OTHER ${ARG_NEEDS})
    string(APPEND PACKAGE_NEEDS "find_dependency(${OTHER} ${PROJECT_VERSION} EXACT HINTS \${CMAKE_CURRENT_LIST_DIR}/..)\n")
  endforeach()
  install(TARGETS ${NAME} EXPORT ${NAME}-targets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT ${NAME}-targets NAMESPACE mp2p_icp:: DESTINATION ${MP2PICP_CMAKE_DIR}/${NAME})
  configure_package_config_file(cmake/package-config.cmake.in ${PROJECT_BINARY_DIR}/${NAME}-config.cmake
    INSTALL_DESTINATION ${MP2PICP_CMAKE_DIR}/${NAME})
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/${NAME}-config-version.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/${NAME}-config.cmake ${PROJECT_BINARY_DIR}/${NAME}-config-version.cmake
    cmake/mp2p_icp-dependencies.cmake DESTINATION ${MP2PICP_CMAKE_DIR}/${NAME})
endfunction()

mp2p_icp_package(mp2p_icp_map)
mp2p_icp_package(mp2p_icp_filters NEEDS mp2p_icp_map)
mp2p_icp_package(mp2p_icp NEEDS mp2p_icp_map mp2p_icp_filters)

install(DIRECTORY share/pipelines DESTINATION ${CMAKE_INSTALL_DATADIR}/mp2p_icp)
install(FILES package.xml LICENSE README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/mp2p_icp)
