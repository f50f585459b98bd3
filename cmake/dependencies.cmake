# SPDX-License-Identifier: GPL-3.0-or-later
# One macro: everything Fibrolite links, as imported targets. The packages that bring them are in cmake/packages.txt.

# Debian ships neither a config nor a .pc file for some: make a target from its header and library.
function(import_library target header library)
  if(TARGET ${target})
    return()
  endif()
  string(MAKE_C_IDENTIFIER ${target} id)
  find_path(${id}_INCLUDE ${header} PATH_SUFFIXES ${ARGN} REQUIRED)
  find_library(${id}_LIBRARY ${library} REQUIRED)
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${${id}_LIBRARY}
                                             INTERFACE_INCLUDE_DIRECTORIES ${${id}_INCLUDE})
endfunction()

# Debian's OpenVDB comes without a config file, and its find module asks for Imath's Python bindings.
macro(find_openvdb)
  find_package(TBB CONFIG REQUIRED)
  import_library(OpenVDB::openvdb openvdb/openvdb.h openvdb)
  import_library(OpenVDB::imath half.h Imath Imath)
  set_property(TARGET OpenVDB::openvdb APPEND PROPERTY INTERFACE_LINK_LIBRARIES OpenVDB::imath TBB::tbb)
  set_property(TARGET OpenVDB::openvdb APPEND PROPERTY INTERFACE_COMPILE_FEATURES cxx_std_17)
endmacro()

macro(find_dependencies)
  find_openvdb()
  set(CGAL_DO_NOT_WARN_ABOUT_CMAKE_BUILD_TYPE TRUE)
  find_package(CGAL 5.5 REQUIRED)
  foreach(module core imgproc imgcodecs) # the config file comes with all of OpenCV only
    import_library(opencv_${module} opencv2/${module}.hpp opencv_${module} opencv4)
  endforeach()
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
  find_package(CLI11 REQUIRED)
  find_package(nlohmann_json 3.11 REQUIRED)
  import_library(SuiteSparse::cholmod cholmod.h cholmod suitesparse)
  import_library(OpenBLAS::openblas cblas.h openblas openblas-pthread x86_64-linux-gnu/openblas-pthread)
  import_library(TetGen::tet tetgen.h tet)
  import_library(lib3mf::lib3mf Model/COM/NMR_DLLInterfaces.h 3MF lib3mf)
  if(FIBROLITE_TESTS)
    find_package(GTest REQUIRED)
  endif()
  if(FIBROLITE_BENCHMARKS)
    find_package(benchmark REQUIRED)
  endif()
endmacro()
