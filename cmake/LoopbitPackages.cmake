# The Debian packages that `cpack -G DEB` makes of a build with shared libraries, and the tarballs that
# `cpack -G TGZ` and CPackSourceConfig.cmake make; see scripts/packages.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "The loopbit authors <authors@loopbit.invalid>")
set(CPACK_PACKAGE_FILE_NAME ${PROJECT_NAME}-${PROJECT_VERSION}-${CMAKE_SYSTEM_NAME}-${CMAKE_SYSTEM_PROCESSOR})
set(CPACK_SOURCE_GENERATOR TGZ)
set(CPACK_SOURCE_PACKAGE_FILE_NAME ${PROJECT_NAME}-${PROJECT_VERSION})
# As .gitignore.
set(root ${PROJECT_SOURCE_DIR})
set(CPACK_SOURCE_IGNORE_FILES "^${root}/build/" "^${root}/loopbit_demo/" "^${root}/[.]git(/|$)" /node_modules/
                              /dist/ /__pycache__/ [.]egg-info/ "^${root}/python/loopbit/.*[.]so$")
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL lib map images poses graph data dev tools python)
if(LOOPBIT_BUILD_FLEET)
  list(APPEND CPACK_COMPONENTS_ALL fleet)
endif()
if(LOOPBIT_BUILD_SERVER_SEARCH)
  list(APPEND CPACK_COMPONENTS_ALL postgres)
endif()
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Other libraries by what is linked; ours, which no package is installed of yet, by name below.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/src ${PROJECT_BINARY_DIR}/src/report)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY "=")

set(abi ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(this "(= ${PROJECT_VERSION})")
set(summary "visual loop closure detection via binary content")

set(CPACK_DEBIAN_LIB_PACKAGE_NAME libloopbit${abi})
set(CPACK_DEBIAN_LIB_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIB_DESCRIPTION "${summary}: the detector
 Detects visual loop closures in a sequence of camera images.")

set(CPACK_DEBIAN_MAP_PACKAGE_NAME libloopbit-map${abi})
set(CPACK_DEBIAN_MAP_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_MAP_PACKAGE_DEPENDS "libloopbit${abi} ${this}")
set(CPACK_DEBIAN_MAP_DESCRIPTION "${summary}: maps
 Keeps what a detector has seen in an SQLite file that later runs continue.")

set(CPACK_DEBIAN_IMAGES_PACKAGE_NAME libloopbit-images${abi})
set(CPACK_DEBIAN_IMAGES_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_IMAGES_PACKAGE_DEPENDS "libloopbit${abi} ${this}")
set(CPACK_DEBIAN_IMAGES_DESCRIPTION "${summary}: images
 Reads images from files, folders, lists, videos and cameras.")

set(CPACK_DEBIAN_POSES_PACKAGE_NAME libloopbit-poses${abi})
set(CPACK_DEBIAN_POSES_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_POSES_PACKAGE_DEPENDS "libloopbit${abi} ${this}")
set(CPACK_DEBIAN_POSES_DESCRIPTION "${summary}: relative poses
 Reads camera calibrations and measures the relative pose of two images.")

set(CPACK_DEBIAN_GRAPH_PACKAGE_NAME libloopbit-graph${abi})
set(CPACK_DEBIAN_GRAPH_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_GRAPH_PACKAGE_DEPENDS "libloopbit${abi} ${this}, libloopbit-poses${abi} ${this}")
set(CPACK_DEBIAN_GRAPH_DESCRIPTION "${summary}: pose graphs
 Tells right loops from wrong ones by odometry and corrects the trajectory.")

set(CPACK_DEBIAN_FLEET_PACKAGE_NAME libloopbit-fleet${abi})
set(CPACK_DEBIAN_FLEET_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_FLEET_PACKAGE_DEPENDS "libloopbit${abi} ${this}, libloopbit-map${abi} ${this}")
set(CPACK_DEBIAN_FLEET_DESCRIPTION "${summary}: maps on servers
 Keeps maps in a PostgreSQL database that several robots share.")

set(CPACK_DEBIAN_DATA_PACKAGE_NAME libloopbit-data${abi})
set(CPACK_DEBIAN_DATA_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_DATA_PACKAGE_DEPENDS
    "libloopbit${abi} ${this}, libloopbit-map${abi} ${this}, libloopbit-images${abi} ${this}, libloopbit-poses${abi} ${this}, libloopbit-graph${abi} ${this}")
set(CPACK_DEBIAN_DATA_DESCRIPTION "${summary}: data sets, scores, reports
 Reads ground truth, scores loops, and writes reports.")

# What has all our libraries.
set(libraries "")
foreach(library "" -map -images -poses -graph -data)
  list(APPEND libraries "libloopbit${library}${abi} ${this}")
endforeach()
if(LOOPBIT_BUILD_FLEET)
  list(APPEND libraries "libloopbit-fleet${abi} ${this}")
endif()
list(JOIN libraries ", " libraries)

set(CPACK_DEBIAN_DEV_PACKAGE_NAME libloopbit-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "${libraries}, libopencv-dev")
set(CPACK_DEBIAN_DEV_DESCRIPTION "${summary}: headers
 For programs that use loopbit, with CMake or pkg-config.")

set(CPACK_DEBIAN_TOOLS_PACKAGE_NAME loopbit)
set(CPACK_DEBIAN_TOOLS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOLS_PACKAGE_DEPENDS "${libraries}")
set(CPACK_DEBIAN_TOOLS_DESCRIPTION "${summary}: the command
 Finds loops in image sequences, scores and shows them.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-loopbit)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
if(LOOPBIT_BUILD_PYTHON)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  string(CONCAT CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
         "${libraries}, python3-numpy, "
         "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor})")
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-matplotlib)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${summary}: Python module
 Images are numpy arrays, results are typed objects and structured arrays.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/cmake/debian/postinst
                                              ${PROJECT_SOURCE_DIR}/cmake/debian/prerm)

# Of no version of our libraries: the extension has its own copy of what it needs.
set(CPACK_DEBIAN_POSTGRES_PACKAGE_NAME postgresql-15-loopbit)
set(CPACK_DEBIAN_POSTGRES_PACKAGE_SECTION database)
set(CPACK_DEBIAN_POSTGRES_PACKAGE_DEPENDS postgresql-15)
set(CPACK_DEBIAN_POSTGRES_DESCRIPTION "${summary}: search in PostgreSQL
 CREATE EXTENSION loopbit finds similar places of a map in the server.")

foreach(component ${CPACK_COMPONENTS_ALL})
  string(TOUPPER ${component} upper)
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE
          DESTINATION share/doc/${CPACK_DEBIAN_${upper}_PACKAGE_NAME}
          RENAME copyright
          COMPONENT ${component}
          EXCLUDE_FROM_ALL)
endforeach()
# Of no package above, which have it as copyright.
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT licence)
include(CPack)
