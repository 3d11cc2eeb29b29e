# The file build.txt of the installed package's metadata: the git revision that it was built from, which
# `volprep --version` prints. There is none where the sources are no checkout. Nobody asks git when volprep runs.
if(NOT SKBUILD_METADATA_DIR)
  return()
endif()
find_package(Git QUIET)
if(NOT GIT_FOUND)
  return()
endif()
execute_process(
  COMMAND "${GIT_EXECUTABLE}" -C "${CMAKE_CURRENT_SOURCE_DIR}" rev-parse --show-prefix --short=12 HEAD
  OUTPUT_VARIABLE said ERROR_QUIET RESULT_VARIABLE status)
# The first line is empty at the top of a checkout. An unpacked sdist in a folder of another checkout is not that one.
if(NOT status EQUAL 0 OR NOT said MATCHES "^\n([0-9a-f]+)\n$")
  return()
endif()
set(name "${CMAKE_MATCH_1}")
execute_process(
  COMMAND "${GIT_EXECUTABLE}" -C "${CMAKE_CURRENT_SOURCE_DIR}" status --porcelain --untracked-files=no
  OUTPUT_VARIABLE changed ERROR_QUIET)
if(changed)
  string(APPEND name " with changes")
endif()
if(SKBUILD_STATE STREQUAL "editable")
  # Its Python files are those of the checkout, whatever they have become since.
  string(APPEND name ", editable")
endif()
file(WRITE "${CMAKE_CURRENT_BINARY_DIR}/build.txt" "${name}\n")
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/build.txt" DESTINATION "${SKBUILD_METADATA_DIR}")
