# PETSc and MPI: targets PkgConfig::PETSC, MPI::MPI_C, MPI::MPI_CXX.
# PETSC_DIR and PETSC_ARCH, as cache or environment variables, name a PETSc of one's own.
foreach(name PETSC_DIR PETSC_ARCH)
  if(NOT DEFINED ${name} AND DEFINED ENV{${name}})
    set(${name} "$ENV{${name}}" CACHE STRING "Of a PETSc of one's own") # ninja starts CMake again without today's environment
  endif()
endforeach()

if(PETSC_DIR)
  cmake_path(ABSOLUTE_PATH PETSC_DIR BASE_DIRECTORY ${PROJECT_SOURCE_DIR} NORMALIZE)
  # An in-place build keeps its files in PETSC_ARCH, an installed PETSc has none.
  if(NOT EXISTS "${PETSC_DIR}/${PETSC_ARCH}/lib/pkgconfig/PETSc.pc" AND NOT EXISTS "${PETSC_DIR}/lib/pkgconfig/PETSc.pc")
    # pkg-config would go on to the system's.
    message(FATAL_ERROR "PETSC_DIR=${PETSC_DIR} PETSC_ARCH=${PETSC_ARCH} has no lib/pkgconfig/PETSc.pc: there is no PETSc, or it has not been built, "
                        "or PETSC_ARCH is not the one that it was configured with")
  endif()
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
pkg_get_variable(PETSC_PCFILEDIR PETSc pcfiledir)
pkg_get_variable(petsc_prefix PETSc prefix)
if(petsc_prefix)
  file(REAL_PATH "${petsc_prefix}" petsc_prefix)
endif()
# The cache keeps what has been found for one PETSc: its flags, MPI, SLEPc, libraries that go with it.
if(HHTDAE_PETSC AND NOT HHTDAE_PETSC STREQUAL petsc_prefix)
  message(FATAL_ERROR "${PROJECT_BINARY_DIR} was configured for the PETSc in ${HHTDAE_PETSC}, not for the one in ${petsc_prefix}: "
                      "set PETSC_DIR and PETSC_ARCH as they were, or begin anew, by \"make -f makefile.petsc clean\" or with BUILD=...")
endif()
pkg_check_modules(PETSC REQUIRED IMPORTED_TARGET PETSc>=3.18)
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
file(STRINGS ${petscconf} complex REGEX "^#define PETSC_USE_COMPLEX +1")
file(STRINGS ${petscconf} double REGEX "^#define PETSC_USE_REAL_DOUBLE +1")
if(complex OR NOT double)
  set(scalars "not of double precision")
  if(complex)
    set(scalars "complex")
  endif()
  foreach(found __pkg_config_checked_PETSC ${PETSC_LIBRARIES}) # this PETSc's, and the next may be another
    unset(${found} CACHE)
    unset(pkgcfg_lib_PETSC_${found} CACHE)
  endforeach()
  message(FATAL_ERROR "hhtdae needs a PETSc with real scalars of double precision: those of the PETSc in ${PETSC_PCFILEDIR} are ${scalars}. "
                      "Set PETSC_DIR and PETSC_ARCH to another one")
endif()
set(HHTDAE_PETSC ${petsc_prefix} CACHE INTERNAL "The PETSc of this tree")
find_package(MPI REQUIRED COMPONENTS C CXX)

# SLEPc, for flexible bodies: optional, that of SLEPC_DIR or one beside PETSc. It has to be one for this PETSc; that of the system is for the system's.
# Debian has SLEPc and PETSc in several builds side by side.
if(NOT SLEPC_DIR AND NOT "$ENV{SLEPC_DIR}" STREQUAL "")
  set(SLEPC_DIR "$ENV{SLEPC_DIR}" CACHE STRING "Of a SLEPc of one's own")
endif()
if(SLEPC_DIR)
  set(ENV{PKG_CONFIG_PATH} "${SLEPC_DIR}/${PETSC_ARCH}/lib/pkgconfig:${SLEPC_DIR}/lib/pkgconfig:$ENV{PKG_CONFIG_PATH}")
endif()
pkg_search_module(SLEPC QUIET IMPORTED_TARGET SLEPc slepc)
if(SLEPC_FOUND)
  pkg_get_variable(SLEPC_PCFILEDIR ${SLEPC_MODULE_NAME} pcfiledir)
  find_file(slepcconf slepcconf.h HINTS ${SLEPC_INCLUDE_DIRS} REQUIRED NO_CACHE)
  file(STRINGS ${slepcconf} petsc_of_slepc REGEX "^#define SLEPC_PETSC_(DIR|ARCH)")
  string(REGEX REPLACE "^[^\"]*\"([^\"]*)\"[^\"]*\"([^\"]*)\".*" "\\1/\\2/include/petscconf.h" petsc_of_slepc "${petsc_of_slepc}")
  set(same_petsc TRUE)
  if(EXISTS "${petsc_of_slepc}")
    file(SHA256 "${petsc_of_slepc}" conf_of_slepc)
    file(SHA256 "${petscconf}" conf_of_petsc)
    string(COMPARE EQUAL "${conf_of_slepc}" "${conf_of_petsc}" same_petsc)
  endif()
  string(REGEX MATCH "^[0-9]+\\.[0-9]+" SLEPC_MINOR_VERSION "${SLEPC_VERSION}")
  if(NOT SLEPC_MINOR_VERSION STREQUAL PETSC_MINOR_VERSION
     OR (SLEPC_PCFILEDIR MATCHES "^/usr/(lib|share)" AND NOT PETSC_PCFILEDIR MATCHES "^/usr/(lib|share)")
     OR NOT same_petsc)
    message(STATUS "SLEPc ${SLEPC_VERSION} from ${SLEPC_PCFILEDIR} is not for this PETSc: it is left out")
    set(SLEPC_FOUND FALSE)
  endif()
endif()

set(CMAKE_REQUIRED_LIBRARIES PkgConfig::PETSC MPI::MPI_C)
include(CheckCSourceCompiles)
check_c_source_compiles("#include <petscsys.h>
int main(void) { return PetscInitializeNoArguments(); }" HHTDAE_PETSC_COMPILES)
unset(CMAKE_REQUIRED_LIBRARIES)
if(NOT HHTDAE_PETSC_COMPILES)
  unset(HHTDAE_PETSC_COMPILES CACHE)
  message(FATAL_ERROR "No program can be compiled and linked with PETSc ${PETSC_VERSION} in ${PETSC_PCFILEDIR} and the MPI in ${MPI_C_LIBRARIES}; "
                      "the log in ${PROJECT_BINARY_DIR}/CMakeFiles tells why. -D MPI_C_COMPILER=... and MPI_CXX_COMPILER name another MPI, in a new build tree")
endif()
