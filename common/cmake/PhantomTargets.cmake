# Target helpers shared by every folder of the tree.
#
#   phantom_library(NAME [QUICK] SOURCES … PUBLIC … PRIVATE …)   common/NAME      -> phantom::NAME
#   phantom_component(NAME [QUICK] SOURCES … LIBRARIES …)        components/NAME  -> library NAME_core, executable NAME
#   phantom_part(COMPONENT NAME [QUICK] SOURCES … LIBRARIES … PRIVATE …)  components/COMPONENT/NAME  -> library COMPONENT_NAME
#   phantom_bench(NAME SOURCES … LIBRARIES …)              one Google Benchmark executable, NAME_bench
# QUICK: of a release, the target's sources are compiled with -O1 instead of -O3. It is for code that computes little (DDS, messages,
# configuration, tools): half of its compile time was optimising.
#
# Tests: PhantomTests.cmake.
#
# Includes are written from the repository root: #include "common/workspace/grid.hpp".

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bin")

# Executables find deploy/ and their default configuration under <prefix>/share/phantom, where <prefix> is the
# folder above bin/. In a build tree those are links into the sources.
set(PHANTOM_SHARE_DIR "${CMAKE_BINARY_DIR}/share/phantom")
file(MAKE_DIRECTORY "${PHANTOM_SHARE_DIR}/config")
file(CREATE_LINK "${CMAKE_SOURCE_DIR}/deploy" "${PHANTOM_SHARE_DIR}/deploy" SYMBOLIC)

# Sources are compiled in groups, each as one translation unit: half of an object's time is reading headers.
set(CMAKE_UNITY_BUILD ${PHANTOM_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 8)
set(PHANTOM_TEST_BATCH 24)

# Headers of the standard library that nearly every source reaches: compiled once, for tests with GoogleTest (PhantomTests.cmake), for
# libraries with Eigen. The preset `objects` does without, so that a missing include shows, and so does clang.
set(PHANTOM_PRECOMPILE OFF)
if(PHANTOM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(PHANTOM_PRECOMPILE ON)
endif()
set(PHANTOM_STANDARD_HEADERS <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <cstdint> <filesystem> <fstream> <functional>
    <iostream> <map> <memory> <mutex> <optional> <random> <set> <span> <sstream> <string> <string_view> <thread> <tuple> <unordered_map>
    <variant> <vector>)

# Test executables are linked by mold where it is installed: sixty links of what carries Fast DDS and OpenCV take a minute by ld.
find_program(PHANTOM_MOLD mold)
set(PHANTOM_TEST_LINKER "")
if(PHANTOM_MOLD AND NOT PHANTOM_SANITIZE)
  set(PHANTOM_TEST_LINKER -fuse-ld=mold)
endif()

# Highway's dynamic dispatch includes a source once per instruction set: such a source cannot share a unit. On x86 the
# least set is SSE4.2 with AES, which processors have had since 2011: the plain one, without vectors, is not built.
set(PHANTOM_VECTOR_OPTIONS "")
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  set(PHANTOM_VECTOR_OPTIONS -msse4.2 -maes -mpclmul)
endif()
function(phantom_keep_apart)
  foreach(source IN LISTS ARGN)
    if(NOT source MATCHES "\\.cpp$")
      continue()
    endif()
    file(STRINGS "${source}" dispatch REGEX "foreach_target\\.h" LIMIT_COUNT 1)
    if(dispatch)
      set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON SKIP_PRECOMPILE_HEADERS ON COMPILE_OPTIONS "${PHANTOM_VECTOR_OPTIONS}")
    endif()
  endforeach()
endfunction()

# GCC collects its garbage first at an eighth of the memory, 128 MB at most; a unit of ours needs 1 GB. Without collecting until 2 GB a
# build takes 6 % less time. Two jobs at once need 4 GB then, so only where there are 12.
cmake_host_system_information(RESULT PHANTOM_MEMORY_MIB QUERY TOTAL_PHYSICAL_MEMORY)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND PHANTOM_MEMORY_MIB GREATER 12000)
  add_compile_options("SHELL:--param ggc-min-heapsize=2000000")
