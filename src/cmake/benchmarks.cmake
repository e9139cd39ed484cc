# Each tests/bench/*.cpp and tests/soak/*.cpp is one program of its own.
add_custom_target(bench)
file(GLOB bench_sources CONFIGURE_DEPENDS tests/bench/*.cpp tests/soak/*.cpp)
foreach(source IN LISTS bench_sources)
  cmake_path(GET source STEM name)

  file(STRINGS ${source} uses_ida REGEX "#include [<\"]ida/ida\\.h")
  if(uses_ida)
    set(ida_libraries)
    foreach(library sundials_ida sundials_nvecserial sundials_sunmatrixdense sundials_sunmatrixsparse
                    sundials_sunlinsoldense sundials_sunlinsolklu sundials_generic)
      find_library(${library}_LIBRARY ${library})
      list(APPEND ida_libraries ${${library}_LIBRARY})
    endforeach()
    find_path(SUNDIALS_INCLUDE_DIR ida/ida.h)
    # SUNDIALS' KLU module includes klu.h by its bare name.
    find_path(KLU_INCLUDE_DIR klu.h PATH_SUFFIXES suitesparse)
    find_library(KLU_LIBRARY klu)
    if(NOT SUNDIALS_INCLUDE_DIR OR NOT KLU_INCLUDE_DIR OR "${ida_libraries};${KLU_LIBRARY}" MATCHES "NOTFOUND")
      message(STATUS "SUNDIALS IDA with KLU not found: ${name} is left out (Debian: libsundials-dev)")
      continue()
    endif()
  endif()

  hhtdae_program(${name} ${source})
  # The benchmarks reach into src/ to time and compare single parts of the integrator.
  target_include_directories(${name} PRIVATE src tests)
  if(uses_ida)
    target_include_directories(${name} SYSTEM PRIVATE ${SUNDIALS_INCLUDE_DIR} ${KLU_INCLUDE_DIR})
    target_link_libraries(${name} PRIVATE ${ida_libraries} ${KLU_LIBRARY})
  endif()
  add_dependencies(bench ${name})
endforeach()
