# Run by cpack on the packages (CPACK_POST_BUILD_SCRIPTS): their outermost archive holds the rights that its three parts had by the
# umask; `ar` writes it again with fixed ones.
foreach(package IN LISTS CPACK_PACKAGE_FILES)
  set(parts "${package}.parts")
  file(MAKE_DIRECTORY "${parts}")
  execute_process(COMMAND ar x "${package}" WORKING_DIRECTORY "${parts}" COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ar rcD again debian-binary control.tar.gz data.tar.gz WORKING_DIRECTORY "${parts}" COMMAND_ERROR_IS_FATAL ANY)
  file(RENAME "${parts}/again" "${package}")
  file(REMOVE_RECURSE "${parts}")
endforeach()
