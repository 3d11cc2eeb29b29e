# Flags of every native module. Either it is hardened, so that a write beyond an array ends the process instead of going
# on with other data; or, with VOLPREP_SANITIZE, sanitizers look for such writes.
include(CheckCXXCompilerFlag)
include(CheckCXXSourceCompiles)
include(CheckLinkerFlag)

option(VOLPREP_SANITIZE "Build with AddressSanitizer and UndefinedBehaviorSanitizer" OFF)
if(VOLPREP_SANITIZE)
  # vptr: libopenvdb does not export the type information that this check compares.
  add_compile_options(-fsanitize=address,undefined -fno-sanitize=vptr -fno-sanitize-recover=all -fno-omit-frame-pointer -g1)
  add_link_options(-fsanitize=address,undefined)
  set(VOLPREP_KERNEL_OPTIMIZATION -O1)
  set(VOLPREP_SCALAR_OPTIMIZATION -O1)
  set(VOLPREP_BINDING_OPTIMIZATION -O1)
  return()
endif()
set(VOLPREP_KERNEL_OPTIMIZATION -O3)
# Rays that branch at each cell are as fast as with -O3, and compile in two thirds of the time. Loops over rows are not:
# filters of bytes took five times as long.
set(VOLPREP_SCALAR_OPTIMIZATION -O2)
# Bindings only translate, and compile in two thirds of the time. They share no inline function with a kernel.
set(VOLPREP_BINDING_OPTIMIZATION -Os)

check_cxx_compiler_flag(-fstack-protector-strong VOLPREP_HAS_STACK_PROTECTOR)
if(VOLPREP_HAS_STACK_PROTECTOR)
  add_compile_options(-fstack-protector-strong)
endif()

# Level 3 needs a built-in function that GCC has from 12 on and Clang from 9 on. Without optimization there is no level.
check_cxx_source_compiles(
  "int main(int count, char** words) { return __builtin_dynamic_object_size(words[count - 1], 0) != 0; }"
  VOLPREP_HAS_FORTIFY_3)
set(fortify 2)
if(VOLPREP_HAS_FORTIFY_3)
  set(fortify 3)
endif()
add_compile_options("$<$<CONFIG:Release,RelWithDebInfo,MinSizeRel>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=${fortify}>")

# Linkers of other systems than Linux do not know these words.
foreach(word relro now noexecstack)
  check_linker_flag(CXX -Wl,-z,${word} VOLPREP_HAS_Z_${word})
  if(VOLPREP_HAS_Z_${word})
    add_link_options(-Wl,-z,${word})
  endif()
endforeach()
