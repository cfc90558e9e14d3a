# Warnings that every target of the project is built with; they are errors.
add_library(sovo_warnings INTERFACE)
target_compile_options(sovo_warnings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
  -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual -Werror>)

# GCC 12 sees overlapping copies in std::string's own concatenation (GCC bug 105329).
target_compile_options(sovo_warnings INTERFACE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-restrict>)
# It tells that wide registers are passed in another way where the processor has them (all functions
# that take them are inlined, image/lanes.h), and on ARM of every std::pair.
target_compile_options(sovo_warnings INTERFACE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-psabi>)

# For code that works on messages and files, not on pixels: half of the compiler's time.
add_library(sovo_lightly_optimized INTERFACE)
target_compile_options(sovo_lightly_optimized INTERFACE $<$<CONFIG:Release>:-Og>)

# One source gives one result: no fused multiply-add that a compiler may or may not use.
add_compile_options(-ffp-contract=off -fno-math-errno)

# Null and misaligned pointers and what lies outside an object stop the program or the address
# sanitizer anyway; the other checks of these take the compiler more time than all the rest.
option(SOVO_SANITIZE_POINTERS "Let the undefined-behaviour sanitizer check every pointer too" OFF)
if(SOVO_SANITIZE)
  add_compile_options(-fsanitize=${SOVO_SANITIZE} -fno-omit-frame-pointer)
  if(SOVO_SANITIZE MATCHES undefined)
    add_compile_options(-fno-sanitize-recover=undefined)
    if(NOT SOVO_SANITIZE_POINTERS)
      add_compile_options(-fno-sanitize=null,alignment,object-size,vptr)
    endif()
  endif()
  add_link_options(-fsanitize=${SOVO_SANITIZE})
endif()

# sovo_room(NAME [CORE] [LIGHT] [LOOPS globs...] [ROOMS below...] [LINK libraries...]): the static
# library sovo_NAME from every source below src/NAME but main.cpp. CORE rooms are installed as
# libsovo. A LIGHT room is optimized lightly, but for the sources that LOOPS names, which loop over
# pixels.
function(sovo_room name)
  cmake_parse_arguments(ROOM "CORE;LIGHT" "" "LOOPS;ROOMS;LINK" ${ARGN})
  set(room ${PROJECT_SOURCE_DIR}/src/${name})
  file(GLOB_RECURSE sources CONFIGURE_DEPENDS ${room}/*.cpp)
  list(FILTER sources EXCLUDE REGEX "/main\\.cpp$")
  list(TRANSFORM ROOM_ROOMS PREPEND sovo_)
  set(loops)
  set(parts sovo_${name})
  if(ROOM_LOOPS)
    list(TRANSFORM ROOM_LOOPS PREPEND ${room}/)
    file(GLOB loops CONFIGURE_DEPENDS ${ROOM_LOOPS})
    list(REMOVE_ITEM sources ${loops})
    add_library(sovo_${name}_loops OBJECT ${loops})
    target_link_libraries(sovo_${name}_loops PRIVATE ${ROOM_ROOMS} ${ROOM_LINK})
    set(loops $<TARGET_OBJECTS:sovo_${name}_loops>)
    list(APPEND parts sovo_${name}_loops)
  endif()
  if(sources)
    add_library(sovo_${name} STATIC ${sources} ${loops})
    set(scope PUBLIC)
    if(ROOM_LIGHT)
      target_link_libraries(sovo_${name} PRIVATE $<BUILD_INTERFACE:sovo_lightly_optimized>)
    endif()
  else()
    add_library(sovo_${name} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(sovo_${name} ${scope} ${ROOM_ROOMS} ${ROOM_LINK})
  foreach(part ${parts})
    target_include_directories(${part} ${scope}
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:include>)
    target_compile_features(${part} ${scope} cxx_std_20)
    if(scope STREQUAL PUBLIC)
      target_link_libraries(${part} PRIVATE $<BUILD_INTERFACE:sovo_warnings>)
    endif()
  endforeach()
  if(ROOM_CORE)
    set_property(GLOBAL APPEND PROPERTY SOVO_CORE_TARGETS sovo_${name})
  endif()
endfunction()
