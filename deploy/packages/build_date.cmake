# Read by cpack (CPACK_PROJECT_CONFIG_FILE). All dates in the packages are SOURCE_DATE_EPOCH, as reproducible-builds.org defines
# it: by default that of the last commit, outside of a checkout 1 January 2000.
if("$ENV{SOURCE_DATE_EPOCH}" STREQUAL "")
  execute_process(COMMAND git log -1 --format=%ct WORKING_DIRECTORY "${CMAKE_CURRENT_LIST_DIR}" OUTPUT_VARIABLE epoch
                  OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT epoch MATCHES "^[0-9]+$")
    set(epoch 946684800)
  endif()
  set(ENV{SOURCE_DATE_EPOCH} "${epoch}")
endif()
# Control archives of packages take their files' dates from here; umask and time zone of who builds do not count.
set(ENV{TZ} UTC)
