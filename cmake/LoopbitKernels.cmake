# loopbit_kernels(PART NAME...)
#
# The inner loops of a part, compiled once for each instruction set that a processor may have: from
# NAME_SET.cpp (NAME_avx2.cpp) where there is one, else from NAME_loops.cpp. The sources define
# tables, see loopbit/kernels_for.hpp, and find the set in LOOPBIT_INSTRUCTION_SET. Which of them run is
# decided at run time.
function(loopbit_kernels part)
  set(sets scalar)
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")
    list(APPEND sets avx2 avx512)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64|ARM64")
    list(APPEND sets dotprod)
  endif()
  set_property(GLOBAL PROPERTY LOOPBIT_INSTRUCTION_SETS ${sets})
  # The compiler makes vector code of these loops at -O3. There are no NaNs or infinities in them, and
  # no sign of zero matters: none of this changes a result.
  set(loops -O3 -fno-math-errno -fno-trapping-math -ffinite-math-only -fno-signed-zeros)
  set(flags_avx2 -mavx2)
  set(flags_avx512 -mtune=icelake-server -mavx512f -mavx512bw -mavx512dq -mavx512vl -mavx512vnni
                   -mavx512vpopcntdq -mprefer-vector-width=512)
  # GCC 12 takes the deliberately undefined registers of its own AVX-512 headers for mistakes.
  list(APPEND flags_avx512 $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized> -Wno-uninitialized)
  set(flags_dotprod -march=armv8.2-a+dotprod)

  if(LOOPBIT_SANITIZE MATCHES undefined)
    # Checks for undefined behaviour make these loops ten times as slow. Such a fault is in the source, so to check the
    # scalar form is enough: the tests of the loops run it, too.
    list(TRANSFORM ARGN APPEND _loops.cpp OUTPUT_VARIABLE loop_sources)
    set_property(
      SOURCE ${loop_sources} PROPERTY COMPILE_OPTIONS
      "$<$<NOT:$<STREQUAL:$<TARGET_PROPERTY:NAME>,loopbit_${part}_scalar>>:-fno-sanitize=undefined>")
  endif()

  foreach(set ${sets})
    set(sources)
    foreach(name ${ARGN})
      set(source ${name}_${set}.cpp)
      if(NOT EXISTS ${CMAKE_CURRENT_SOURCE_DIR}/${source})
        set(source ${name}_loops.cpp)
      endif()
      list(APPEND sources ${source})
    endforeach()
    # A target of its own: it sees no more headers than it names.
    set(target loopbit_${part}_${set})
    add_library(${target} OBJECT ${sources})
    target_compile_definitions(${target} PRIVATE LOOPBIT_INSTRUCTION_SET=${set})
    target_compile_options(${target} PRIVATE ${loops} ${flags_${set}})
    target_include_directories(
      ${target} PRIVATE $<TARGET_PROPERTY:loopbit_${part},INTERFACE_INCLUDE_DIRECTORIES>)
    target_link_libraries(${target} PRIVATE loopbit_warnings)
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON UNITY_BUILD OFF
                                               CXX_VISIBILITY_PRESET hidden)
    set_property(TARGET loopbit_${part} APPEND PROPERTY LOOPBIT_OBJECTS $<TARGET_OBJECTS:${target}>)
  endforeach()
endfunction()
