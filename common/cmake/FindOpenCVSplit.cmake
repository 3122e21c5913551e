# OpenCV from Debian's split packages (core, imgproc, imgcodecs, videoio, calib3d), which carry no CMake configuration.
# Gives opencv::core, opencv::imgproc, opencv::imgcodecs, opencv::videoio, opencv::calib3d.
find_path(OpenCVSplit_INCLUDE_DIR opencv2/core.hpp PATH_SUFFIXES opencv4)
set(_opencv_libraries "")
foreach(_module core imgproc imgcodecs videoio calib3d)
  find_library(OpenCVSplit_${_module}_LIBRARY opencv_${_module})
  list(APPEND _opencv_libraries OpenCVSplit_${_module}_LIBRARY)
  if(OpenCVSplit_${_module}_LIBRARY AND OpenCVSplit_INCLUDE_DIR AND NOT TARGET opencv::${_module})
    add_library(opencv::${_module} UNKNOWN IMPORTED)
    set_target_properties(opencv::${_module} PROPERTIES IMPORTED_LOCATION "${OpenCVSplit_${_module}_LIBRARY}"
                          INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${OpenCVSplit_INCLUDE_DIR}"
                          INTERFACE_INCLUDE_DIRECTORIES "${OpenCVSplit_INCLUDE_DIR}")
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCVSplit REQUIRED_VARS OpenCVSplit_INCLUDE_DIR ${_opencv_libraries})
