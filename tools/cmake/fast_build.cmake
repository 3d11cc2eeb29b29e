# What makes the first build short: no file is compiled twice, and no header is read more often than needed.

# ccache, where there is one, unless another launcher was chosen. pch_defines and time_macros: without them it would
# leave out everything that uses a precompiled header.
find_program(VOLPREP_CCACHE ccache)
if(VOLPREP_CCACHE AND NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    "${CMAKE_COMMAND}" -E env CCACHE_SLOPPINESS=pch_defines,time_macros "${VOLPREP_CCACHE}")
endif()

# Files that are compiled as one include each other by relative paths, so that ccache knows them in another checkout.
set(CMAKE_UNITY_BUILD_RELOCATABLE ON)

# Compile nanobind's own library, which nanobind_add_module defines, as one file: each of its eleven reads all headers. It
# only translates: -O1 takes two thirds of the time of -O3.
function(compile_nanobind_at_once)
  get_property(targets DIRECTORY PROPERTY BUILDSYSTEM_TARGETS)
  list(FILTER targets INCLUDE REGEX "^nanobind-static")
  set_target_properties(${targets} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 0)
  foreach(target IN LISTS targets)
    target_compile_options(${target} PRIVATE -O1)
  endforeach()
endfunction()

# Compile the named files of src/ of this target as one.
function(compile_together target group)
  list(TRANSFORM ARGN REPLACE "(.+)" "src/\\1.cpp" OUTPUT_VARIABLE sources)
  set_source_files_properties(${sources} PROPERTIES UNITY_GROUP ${group})
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
