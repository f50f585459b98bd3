# SPDX-License-Identifier: GPL-3.0-or-later
# Everything Fibrolite links, as imported targets. The packages that bring them are in cmake/packages.txt. This file is installed
# too: fibroliteConfig.cmake calls fibrolite_find_libraries().

# Debian ships neither a config nor a .pc file for some: make a target from a header and a library.
function(fibrolite_import target header library)
  if(TARGET ${target})
    return()
  endif()
  string(MAKE_C_IDENTIFIER fibrolite_${target} id)
  find_path(${id}_INCLUDE ${header} PATH_SUFFIXES ${ARGN} REQUIRED)
  find_library(${id}_LIBRARY ${library} PATH_SUFFIXES ${ARGN} REQUIRED)
  mark_as_advanced(${id}_INCLUDE ${id}_LIBRARY)
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION ${${id}_LIBRARY}
                                             INTERFACE_INCLUDE_DIRECTORIES ${${id}_INCLUDE})
endfunction()

# What the two libraries link; their users need these at link time, since both are static.
macro(fibrolite_find_libraries)
  find_package(TBB CONFIG REQUIRED)
  # OpenVDB comes without a config file, and its find module asks for Imath's Python bindings (docs/decisions/0003).
  if(NOT TARGET OpenVDB::openvdb)
    fibrolite_import(OpenVDB::openvdb openvdb/openvdb.h openvdb)
    fibrolite_import(OpenVDB::half half.h Imath Imath)
    set_property(TARGET OpenVDB::openvdb APPEND PROPERTY INTERFACE_LINK_LIBRARIES OpenVDB::half TBB::tbb)
    set_property(TARGET OpenVDB::openvdb APPEND PROPERTY INTERFACE_COMPILE_FEATURES cxx_std_17)
  endif()
  find_package(ZLIB REQUIRED)
  fibrolite_import(lib3mf::lib3mf Model/COM/NMR_DLLInterfaces.h 3MF lib3mf)
  fibrolite_import(GMP::mpfr mpfr.h mpfr) # CGAL itself is headers only, found where the compiler looks
  fibrolite_import(GMP::gmp gmp.h gmp)
  find_package(PNG REQUIRED)
  foreach(module core imgproc) # OpenCV's config file comes with all of OpenCV only
    fibrolite_import(OpenCV::${module} opencv2/${module}.hpp opencv_${module} opencv4)
  endforeach()
  fibrolite_import(SuiteSparse::cholmod cholmod.h cholmod suitesparse)
  fibrolite_import(OpenBLAS::openblas cblas.h openblas openblas-pthread)
endmacro()

# What only our own build needs: header-only libraries, the program's, the tests'.
macro(fibrolite_find_build_tools)
  find_package(Eigen3 3.4 REQUIRED NO_MODULE)
  find_package(nlohmann_json 3.11 REQUIRED)
  find_package(CLI11 REQUIRED)
  fibrolite_import(TetGen::tet tetgen.h tet)
  fibrolite_import(OpenCV::imgcodecs opencv2/imgcodecs.hpp opencv_imgcodecs opencv4)
  if(FIBROLITE_TESTS)
    find_package(GTest REQUIRED)
  endif()
  if(FIBROLITE_BENCHMARKS)
    find_package(benchmark REQUIRED)
  endif()
endmacro()
