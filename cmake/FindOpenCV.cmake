# Finds the parts of OpenCV that are asked for (COMPONENTS core imgcodecs ...) as targets
# opencv_core, opencv_imgcodecs, ... OpenCV's own package file is taken where it is installed; on
# Debian it comes only with libopencv-dev, which pulls in every module with all of its
# dependencies, so the small packages (libopencv-core-dev, ...) are found without it.
find_package(OpenCV QUIET CONFIG COMPONENTS ${OpenCV_FIND_COMPONENTS})
if(OpenCV_FOUND)
  return()
endif()

find_path(OpenCV_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
foreach(part ${OpenCV_FIND_COMPONENTS})
  find_library(OpenCV_${part}_LIBRARY opencv_${part})
  if(OpenCV_INCLUDE_DIR AND EXISTS ${OpenCV_INCLUDE_DIR}/opencv2/${part}.hpp AND OpenCV_${part}_LIBRARY)
    set(OpenCV_${part}_FOUND TRUE)
    if(NOT TARGET opencv_${part})
      add_library(opencv_${part} UNKNOWN IMPORTED)
      set_target_properties(opencv_${part} PROPERTIES
        IMPORTED_LOCATION ${OpenCV_${part}_LIBRARY}
        INTERFACE_INCLUDE_DIRECTORIES ${OpenCV_INCLUDE_DIR})
    endif()
  endif()
  mark_as_advanced(OpenCV_${part}_LIBRARY)
endforeach()
mark_as_advanced(OpenCV_INCLUDE_DIR)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCV
  REQUIRED_VARS OpenCV_INCLUDE_DIR HANDLE_COMPONENTS
  REASON_FAILURE_MESSAGE "install the packages that scripts/install-deps names (libopencv-imgcodecs-dev)")
