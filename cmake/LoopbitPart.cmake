# loopbit_part(NAME HEADERS ... SHARED_HEADERS ... SOURCES ... LINKS ... PRIVATE_LINKS ...)
#
# A part of the library: sources of its own, public headers in include/loopbit/, and the parts it may
# know. A part that does not name another in LINKS cannot include its headers, which is how the
# include direction is held. All parts of one library are shipped as that one library. HEADERS are
# installed; SHARED_HEADERS only serve parts in other libraries.
function(loopbit_part name)
  cmake_parse_arguments(PART "" "" "HEADERS;SHARED_HEADERS;SOURCES;LINKS;PRIVATE_LINKS" ${ARGN})
  set(target loopbit_${name})
  add_library(${target} OBJECT ${PART_SOURCES})
  target_include_directories(
    ${target} PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>)
  target_link_libraries(
    ${target}
    PUBLIC ${PART_LINKS}
    PRIVATE ${PART_PRIVATE_LINKS} loopbit_warnings)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON
                                             LOOPBIT_OBJECTS $<TARGET_OBJECTS:${target}>)
  set(exported ${PART_HEADERS} ${PART_SHARED_HEADERS})
  loopbit_export_only_public(${target} "${exported}")
  list(TRANSFORM PART_HEADERS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/include/loopbit/)
  install(FILES ${PART_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/loopbit COMPONENT dev)
endfunction()

# Symbols are hidden in a shared library, but for what the public headers declare: each source reads
# these first, with another visibility, so that no header needs a mark of its own.
function(loopbit_export_only_public target headers)
  list(TRANSFORM headers REPLACE "(.+)" "#include \"loopbit/\\1\"")
  list(JOIN headers "\n" includes)
  set(public ${CMAKE_CURRENT_BINARY_DIR}/public.hpp)
  file(CONFIGURE OUTPUT ${public} @ONLY
       CONTENT "#pragma GCC visibility push(default)\n@includes@\n#pragma GCC visibility pop\n")
  target_compile_options(${target} PRIVATE "SHELL:-include \"${public}\"")
  set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden
                                             VISIBILITY_INLINES_HIDDEN ON)
endfunction()
