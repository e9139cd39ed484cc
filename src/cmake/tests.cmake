# Everything that ctest runs. GoogleTest programs, of which those named by a room of src/ link no more than that, then scripts
# which use the library from the outside.
find_package(GTest)
if(NOT GTest_FOUND)
  message(STATUS "GoogleTest not found: only the integration tests are built (Debian: libgtest-dev)")
endif()

# Without scenes, so that their headers may change, and with
if(HHTDAE_PRECOMPILE AND GTest_FOUND)
  hhtdae_precompiled(precompiled_for_solvers hhtdae <petscts.h> <algorithm> <cmath> <functional> <map> <memory> <string> <vector> <gtest/gtest.h>)
  hhtdae_precompiled(precompiled_for_tests hhtscene ${HHTDAE_PRECOMPILED} <gtest/gtest.h> <hhtdae/scene.h>)
  foreach(name precompiled_for_solvers precompiled_for_tests)
    target_link_libraries(${name} PRIVATE GTest::gtest)
    target_compile_options(${name} PRIVATE -O1)
  endforeach()
endif()

# One thread per process, and Open MPI as root and with more ranks than cores
set(test_environment OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 OMPI_ALLOW_RUN_AS_ROOT=1
                     OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMPI_MCA_rmaps_base_oversubscribe=1
                     OMPI_MCA_btl_vader_single_copy_mechanism=none OMPI_MCA_btl_base_warn_component_unused=0)
if(HHTDAE_SANITIZE)
  # Leaks are valgrind's: Open MPI is compiled without frame pointers, so that its own could be told from ours by whole stacks only,
  # which take ten times the time of all tests.
  list(APPEND test_environment UBSAN_OPTIONS=print_stacktrace=1 ASAN_OPTIONS=detect_leaks=0)
endif()

# A single process needs no daemon of Open MPI, and nobody needs hwloc's search for graphics cards: start-up is several
# times faster without the two. All such processes would share one session directory, which the first one to end removes.
set(serial_environment ${test_environment} OMPI_MCA_ess_singleton_isolated=1 OMPI_MCA_orte_create_session_dirs=0
                       OMPI_MCA_sharedfp=individual HWLOC_COMPONENTS=-gl,-opencl)
list(APPEND test_environment HWLOC_COMPONENTS=-gl,-opencl)

