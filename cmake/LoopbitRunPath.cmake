# loopbit_run_path(TARGET FOLDER): once installed to FOLDER under the prefix, whatever that is, the
# target finds the shared libraries installed with it. Those in /usr are found anyway.
function(loopbit_run_path target folder)
  if(NOT BUILD_SHARED_LIBS OR CMAKE_INSTALL_PREFIX STREQUAL "/usr")
    return()
  endif()
  cmake_path(ABSOLUTE_PATH folder BASE_DIRECTORY ${CMAKE_INSTALL_PREFIX})
  file(RELATIVE_PATH to_libraries ${folder} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(${target} PROPERTIES INSTALL_RPATH "$ORIGIN/${to_libraries}")
endfunction()
