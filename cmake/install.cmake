# The core as an installed library: find_package(sovo) gives sovo::sovo, which links every core
# room, and each room by its own name (sovo::geometry, ...). Where the command is built, its
# configuration goes along.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(core_targets GLOBAL PROPERTY SOVO_CORE_TARGETS)
add_library(sovo_core INTERFACE)
set_target_properties(sovo_core PROPERTIES EXPORT_NAME sovo)
target_link_libraries(sovo_core INTERFACE ${core_targets})
add_library(sovo::sovo ALIAS sovo_core)

foreach(target ${core_targets})
  string(REGEX REPLACE "^sovo_" "" room ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${room})
  add_library(sovo::${room} ALIAS ${target})
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/src/${room}/
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/sovo/${room} FILES_MATCHING PATTERN "*.h")
endforeach()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/sovo)
install(TARGETS sovo_core ${core_targets} EXPORT sovo_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT sovo_targets NAMESPACE sovo:: DESTINATION ${package_dir})
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/sovo-config.cmake.in
  ${PROJECT_BINARY_DIR}/sovo-config.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sovo-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sovo-config.cmake
  ${PROJECT_BINARY_DIR}/sovo-config-version.cmake DESTINATION ${package_dir})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

if(TARGET sovo)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/sovo)
endif()
