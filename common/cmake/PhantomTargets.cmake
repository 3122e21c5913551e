# Target helpers shared by every folder of the tree.
#
#   phantom_library(NAME [QUICK] SOURCES … PUBLIC … PRIVATE …)   common/NAME      -> phantom::NAME
#   phantom_component(NAME [QUICK] SOURCES … LIBRARIES …)        components/NAME  -> library NAME_core, executable NAME
#   phantom_test(NAME SOURCES … LIBRARIES … [THOROUGH FILTER])   one GoogleTest executable, NAME_test
#   phantom_bench(NAME SOURCES … LIBRARIES …)              one Google Benchmark executable, NAME_bench
# QUICK: of a release, the target's sources are compiled with -O1 instead of -O3. It is for code that computes little (DDS, messages,
# configuration, tools): half of its compile time was optimising.
# THOROUGH: the tests whose names fit GoogleTest's FILTER have a long form (tests/support/thorough.hpp), which CTest runs as thorough.NAME.
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
      set_source_files_properties("${source}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON COMPILE_OPTIONS "${PHANTOM_VECTOR_OPTIONS}")
    endif()
  endforeach()
endfunction()

find_package(Threads REQUIRED)

add_library(phantom_options INTERFACE)
target_compile_options(phantom_options INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wno-missing-field-initializers
                       -Wnon-virtual-dtor -Woverloaded-virtual
                       # GCC 13 and later take a reference to what a function returns for one to its argument.
                       $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>:-Wno-dangling-reference>
                       $<$<AND:$<BOOL:${PHANTOM_UNITY}>,$<CXX_COMPILER_ID:GNU>>:-Wno-subobject-linkage>)
if(PHANTOM_WARNINGS_AS_ERRORS)
  target_compile_options(phantom_options INTERFACE -Werror)
endif()
if(PHANTOM_SANITIZE)
  add_compile_options(-fsanitize=${PHANTOM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  add_link_options(-fsanitize=${PHANTOM_SANITIZE})
endif()

# QUICK of the targets above.
function(phantom_compile_quickly)
  foreach(target IN LISTS ARGN)
    target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
  endforeach()
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
    endif()
  else()
    add_library(phantom_${NAME} INTERFACE)
    target_include_directories(phantom_${NAME} INTERFACE "${PROJECT_SOURCE_DIR}")
    target_link_libraries(phantom_${NAME} INTERFACE ${ARG_PUBLIC})
  endif()
  add_library(phantom::${NAME} ALIAS phantom_${NAME})
endfunction()

# Makes FILE, a table of keys (common/runtime/fields.hpp) or a part of a page, the text phantom::NAMESPACE::VARIABLE of TARGET.
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

# Test executables stand in <build>/tests; GoogleTest's cases are registered with CTest one by one. Of a release,
# the tests' own sources are optimised less: half of a build is theirs, and a third of that was optimising.
function(phantom_test NAME)
  if(NOT PHANTOM_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "THOROUGH" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${NAME}_test ${ARG_SOURCES})
  set_target_properties(${NAME}_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/tests")
  target_compile_definitions(${NAME}_test PRIVATE PHANTOM_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  phantom_compile_quickly(${NAME}_test)
  target_link_libraries(${NAME}_test PRIVATE ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main phantom_options)
  include(GoogleTest)
  gtest_discover_tests(${NAME}_test TEST_PREFIX "${NAME}." DISCOVERY_TIMEOUT 60 PROPERTIES TIMEOUT 300)
  if(ARG_THOROUGH)
    phantom_thorough_test(${NAME} ${NAME}_test "--gtest_filter=${ARG_THOROUGH}")
  endif()
endfunction()

# The long form of tests of TARGET, one CTest entry: thorough.NAME. A filter that fits none is a mistake.
function(phantom_thorough_test NAME TARGET)
  add_test(NAME thorough.${NAME} COMMAND ${TARGET} ${ARGN})
  set_tests_properties(thorough.${NAME} PROPERTIES LABELS stage:thorough TIMEOUT 1200 ENVIRONMENT PHANTOM_THOROUGH=1
                       FAIL_REGULAR_EXPRESSION "Running 0 tests")
endfunction()

# Benchmark executables stand in <build>/bench, where scripts/bench finds them.
function(phantom_bench NAME)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${NAME}_bench ${ARG_SOURCES})
  phantom_keep_apart(${ARG_SOURCES})
  set_target_properties(${NAME}_bench PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${CMAKE_BINARY_DIR}/bench")
  target_link_libraries(${NAME}_bench PRIVATE ${ARG_LIBRARIES} benchmark::benchmark phantom_options)
endfunction()