endif()

find_package(Threads REQUIRED)

add_library(phantom_options INTERFACE)
target_compile_options(phantom_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wno-missing-field-initializers
                       -Wnon-virtual-dtor -Woverloaded-virtual
                       # GCC 13 and later take a reference to what a function returns for one to its argument.
                       $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>:-Wno-dangling-reference>
                       $<$<AND:$<BOOL:${PHANTOM_UNITY}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>
                       # In a group of tests a local name may be that of another file; preset objects keeps the warning.
                       $<$<AND:$<BOOL:${PHANTOM_UNITY}>,$<BOOL:$<TARGET_PROPERTY:PHANTOM_IS_TEST>>>:-Wno-shadow>)
if(PHANTOM_WARNINGS_AS_ERRORS)
  target_compile_options(phantom_options INTERFACE -Werror)
endif()
if(PHANTOM_SANITIZE)
  # GCC 12 takes members of std::function for uninitialised where it adds its checks.
  add_compile_options(-fsanitize=${PHANTOM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -Wno-maybe-uninitialized)
  add_link_options(-fsanitize=${PHANTOM_SANITIZE})
endif()

# QUICK of the targets above.
function(phantom_compile_quickly)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
endfunction()

# TARGET includes the precompiled headers of FROM first; ccache can only tell by -fpch-preprocess that they have changed.
function(phantom_reuse_headers TARGET FROM)
  target_precompile_headers(${TARGET} REUSE_FROM ${FROM})
  target_compile_options(${TARGET} PRIVATE -fpch-preprocess)
endfunction()

# The precompiled headers of libraries, for sources that are compiled by -O1 (QUICK) and by -O3. Called once, at the top.
function(phantom_precompile_library_headers)
  if(NOT PHANTOM_PRECOMPILE)
    return()
  endif()
  foreach(level O1 O3)
    set(source "${CMAKE_BINARY_DIR}/phantom_headers_${level}.cpp")
    file(CONFIGURE OUTPUT "${source}" CONTENT "namespace phantom {}\n")
    add_library(phantom_headers_${level} OBJECT "${source}")
    target_link_libraries(phantom_headers_${level} PRIVATE Eigen3::Eigen phantom_options)
    target_precompile_headers(phantom_headers_${level} PRIVATE ${PHANTOM_STANDARD_HEADERS} <Eigen/Core> <Eigen/Geometry>)
  endforeach()
  phantom_compile_quickly(phantom_headers_O1)
endfunction()

function(phantom_use_library_headers TARGET LEVEL)
  if(PHANTOM_PRECOMPILE)
    phantom_reuse_headers(${TARGET} phantom_headers_${LEVEL})
  endif()
endfunction()

function(phantom_library NAME)
  cmake_parse_arguments(ARG "QUICK" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(ARG_SOURCES)
    add_library(phantom_${NAME} STATIC ${ARG_SOURCES})
    phantom_keep_apart(${ARG_SOURCES})
    target_include_directories(phantom_${NAME} PUBLIC "${PROJECT_SOURCE_DIR}")
    target_link_libraries(phantom_${NAME} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:phantom_options>)
    if(ARG_QUICK)
      phantom_compile_quickly(phantom_${NAME})
      phantom_use_library_headers(phantom_${NAME} O1)
    else()
      phantom_use_library_headers(phantom_${NAME} O3)
    endif()
  else()
    add_library(phantom_${NAME} INTERFACE)
    target_include_directories(phantom_${NAME} INTERFACE "${PROJECT_SOURCE_DIR}")
    target_link_libraries(phantom_${NAME} INTERFACE ${ARG_PUBLIC})
  endif()
  add_library(phantom::${NAME} ALIAS phantom_${NAME})
endfunction()

# Makes FILE, a table of keys (common/runtime/configuration/fields.hpp) or a part of a page, the text phantom::NAMESPACE::VARIABLE of TARGET.
function(phantom_parameters TARGET FILE NAMESPACE VARIABLE)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${FILE}")
  file(READ "${FILE}" TEXT)
  string(STRIP "${TEXT}" TEXT)
  set(source "${CMAKE_CURRENT_BINARY_DIR}/${VARIABLE}.cpp")
  file(CONFIGURE OUTPUT "${source}" @ONLY CONTENT "namespace phantom::@NAMESPACE@ {
extern const char* const @VARIABLE@;
const char* const @VARIABLE@ = R\"yaml(@TEXT@)yaml\";
}
")
  target_sources(${TARGET} PRIVATE "${source}")
endfunction()

# A part of a component that has one library for each of its folders. LIBRARIES: public; those after PRIVATE are not.
function(phantom_part COMPONENT NAME)
  cmake_parse_arguments(ARG "QUICK" "" "SOURCES;LIBRARIES;PRIVATE" ${ARGN})
  add_library(${COMPONENT}_${NAME} STATIC ${ARG_SOURCES})
  target_include_directories(${COMPONENT}_${NAME} PUBLIC "${PROJECT_SOURCE_DIR}")
  target_link_libraries(${COMPONENT}_${NAME} PUBLIC ${ARG_LIBRARIES} phantom::runtime PRIVATE ${ARG_PRIVATE} phantom_options)
  if(ARG_QUICK)
    phantom_compile_quickly(${COMPONENT}_${NAME})
    phantom_use_library_headers(${COMPONENT}_${NAME} O1)
  else()
    phantom_use_library_headers(${COMPONENT}_${NAME} O3)
  endif()
endfunction()

function(phantom_component NAME)
  cmake_parse_arguments(ARG "QUICK" "" "SOURCES;LIBRARIES" ${ARGN})
  add_library(${NAME}_core STATIC ${ARG_SOURCES})
  target_include_directories(${NAME}_core PUBLIC "${PROJECT_SOURCE_DIR}")
  target_link_libraries(${NAME}_core PUBLIC ${ARG_LIBRARIES} phantom::runtime PRIVATE phantom_options)
  phantom_parameters(${NAME}_core ${NAME}.yaml ${NAME} kParameters)
  add_executable(${NAME} main.cpp)
  target_link_libraries(${NAME} PRIVATE ${NAME}_core phantom_options)
  if(ARG_QUICK)
    phantom_compile_quickly(${NAME} ${NAME}_core)
    phantom_use_library_headers(${NAME}_core O1)
  else()
    phantom_use_library_headers(${NAME}_core O3)
  endif()
  set_property(GLOBAL APPEND PROPERTY PHANTOM_COMPONENT_NAMES ${NAME})
  install(TARGETS ${NAME} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT ${NAME})
  file(CREATE_LINK "${CMAKE_CURRENT_SOURCE_DIR}/${NAME}.yaml" "${PHANTOM_SHARE_DIR}/config/${NAME}.yaml" SYMBOLIC)
  install(FILES ${NAME}.yaml DESTINATION ${CMAKE_INSTALL_DATADIR}/phantom/config COMPONENT ${NAME})
endfunction()

# What a component's package and systemd unit are called: phantom-slave-io; phantom_sensing is phantom-sensing.
function(phantom_package_name RESULT COMPONENT)
  string(REGEX REPLACE "^phantom_" "" name "${COMPONENT}")
  string(REPLACE "_" "-" name "phantom-${name}")
  set(${RESULT} "${name}" PARENT_SCOPE)
endfunction()

# Benchmark executables stand in <build>/bench, where scripts/bench finds them.
function(phantom_bench NAME)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${NAME}_bench ${ARG_SOURCES})
  phantom_keep_apart(${ARG_SOURCES})
  set_target_properties(${NAME}_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bench")
  target_link_libraries(${NAME}_bench PRIVATE ${ARG_LIBRARIES} benchmark::benchmark phantom_options)
  if(NOT TARGET benchmarks)
    add_custom_target(benchmarks)
  endif()
  add_dependencies(benchmarks ${NAME}_bench)
endfunction()