# What all test programs link: their main program, and dense linear algebra
if(GTest_FOUND)
  file(GLOB common_sources CONFIGURE_DEPENDS tests/*.cpp)
  add_library(test_common OBJECT EXCLUDE_FROM_ALL ${common_sources})
  target_include_directories(test_common PRIVATE include)
  target_compile_options(test_common PRIVATE -O1)
  target_link_libraries(test_common PRIVATE PkgConfig::PETSC MPI::MPI_CXX Eigen3::Eigen GTest::gtest)
endif()

# hhtdae_test_program(folder): <folder>_tests from tests/<folder>/*.cpp; sets <folder>_found
function(hhtdae_test_program folder)
  file(GLOB sources CONFIGURE_DEPENDS tests/${folder}/*.cpp)
  set(common)
  if(folder STREQUAL verification) # the laws of Newton and Euler for the bodies of a scene
    file(GLOB common CONFIGURE_DEPENDS tests/balance/*.cpp)
  endif()
  set(${folder}_found FALSE PARENT_SCOPE)
  if(sources AND GTest_FOUND)
    set(precompiled precompiled_for_tests)
    if(folder MATCHES "^(integrator|linear)$")
      set(precompiled precompiled_for_solvers)
    endif()
    hhtdae_program(${folder}_tests OPEN PRECOMPILED ${precompiled} ${sources} ${common})
    if(NOT TARGET ${folder}_tests) # without SLEPc
      return()
    endif()
    target_include_directories(${folder}_tests PRIVATE src tests tests/${folder})
    target_link_libraries(${folder}_tests PRIVATE test_common GTest::gtest)
    target_compile_options(${folder}_tests PRIVATE -O1) # compiling takes longer than running
    if(HHTDAE_TOGETHER AND NOT folder MATCHES "^(linear|stability)$") # these are few
      list(LENGTH sources count)
      set(most 4)
      if(folder STREQUAL scene) # kernels take longest
        set(most 3)
      endif()
      math(EXPR count "(${count} + ${most} - 1) / ${most}")
      hhtdae_together(${folder} ${count} ${sources})
      set_target_properties(${folder}_tests PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP UNITY_BUILD_CODE_BEFORE_INCLUDE "#include \"support.h\"")
      target_compile_options(${folder}_tests PRIVATE -Wno-subobject-linkage) # fixtures in nameless namespaces
    endif()
    if(NOT page_lacks AND folder MATCHES "^(scene|flexible|parallel)$") # pages are unpacked by zlib
      target_compile_definitions(${folder}_tests PRIVATE HHTDAE_PAGE)
      target_link_libraries(${folder}_tests PRIVATE ZLIB::ZLIB)
    endif()
    set(${folder}_found TRUE PARENT_SCOPE)
  endif()
endfunction()

set(rooms integrator linear scene flexible)
set(suite_timeout 600)
set(parallel_timeout 600)
if(HHTDAE_SANITIZE)
  set(suite_timeout 3000)
  set(parallel_timeout 3000)
endif()
string(REPLACE ";" "|" suite_environment "${serial_environment}")
foreach(folder IN LISTS rooms ITEMS verification stability)
  hhtdae_test_program(${folder})
  if(${folder}_found)
    set(listed ${PROJECT_BINARY_DIR}/${folder}_suites.cmake)
    add_custom_command(TARGET ${folder}_tests POST_BUILD BYPRODUCTS ${listed} VERBATIM
                       COMMAND ${CMAKE_COMMAND} -DPROGRAM=$<TARGET_FILE:${folder}_tests> -DROOM=${folder} -DTIMEOUT=${suite_timeout}
                               "-DENVIRONMENT=${suite_environment}" -DRESULTS=${PROJECT_BINARY_DIR}/suites -DOUTPUT=${listed}
                               -P ${PROJECT_SOURCE_DIR}/src/cmake/suites.cmake)
    file(WRITE ${PROJECT_BINARY_DIR}/${folder}_tests.cmake
         "if(EXISTS [=[${listed}]=])\n  include([=[${listed}]=])\nelse()\n  add_test(${folder}_tests_NOT_BUILT ${folder}_tests_NOT_BUILT)\nendif()\n")
    set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES ${PROJECT_BINARY_DIR}/${folder}_tests.cmake)
  endif()
endforeach()

hhtdae_test_program(parallel)
if(parallel_found)
  foreach(ranks 1 2 3)
    add_test(NAME parallel.${ranks} COMMAND ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG} ${ranks}
                                            $<TARGET_FILE:parallel_tests>)
    set_tests_properties(parallel.${ranks} PROPERTIES ENVIRONMENT "${test_environment}" TIMEOUT ${parallel_timeout}
                                                      LABELS parallel PROCESSORS ${ranks})
  endforeach()
endif()

# Damaged input for every reader of files; "make fuzz" has more of it. HDF5's files need its headers.
file(GLOB fuzz_sources CONFIGURE_DEPENDS tests/fuzz/*.cpp)
if(NOT HHTDAE_HDF5_INCLUDE_DIR OR NOT HHTDAE_HDF5_LIBRARY)
  list(FILTER fuzz_sources EXCLUDE REGEX "bodies\\.cpp$")
endif()
if(GTest_FOUND)
  hhtdae_program(fuzz PRECOMPILED precompiled_for_tests ${fuzz_sources})
  target_include_directories(fuzz PRIVATE src tests)
  target_compile_options(fuzz PRIVATE -O1)
  target_link_libraries(fuzz PRIVATE GTest::gtest)
  if(HHTDAE_HDF5_INCLUDE_DIR AND HHTDAE_HDF5_LIBRARY)
    target_include_directories(fuzz SYSTEM PRIVATE ${HHTDAE_HDF5_INCLUDE_DIR})
    target_link_libraries(fuzz PRIVATE ${HHTDAE_HDF5_LIBRARY})
  endif()
  add_test(NAME fuzz.readers COMMAND fuzz -count 400 -seed 2 -output ${PROJECT_BINARY_DIR}/fuzz)
  set_tests_properties(fuzz.readers PROPERTIES ENVIRONMENT "${serial_environment}" TIMEOUT 900 LABELS fuzz)
endif()

# A slice of the random models of "make soak", small ones of another seed
if(TARGET models)
  add_test(NAME soak.models COMMAND models -small -seed 2 -count 20 -jobs 1 -output none)
  set_tests_properties(soak.models PROPERTIES ENVIRONMENT "${serial_environment}" TIMEOUT 900 LABELS soak)
endif()

# The integration tests start other programs, which a library with a sanitizer inside would need to be preloaded into.
if(HHTDAE_SANITIZE)
  return()
endif()

# petsc4py belongs to the system's python, which need not be the first in PATH.
find_program(HHTDAE_PYTHON NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(HHTDAE_PYTHON NAMES python3)
if(NOT HHTDAE_PYTHON)
  message(STATUS "python3 not found: the integration tests are left out")
  return()
endif()

# hhtdae_script(name arguments...): ctest's test integration.<name> runs tests/integration/<name>.py; exit 77 skips. Its programs are
# alone but for those that it starts with mpiexec itself.
function(hhtdae_script name)
  add_test(NAME integration.${name}
           COMMAND ${HHTDAE_PYTHON} -B ${PROJECT_SOURCE_DIR}/tests/integration/${name}.py ${ARGN})
  set_tests_properties(integration.${name} PROPERTIES ENVIRONMENT "${serial_environment}" TIMEOUT 600
                                                      LABELS integration SKIP_RETURN_CODE 77)
endfunction()

# PETSc's own tutorials, compiled as they are and not linked with us
file(GLOB tutorial_dirs /usr/share/petsc/*/share/petsc/examples/src/ts/tutorials)
foreach(name ex43 ex44)
  find_file(HHTDAE_TUTORIAL_${name} ${name}.c NO_DEFAULT_PATH
            PATHS ${PETSC_DIR}/src/ts/tutorials ${PETSC_DIR}/share/petsc/examples/src/ts/tutorials ${tutorial_dirs})
  set(program missing)
  if(HHTDAE_TUTORIAL_${name})
    add_executable(${name} ${HHTDAE_TUTORIAL_${name}})
    target_link_libraries(${name} PRIVATE PkgConfig::PETSC MPI::MPI_C m)
    target_compile_options(${name} PRIVATE -w)
    set(program $<TARGET_FILE:${name}>)
  endif()
  set(${name} ${program})
  hhtdae_script(plugin_${name} $<TARGET_FILE:hhtdae> ${program} ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG})
