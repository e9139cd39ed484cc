# PETSc and MPI: targets PkgConfig::PETSC, MPI::MPI_C, MPI::MPI_CXX.
# PETSC_DIR and PETSC_ARCH, as cache or environment variables, name a PETSc of one's own.
foreach(name PETSC_DIR PETSC_ARCH)
  if(NOT DEFINED ${name} AND DEFINED ENV{${name}})
    set(${name} $ENV{${name}})
  endif()
endforeach()

if(PETSC_DIR)
  # An in-place build keeps its files in PETSC_ARCH, an installed PETSc has none.
  set(ENV{PKG_CONFIG_PATH}
      "${PETSC_DIR}/${PETSC_ARCH}/lib/pkgconfig:${PETSC_DIR}/lib/pkgconfig:$ENV{PKG_CONFIG_PATH}")
  # A PETSc that built its own MPI needs that one and no other.
  foreach(language C CXX)
    string(REPLACE "CXX" "cxx" wrapper "mpi${language}")
    string(REPLACE "mpiC" "mpicc" wrapper "${wrapper}")
    if(NOT MPI_${language}_COMPILER AND EXISTS "${PETSC_DIR}/${PETSC_ARCH}/bin/${wrapper}")
      set(MPI_${language}_COMPILER "${PETSC_DIR}/${PETSC_ARCH}/bin/${wrapper}")
    endif()
  endforeach()
endif()

find_package(PkgConfig REQUIRED)
pkg_check_modules(PETSC REQUIRED IMPORTED_TARGET PETSc>=3.18)
pkg_get_variable(PETSC_PCFILEDIR PETSc pcfiledir)
find_package(MPI REQUIRED COMPONENTS C CXX)
string(REGEX MATCH "^[0-9]+\\.[0-9]+" PETSC_MINOR_VERSION "${PETSC_VERSION}")
string(REGEX MATCH "^([0-9]+)\\.([0-9]+)" PETSC_NEXT_MINOR_VERSION "${PETSC_VERSION}")
math(EXPR PETSC_NEXT_MINOR_VERSION "${CMAKE_MATCH_2} + 1")
string(PREPEND PETSC_NEXT_MINOR_VERSION "${CMAKE_MATCH_1}.")
message(STATUS "PETSc ${PETSC_VERSION} from ${PETSC_PCFILEDIR}")

# PETSC_HAS_<package>: what PETSc was built with, and so may be used by us, too
find_file(petscconf petscconf.h HINTS ${PETSC_INCLUDE_DIRS} REQUIRED NO_CACHE)
foreach(package HDF5 MUMPS)
  file(STRINGS ${petscconf} PETSC_HAS_${package} REGEX "^#define PETSC_HAVE_${package} +1")
endforeach()

# SLEPc, for flexible bodies: optional. It has to be one for this PETSc; that of the system is for the system's.
pkg_search_module(SLEPC QUIET IMPORTED_TARGET SLEPc slepc)
if(SLEPC_FOUND)
  pkg_get_variable(SLEPC_PCFILEDIR ${SLEPC_MODULE_NAME} pcfiledir)
  string(REGEX MATCH "^[0-9]+\\.[0-9]+" SLEPC_MINOR_VERSION "${SLEPC_VERSION}")
  if(NOT SLEPC_MINOR_VERSION STREQUAL PETSC_MINOR_VERSION
     OR (SLEPC_PCFILEDIR MATCHES "^/usr/(lib|share)" AND NOT PETSC_PCFILEDIR MATCHES "^/usr/(lib|share)"))
    message(STATUS "SLEPc ${SLEPC_VERSION} from ${SLEPC_PCFILEDIR} is not for this PETSc: it is left out")
    set(SLEPC_FOUND FALSE)
  endif()
endif()

set(CMAKE_REQUIRED_LIBRARIES PkgConfig::PETSC MPI::MPI_C)
include(CheckCSourceCompiles)
check_c_source_compiles("#include <petscsys.h>
#if defined(PETSC_USE_COMPLEX) || !defined(PETSC_USE_REAL_DOUBLE)
#error
#endif
int main(void) { return 0; }" HHTDAE_PETSC_IS_REAL_DOUBLE)
unset(CMAKE_REQUIRED_LIBRARIES)
if(NOT HHTDAE_PETSC_IS_REAL_DOUBLE)
  message(FATAL_ERROR "hhtdae needs a PETSc with real double scalars and its MPI; PETSc ${PETSC_VERSION} in "
                      "${PETSC_PCFILEDIR} is not one (or does not compile): set PETSC_DIR and PETSC_ARCH to one that is")
endif()
