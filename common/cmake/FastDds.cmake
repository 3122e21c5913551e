# Fast DDS in the version that this system has: Debian 12 has 2.9, Debian 13 has 3.1. What differs between the two stands in
# common/dds/fast_dds_2 and common/dds/fast_dds_3, of which one is on the include path as "fast_dds/…"; no other source asks for a
# version.
#
#   PHANTOM_FAST_DDS      2 or 3
#   phantom::fast_dds     the library and the names that moved
find_package(fastcdr REQUIRED)
find_package(fastdds 3 QUIET)
if(fastdds_FOUND)
  set(PHANTOM_FAST_DDS 3)
  set(library fastdds)
else()
  set(PHANTOM_FAST_DDS 2)
  find_package(fastrtps REQUIRED)
  set(library fastrtps)
endif()
add_library(phantom_fast_dds INTERFACE)
target_include_directories(phantom_fast_dds INTERFACE "${PROJECT_SOURCE_DIR}" "${PROJECT_SOURCE_DIR}/common/dds/fast_dds_${PHANTOM_FAST_DDS}")
target_link_libraries(phantom_fast_dds INTERFACE ${library} fastcdr)
add_library(phantom::fast_dds ALIAS phantom_fast_dds)