endforeach()
set_tests_properties(integration.plugin_ex44 PROPERTIES PROCESSORS 2)
foreach(other IN ITEMS later complex)
  add_library(${other}_petsc MODULE tests/integration/${other}_petsc.c)
  target_link_libraries(${other}_petsc PRIVATE PkgConfig::PETSC MPI::MPI_C)
endforeach()
hhtdae_script(plugin_version $<TARGET_FILE:hhtdae> ${ex43} $<TARGET_FILE:later_petsc> $<TARGET_FILE:complex_petsc> ${PETSC_VERSION})
hhtdae_script(second_petsc ${PROJECT_SOURCE_DIR} ${CMAKE_COMMAND} $<TARGET_FILE:hhtdae> ${PETSC_VERSION} "${HHTDAE_TUTORIAL_ex43}")
set_tests_properties(integration.second_petsc PROPERTIES TIMEOUT 1800) # builds the integrator
set(libraries $<TARGET_FILE:hhtdae> $<TARGET_FILE:hhtscene>)
if(TARGET hhtflexible)
  list(APPEND libraries $<TARGET_FILE:hhtflexible>)
endif()
hhtdae_script(petsc_choice ${PROJECT_SOURCE_DIR} ${CMAKE_COMMAND} ${PETSC_PCFILEDIR})
hhtdae_script(exports ${PROJECT_SOURCE_DIR}/include ${libraries})
hhtdae_script(python_pendulum $<TARGET_FILE:hhtdae>)

# The Python package, from the build tree: a test for each file of tests/python
if(TARGET python)
  file(GLOB python_tests CONFIGURE_DEPENDS tests/python/test_*.py)
  foreach(source IN LISTS python_tests)
    cmake_path(GET source STEM name)
    string(REGEX REPLACE "^test_" "" name ${name})
    set(environment ${serial_environment})
    if(name STREQUAL "parallel")
      set(environment ${test_environment} "HHTDAE_MPIEXEC=${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG}")
    endif()
    if(name STREQUAL "install")
      list(APPEND environment HHTDAE_BUILD=${PROJECT_BINARY_DIR} HHTDAE_CMAKE=${CMAKE_COMMAND})
    endif()
    add_test(NAME python.${name} COMMAND ${hhtdae_python} -B ${source})
    set_tests_properties(python.${name} PROPERTIES ENVIRONMENT "${environment};PYTHONPATH=${PROJECT_BINARY_DIR}/python" TIMEOUT 300 LABELS python)
    if(name STREQUAL "parallel")
      set_tests_properties(python.${name} PROPERTIES PROCESSORS 3)
    endif()
  endforeach()
