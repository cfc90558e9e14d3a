# The web page of `sovo dashboard`: built by npm into share/sovo/dashboard beside bin, where the
# command looks for it, and installed likewise. Without npm, or without a network for its packages,
# everything else is built, and the server says what is missing.
set(page_default ON)
if(SOVO_SANITIZE)
  set(page_default OFF)
endif()
option(SOVO_BUILD_PAGE "Build the dashboard's web page, with npm" ${page_default})

if(SOVO_BUILD_PAGE)
  set(page_dir ${CMAKE_BINARY_DIR}/share/sovo/dashboard)
  file(GLOB_RECURSE page_sources CONFIGURE_DEPENDS
    ${PROJECT_SOURCE_DIR}/dashboard/src/* ${PROJECT_SOURCE_DIR}/dashboard/public/*)
  # Without a stamp the next build tries again.
  add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/dashboard.stamp
    COMMAND ${PROJECT_SOURCE_DIR}/scripts/build-page --quiet --stamp
      ${CMAKE_BINARY_DIR}/dashboard.stamp ${page_dir}
    DEPENDS ${page_sources} ${PROJECT_SOURCE_DIR}/scripts/build-page
      ${PROJECT_SOURCE_DIR}/dashboard/index.html ${PROJECT_SOURCE_DIR}/dashboard/package-lock.json
      ${PROJECT_SOURCE_DIR}/dashboard/tsconfig.json ${PROJECT_SOURCE_DIR}/dashboard/vite.config.js
    COMMENT "Building the dashboard's page" VERBATIM)
  add_custom_target(sovo_page ALL DEPENDS ${CMAKE_BINARY_DIR}/dashboard.stamp)
  file(MAKE_DIRECTORY ${page_dir})
  install(DIRECTORY ${page_dir}/ DESTINATION share/sovo/dashboard)
endif()
