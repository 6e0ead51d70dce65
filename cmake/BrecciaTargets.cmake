# breccia_options: warnings and arithmetic flags of all our code.
add_library(breccia_options INTERFACE)
target_include_directories(breccia_options INTERFACE ${CMAKE_SOURCE_DIR}/include ${CMAKE_SOURCE_DIR}/src ${CMAKE_SOURCE_DIR})
target_compile_definitions(breccia_options INTERFACE OMPI_SKIP_MPICXX BRECCIA_VERSION="${PROJECT_VERSION}")
target_compile_options(
  breccia_options
  INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wpedantic -Werror
            # Vectorisable square roots and selects; results stay IEEE.
            -fno-math-errno -fno-trapping-math
            # Vector types wider than the baseline's registers are passed between inlined functions only.
            -Wno-psabi
            # False alarm of g++ 12 on string concatenation (GCC bug 105329).
            -Wno-restrict
            # Warnings are those of g++; clang only finds faults at run time (presets fuzz and tsan).
            $<$<CXX_COMPILER_ID:Clang>:-w>)
if(BRECCIA_SANITIZE)
  target_compile_options(
    breccia_options
    INTERFACE $<$<NOT:$<BOOL:$<TARGET_PROPERTY:BRECCIA_WITHOUT_SANITIZERS>>>:-fsanitize=${BRECCIA_SANITIZE}>
              -fno-omit-frame-pointer
              # Instrumented standard headers (<regex>) set off false alarms of g++ 12 (GCC bug 105562).
              -Wno-maybe-uninitialized)
  target_link_options(breccia_options INTERFACE -fsanitize=${BRECCIA_SANITIZE})
endif()

# breccia_without_sanitizers(TARGET): packs in fully inlined functions make code that g++ 12 needs ten minutes and more
# to instrument. What such a target reads and writes is checked by its callers' tests instead. clang needs half a minute:
# the thread sanitizer, which has its own builds, sees these targets too.
function(breccia_without_sanitizers target)
  if(BRECCIA_SANITIZE AND NOT BRECCIA_SANITIZE STREQUAL "thread")
    set_target_properties(${target} PROPERTIES BRECCIA_WITHOUT_SANITIZERS ON)
    target_compile_options(${target} PRIVATE -g0)
  endif()
endfunction()

# breccia_add_library(NAME SOURCES ... LIBS ...): a static library of ours.
function(breccia_add_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC breccia_options ${ARG_LIBS})
endfunction()

# breccia_add_kernels(NAME TEMPLATE FILE LIBS ...): an object library of FILE for each instruction set, compiled with
# BRECCIA_ISA=isa_v2|isa_v3|isa_v4 (the namespace its entry points live in). Kernel files must not instantiate
# standard containers: the linker could keep a copy made for a processor this machine does not have.
function(breccia_add_kernels name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBS" ${ARGN})
  foreach(isa IN LISTS BRECCIA_ISAS)
    string(REPLACE "x86-64-" "" short ${isa})
    set(target ${name}_${short})
    add_library(${target} OBJECT ${ARG_SOURCES})
    target_link_libraries(${target} PUBLIC breccia_options ${ARG_LIBS})
    target_compile_options(${target} PRIVATE -march=${isa} -ffp-contract=fast)
    if(isa STREQUAL "x86-64-v4")
      target_compile_options(${target} PRIVATE -mprefer-vector-width=512)
    endif()
    # The packs of the baseline are many instructions each: -O3 takes half as long again to compile.
    if(isa STREQUAL "x86-64-v2")
      target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O2>)
    endif()
    target_compile_definitions(${target} PRIVATE BRECCIA_ISA=isa_${short})
    breccia_without_sanitizers(${target})
    list(APPEND targets ${target})
  endforeach()
  set(${name}_targets ${targets} PARENT_SCOPE)
endfunction()
