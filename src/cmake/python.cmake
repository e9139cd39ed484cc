# The Python package hhtdae: extension modules from src/python, the package's own files from src/python/hhtdae, together in
# <build>/python. It is for the interpreter whose petsc4py belongs to the PETSc that we build against; the first python3 in PATH
# need not be that one, so that Debian's is asked first. HHTDAE_PYTHON names another one, HHTDAE_PYTHON_DIR where to install.
option(HHTDAE_WITH_PYTHON "Build the Python package where Python, pybind11 and petsc4py are there" ON)
if(NOT HHTDAE_WITH_PYTHON)
  return()
endif()
if(HHTDAE_SANITIZE) # an interpreter without the sanitizer inside cannot load it
  return()
endif()

# What the build needs to know of an interpreter, a line for each; nothing if it has no petsc4py for this PETSc
set(question [[
import os, sys, sysconfig
import petsc4py
config = petsc4py.get_config()
directory = os.path.realpath(os.path.join(config["PETSC_DIR"], config.get("PETSC_ARCH") or ""))
if directory != os.path.realpath(sys.argv[1]):
    sys.exit("its petsc4py is for the PETSc in " + directory)
try:
    import pybind11
    headers = pybind11.get_include()
except ImportError:
    headers = ""
print(petsc4py.get_include(), sysconfig.get_path("include"), sysconfig.get_config_var("EXT_SUFFIX"), headers, "%d.%d" % sys.version_info[:2],
      os.path.basename(sysconfig.get_path("platlib")), sep=";")
]])
unset(hhtdae_python_answer)
foreach(candidate IN ITEMS "${HHTDAE_PYTHON}" /usr/bin/python3 python3)
  if(NOT candidate OR hhtdae_python_answer)
    continue()
  endif()
  execute_process(COMMAND ${candidate} -c "${question}" "${petsc_prefix}" RESULT_VARIABLE failed OUTPUT_VARIABLE answer ERROR_QUIET
                  OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT failed)
    set(hhtdae_python_answer "${answer}")
    set(hhtdae_python ${candidate})
  endif()
endforeach()
if(NOT hhtdae_python_answer)
  message(STATUS "No Python with petsc4py for this PETSc: the Python package is left out (Debian: python3-petsc4py)")
  return()
endif()
list(GET hhtdae_python_answer 0 petsc4py_include)
list(GET hhtdae_python_answer 1 python_include)
list(GET hhtdae_python_answer 2 python_suffix)
list(GET hhtdae_python_answer 3 pybind11_hint)
list(GET hhtdae_python_answer 4 python_version)
list(GET hhtdae_python_answer 5 python_packages)
find_path(HHTDAE_PYBIND11_INCLUDE_DIR pybind11/pybind11.h HINTS ${pybind11_hint})
if(NOT HHTDAE_PYBIND11_INCLUDE_DIR OR NOT EXISTS ${python_include}/Python.h)
  message(STATUS "pybind11 or Python.h not found: the Python package is left out (Debian: pybind11-dev python3-dev)")
  return()
endif()
message(STATUS "Python package for ${hhtdae_python}, version ${python_version}")
set(HHTDAE_PYTHON_DIR lib/python${python_version}/${python_packages} CACHE STRING "Where Python packages are installed, below the prefix")

set(package_build ${PROJECT_BINARY_DIR}/python/hhtdae)
file(RELATIVE_PATH from_package ${CMAKE_INSTALL_PREFIX}/${HHTDAE_PYTHON_DIR}/hhtdae ${CMAKE_INSTALL_FULL_LIBDIR})
add_custom_target(python ALL)

# hhtdae_python_module(name library sources...): nothing of Python is linked, the interpreter has it
function(hhtdae_python_module name library)
  add_library(python_${name} MODULE ${ARGN})
  target_include_directories(python_${name} SYSTEM PRIVATE ${python_include} ${HHTDAE_PYBIND11_INCLUDE_DIR} ${petsc4py_include})
  target_include_directories(python_${name} PRIVATE ${PROJECT_SOURCE_DIR}/src/python)
  target_compile_options(python_${name} PRIVATE -O1 ${HHTDAE_LINES} -fno-math-errno)
  target_link_libraries(python_${name} PRIVATE ${library})
  if(HHTDAE_PRECOMPILE AND TARGET python__core AND NOT name STREQUAL _core)
    target_precompile_headers(python_${name} REUSE_FROM python__core)
  elseif(HHTDAE_PRECOMPILE)
    target_precompile_headers(python_${name} PRIVATE ${HHTDAE_PRECOMPILED} <hhtdae/scene.h> <pybind11/pybind11.h> <pybind11/numpy.h>)
  endif()
  set_target_properties(python_${name} PROPERTIES DEFINE_SYMBOL "" OUTPUT_NAME ${name} PREFIX "" SUFFIX "${python_suffix}" CXX_VISIBILITY_PRESET hidden
                        LIBRARY_OUTPUT_DIRECTORY ${package_build} INSTALL_RPATH "$ORIGIN/lib;$ORIGIN/${from_package}") # of a wheel, and of a prefix
  install(TARGETS python_${name} LIBRARY DESTINATION ${HHTDAE_PYTHON_DIR}/hhtdae)
  add_dependencies(python python_${name})
  add_dependencies(installed python_${name})
endfunction()

file(GLOB python_sources CONFIGURE_DEPENDS src/python/*.cpp)
list(FILTER python_sources EXCLUDE REGEX "flexible\\.cpp$")
hhtdae_python_module(_core hhtscene ${python_sources})
if(HHTDAE_TOGETHER)
  set(python_together ${python_sources})
  list(FILTER python_together EXCLUDE REGEX "tape\\.cpp$")
  hhtdae_together(python 4 ${python_together})
  set_target_properties(python__core PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endif()
# Loops over numbers take the time that functions traced from Python take in a run.
set_source_files_properties(src/python/tape.cpp PROPERTIES COMPILE_OPTIONS -O2 SKIP_PRECOMPILE_HEADERS ON)
if(TARGET hhtflexible)
  hhtdae_python_module(_flexible hhtflexible src/python/flexible.cpp src/python/bind.cpp)
endif()

file(GLOB python_files CONFIGURE_DEPENDS src/python/hhtdae/*.py src/python/hhtdae/*.pyi src/python/hhtdae/py.typed)
foreach(source IN LISTS python_files)
  cmake_path(GET source FILENAME file)
  add_custom_command(OUTPUT ${package_build}/${file} COMMAND ${CMAKE_COMMAND} -E copy ${source} ${package_build}/${file} DEPENDS ${source} VERBATIM)
  list(APPEND python_copies ${package_build}/${file})
endforeach()
add_custom_target(python_files DEPENDS ${python_copies})
add_dependencies(python python_files)
install(FILES ${python_files} DESTINATION ${HHTDAE_PYTHON_DIR}/hhtdae)
