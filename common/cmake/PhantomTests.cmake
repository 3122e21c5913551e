# Tests and the stages that run them (scripts/test --list).
#
#   phantom_test(NAME [STAGE S] [THOROUGH FILTER] [NEEDS TARGET…] [PROPERTIES …] SOURCES … LIBRARIES …)
#       A GoogleTest executable, NAME_test. CTest runs each of its suites as one process, NAME.SUITE. NEEDS: executables
#       that the tests start. THOROUGH: the tests that fit GoogleTest's FILTER have a long form
#       (tests/support/thorough.hpp), which CTest runs as thorough.NAME.
#   phantom_test_program(TARGET [STAGE S] [NEEDS TARGET…] SOURCES … LIBRARIES …)
#       An executable in <build>/tests that is itself a whole test (add_test) or a helper of one.
#   phantom_stage(STAGE [TESTS …] [TARGETS …])
#       Assigns tests (label stage:STAGE) and what they need (target stage_STAGE) to a stage.
#
# Stage `quick` is what scripts/test runs without arguments: its tests carry no label of a stage.

set(PHANTOM_TEST_DIR "${CMAKE_BINARY_DIR}/tests")
set(PHANTOM_DISCOVER_SUITES "${CMAKE_CURRENT_LIST_DIR}/DiscoverSuites.cmake")

function(phantom_stage STAGE)
  cmake_parse_arguments(ARG "" "" "TESTS;TARGETS" ${ARGN})
  if(NOT TARGET stage_${STAGE})
    add_custom_target(stage_${STAGE})
  endif()
  if(ARG_TARGETS)
    add_dependencies(stage_${STAGE} ${ARG_TARGETS})
  endif()
  if(NOT STAGE STREQUAL "quick")
    foreach(test IN LISTS ARG_TESTS)
      set_property(TEST ${test} APPEND PROPERTY LABELS "stage:${STAGE}")
    endforeach()
  endif()
endfunction()

# Headers that nearly every test includes, compiled once. Called once, at the top. A build without unity groups has none, so that a
# missing include shows.
function(phantom_precompile_test_headers)
  if(NOT PHANTOM_PRECOMPILE)
    return()
  endif()
  set(source "${CMAKE_BINARY_DIR}/phantom_test_headers.cpp")
  file(CONFIGURE OUTPUT "${source}" CONTENT "int main() {}\n")
  add_executable(phantom_test_headers "${source}")
  phantom_compile_quickly(phantom_test_headers)
  set_target_properties(phantom_test_headers PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PHANTOM_TEST_DIR}")
  target_link_libraries(phantom_test_headers PRIVATE GTest::gtest GTest::gmock Eigen3::Eigen phantom_options)
  target_precompile_headers(phantom_test_headers PRIVATE <gtest/gtest.h> <gmock/gmock.h> <Eigen/Dense> ${PHANTOM_STANDARD_HEADERS})
endfunction()

function(phantom_test_program TARGET)
  cmake_parse_arguments(ARG "" "STAGE" "SOURCES;LIBRARIES;NEEDS" ${ARGN})
  add_executable(${TARGET} ${ARG_SOURCES})
  set_target_properties(${TARGET} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PHANTOM_TEST_DIR}" UNITY_BUILD_BATCH_SIZE ${PHANTOM_TEST_BATCH}
                        PHANTOM_IS_TEST ON)
  target_compile_definitions(${TARGET} PRIVATE PHANTOM_SOURCE_DIR="${PROJECT_SOURCE_DIR}" PHANTOM_BIN_DIR="${CMAKE_BINARY_DIR}/bin")
  phantom_compile_quickly(${TARGET})
  target_link_libraries(${TARGET} PRIVATE ${ARG_LIBRARIES} GTest::gtest GTest::gmock GTest::gtest_main phantom_options)
  target_link_options(${TARGET} PRIVATE ${PHANTOM_TEST_LINKER})
  if(PHANTOM_PRECOMPILE)
    phantom_reuse_headers(${TARGET} phantom_test_headers)
  endif()
  if(ARG_NEEDS)
    add_dependencies(${TARGET} ${ARG_NEEDS})
  endif()
  if(NOT ARG_STAGE)
    set(ARG_STAGE quick)
  endif()
  phantom_stage(${ARG_STAGE} TARGETS ${TARGET})
endfunction()

function(phantom_test NAME)
  if(NOT PHANTOM_BUILD_TESTS)
    return()
  endif()
  cmake_parse_arguments(ARG "" "STAGE;THOROUGH" "SOURCES;LIBRARIES;NEEDS;PROPERTIES" ${ARGN})
  phantom_test_program(${NAME}_test STAGE "${ARG_STAGE}" NEEDS ${ARG_NEEDS} SOURCES ${ARG_SOURCES} LIBRARIES ${ARG_LIBRARIES})
  phantom_discover_suites(${NAME} STAGE "${ARG_STAGE}" PROPERTIES ${ARG_PROPERTIES})
  if(ARG_THOROUGH)
    phantom_thorough_test(${NAME} ${NAME}_test "--gtest_filter=${ARG_THOROUGH}")
  endif()
endfunction()

# The long form of tests of TARGET, one CTest entry: thorough.NAME. A filter that fits none is a mistake.
function(phantom_thorough_test NAME TARGET)
  add_test(NAME thorough.${NAME} COMMAND ${TARGET} ${ARGN})
  set_tests_properties(thorough.${NAME} PROPERTIES TIMEOUT 1200 ENVIRONMENT PHANTOM_THOROUGH=1 FAIL_REGULAR_EXPRESSION "Running 0 tests")
  phantom_stage(thorough TESTS thorough.${NAME} TARGETS ${TARGET})
endfunction()

# Registers the suites of NAME_test with CTest once it is linked. FILTER: of these suites alone, so that some have other properties.
function(phantom_discover_suites NAME)
  cmake_parse_arguments(ARG "" "STAGE;FILTER;LIST" "PROPERTIES" ${ARGN})
  if(NOT ARG_LIST)
    set(ARG_LIST ${NAME})
  endif()
  set(label "")
  if(ARG_STAGE AND NOT ARG_STAGE STREQUAL "quick")
    set(label "stage:${ARG_STAGE}")
    list(APPEND ARG_PROPERTIES LABELS "${label}")
  endif()
  set(list "${PHANTOM_TEST_DIR}/suites/${ARG_LIST}.cmake")
  string(REPLACE ";" "|" properties "${ARG_PROPERTIES}")
  add_custom_command(TARGET ${NAME}_test POST_BUILD
    COMMAND "${CMAKE_COMMAND}" -DEXECUTABLE=$<TARGET_FILE:${NAME}_test> -DPREFIX=${NAME} -DFILTER=${ARG_FILTER} -DLIST=${list}
            "-DPROPERTIES=${properties}" "-DWORKING_DIRECTORY=${CMAKE_CURRENT_BINARY_DIR}"
            "-DRESULTS=${CMAKE_BINARY_DIR}/test_results" -P "${PHANTOM_DISCOVER_SUITES}"
    BYPRODUCTS "${list}" VERBATIM)
  file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/${ARG_LIST}_suites.cmake" @ONLY CONTENT "if(EXISTS \"${list}\")
  include(\"${list}\")
else()
  add_test(${NAME}_not_built ${NAME}_not_built)
  set_tests_properties(${NAME}_not_built PROPERTIES LABELS \"${label}\")
endif()
")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES "${CMAKE_CURRENT_BINARY_DIR}/${ARG_LIST}_suites.cmake")
endfunction()
