# Each tests/bench/*.cpp and tests/soak/*.cpp is one program of its own; the random models judge their bodies by tests/balance.

# SUNDIALS IDA, to compare with: optional
set(ida_libraries)
foreach(library sundials_ida sundials_nvecserial sundials_sunmatrixdense sundials_sunmatrixsparse
                sundials_sunlinsoldense sundials_sunlinsolklu sundials_generic klu)
  find_library(${library}_LIBRARY ${library})
  list(APPEND ida_libraries ${${library}_LIBRARY})
endforeach()
find_path(SUNDIALS_INCLUDE_DIR ida/ida.h)
# SUNDIALS' KLU module includes klu.h by its bare name.
find_path(KLU_INCLUDE_DIR klu.h PATH_SUFFIXES suitesparse)
if("${ida_libraries};${SUNDIALS_INCLUDE_DIR};${KLU_INCLUDE_DIR}" MATCHES "NOTFOUND")
  set(ida_found FALSE)
else()
  set(ida_found TRUE)
endif()

# The target "bench" compiles them; of all the others only these are part of the tests.
set(tested_benchmarks models solidbeam fullbody)
add_custom_target(bench)
file(GLOB bench_sources CONFIGURE_DEPENDS tests/bench/*.cpp tests/soak/*.cpp)
foreach(source IN LISTS bench_sources)
  cmake_path(GET source STEM name)
  # What includes nothing of the source tree uses the libraries as they are installed.
  file(STRINGS ${source} own_headers REGEX "#include \"")
  if(own_headers)
    set(balance)
    if(name STREQUAL models AND TARGET hhtflexible)
      file(GLOB balance CONFIGURE_DEPENDS tests/balance/*.cpp)
    endif()
    hhtdae_program(${name} OPEN ${source} ${balance})
  else()
    hhtdae_program(${name} ${source})
  endif()
  if(NOT TARGET ${name}) # without SLEPc
    continue()
  endif()
  add_dependencies(bench ${name})
  if(NOT name IN_LIST tested_benchmarks)
    set_target_properties(${name} PROPERTIES EXCLUDE_FROM_ALL TRUE)
  endif()
  # The benchmarks reach into src/ to time and compare single parts of the integrator.
  target_include_directories(${name} PRIVATE src tests)
  if(NOT page_lacks)
    target_compile_definitions(${name} PRIVATE HHTDAE_PAGE)
  endif()

  # What concerns IDA stands behind this macro.
  file(STRINGS ${source} knows_ida REGEX "HHTDAE_HAVE_IDA")
  if(knows_ida AND ida_found)
    target_compile_definitions(${name} PRIVATE HHTDAE_HAVE_IDA)
    target_include_directories(${name} SYSTEM PRIVATE ${SUNDIALS_INCLUDE_DIR} ${KLU_INCLUDE_DIR})
    target_link_libraries(${name} PRIVATE ${ida_libraries})
  elseif(knows_ida)
    message(STATUS "SUNDIALS IDA with KLU not found: ${name} is built without it (Debian: libsundials-dev)")
  endif()
endforeach()
