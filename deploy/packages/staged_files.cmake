# Run by cpack on what it is going to pack (CPACK_PRE_BUILD_SCRIPTS): adds the bill of materials, and gives all files the same dates
# and rights, whoever builds them, whenever and with which umask.
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()
set(staged "${CPACK_TEMPORARY_DIRECTORY}")

set(depends "")
get_cmake_property(names VARIABLES)
foreach(name IN LISTS names)
  if(name MATCHES "^CPACK_DEBIAN_[A-Z_]+_PACKAGE_DEPENDS$")
    string(APPEND depends "${${name}}, ")
  endif()
endforeach()
run(python3 "${CMAKE_CURRENT_LIST_DIR}/../../scripts/bill_of_materials" --staged "${staged}" --build "${CPACK_PHANTOM_BUILD_DIR}"
    --version "${CPACK_PACKAGE_VERSION}" --depends "${depends}"
    --output "${staged}/common${CPACK_PACKAGING_INSTALL_PREFIX}/share/doc/phantom-common/phantom.spdx.json")

run(find "${staged}" -type d -exec chmod 755 {} +)
run(find "${staged}" -type f -perm /100 -exec chmod 755 {} +)
run(find "${staged}" -type f -not -perm /100 -exec chmod 644 {} +)
run(find "${staged}" -exec touch -h -d "@$ENV{SOURCE_DATE_EPOCH}" {} +)