endif()
hhtdae_script(documents ${PROJECT_SOURCE_DIR})
hhtdae_script(setup ${PROJECT_SOURCE_DIR} ${PROJECT_BINARY_DIR}/setup)
hhtdae_script(docs ${PROJECT_BINARY_DIR} ${CMAKE_COMMAND})
if(HHTDAE_PROGRAMS)
  set(with_python)
  if(TARGET python)
    set(with_python ${hhtdae_python} ${PROJECT_BINARY_DIR}/python)
  endif()
  hhtdae_script(tutorial ${PROJECT_SOURCE_DIR} ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_BINARY_DIR}/tutorial ${with_python})
  if(NOT page_lacks)
    hhtdae_script(page ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_BINARY_DIR}/page ${with_python})
  endif()
  if(TARGET solidbeam)
    hhtdae_script(bench_scripts ${PROJECT_SOURCE_DIR} $<TARGET_FILE:solidbeam> $<TARGET_FILE:fullbody> ${PROJECT_BINARY_DIR}/bench_scripts
                  ${MPIEXEC_EXECUTABLE})
    set_tests_properties(integration.bench_scripts PROPERTIES PROCESSORS 2 ENVIRONMENT "${test_environment}") # scripts that start mpiexec
  endif()
  hhtdae_script(examples ${CMAKE_RUNTIME_OUTPUT_DIRECTORY})
  hhtdae_script(unused_options $<TARGET_FILE:pendulum> $<TARGET_FILE:chain> ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG})
  hhtdae_script(fp_trap $<TARGET_FILE:pendulum> $<TARGET_FILE:doublependulum> $<TARGET_FILE:campbell>)
  # A slice of "make kill9", and every example resumed in its middle
  hhtdae_script(kill9 ${CMAKE_RUNTIME_OUTPUT_DIRECTORY} ${PROJECT_BINARY_DIR}/kill9 10)
  foreach(ranks 1 2)
    add_test(NAME integration.resume.${ranks}
             COMMAND ${HHTDAE_PYTHON} -B ${PROJECT_SOURCE_DIR}/tests/integration/resume.py ${CMAKE_RUNTIME_OUTPUT_DIRECTORY}
                     ${PROJECT_BINARY_DIR}/resume ${ranks})
    set_tests_properties(integration.resume.${ranks} PROPERTIES ENVIRONMENT "${serial_environment}" TIMEOUT 900 LABELS integration
                                                                PROCESSORS ${ranks})
  endforeach()
endif()
hhtdae_script(install ${PROJECT_BINARY_DIR} ${CMAKE_COMMAND} $<CONFIG> ${PETSC_PCFILEDIR})
hhtdae_script(instructions ${PROJECT_BINARY_DIR} ${CMAKE_COMMAND} $<CONFIG> ${PETSC_PCFILEDIR} ${SLEPC_PCFILEDIR})
if(TARGET hhtreduce)
  hhtdae_script(hhtreduce $<TARGET_FILE:hhtreduce> ${MPIEXEC_EXECUTABLE} ${MPIEXEC_NUMPROC_FLAG})
endif()
# One makes the documentation anew, the others install it
foreach(test IN ITEMS python.install integration.docs integration.install integration.instructions)
  if(TEST ${test})
    set_tests_properties(${test} PROPERTIES RESOURCE_LOCK documentation)
  endif()
endforeach()

# What takes longest is begun first, also where no run before has told how long it takes: what is left to the end keeps one processor only.
foreach(test IN ITEMS integration.instructions integration.install soak.models integration.page integration.resume.1 integration.kill9 integration.hhtreduce
                      fuzz.readers integration.resume.2)
  if(TEST ${test})
    set_tests_properties(${test} PROPERTIES COST 100)
  endif()
endforeach()
