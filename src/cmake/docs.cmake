# The target "docs": <build>/docs/html/index.html from the public headers, the manual pages and src/docs. It is no part of "all". Where what it
# needs is missing, the target says so.
find_program(HHTDAE_DOXYGEN doxygen)
find_path(HHTDAE_MATHJAX MathJax.js PATHS /usr/share/javascript/mathjax NO_DEFAULT_PATH)
find_program(hhtdae_docs_python NAMES python3 PATHS /usr/bin NO_DEFAULT_PATH)
find_program(hhtdae_docs_python NAMES python3)
mark_as_advanced(hhtdae_docs_python)
set(docs_lacks)
if(NOT HHTDAE_DOXYGEN)
  list(APPEND docs_lacks "doxygen")
endif()
if(NOT HHTDAE_MATHJAX OR NOT EXISTS ${HHTDAE_MATHJAX}/jax/output/SVG)
  list(APPEND docs_lacks "MathJax 2 (Debian: libjs-mathjax)")
endif()
if(NOT hhtdae_docs_python)
  list(APPEND docs_lacks "python3")
endif()
if(docs_lacks)
  list(JOIN docs_lacks ", " docs_lacks)
  add_custom_target(docs COMMAND ${CMAKE_COMMAND} -E echo "docs: not found: ${docs_lacks}" COMMAND ${CMAKE_COMMAND} -E false VERBATIM)
  return()
endif()

set(docs ${PROJECT_BINARY_DIR}/docs)
configure_file(src/docs/Doxyfile.in docs/Doxyfile @ONLY)
# Doxygen gives the name of the file to a command that it runs by the shell.
file(WRITE ${docs}/filter "#!/bin/sh\nexec '${hhtdae_docs_python}' -B '${PROJECT_SOURCE_DIR}/src/docs/filter.py' \"$1\" '${PROJECT_SOURCE_DIR}/src/integrator'\n")
file(CHMOD ${docs}/filter PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
file(GLOB docs_sources CONFIGURE_DEPENDS src/docs/*.md src/docs/*.css src/docs/*.py include/hhtdae/*.h examples/tutorial/*)
# Of MathJax what TeX and drawn glyphs need
set(mathjax)
foreach(part extensions jax/element jax/input/TeX jax/output/SVG/autoload jax/output/SVG/fonts/TeX)
  list(APPEND mathjax COMMAND ${CMAKE_COMMAND} -E copy_directory ${HHTDAE_MATHJAX}/${part} ${docs}/html/mathjax/${part})
endforeach()
add_custom_command(OUTPUT ${docs}/html/index.html
                   COMMAND ${CMAKE_COMMAND} -E rm -rf ${docs}/html ${docs}/warnings.txt
                   COMMAND ${HHTDAE_DOXYGEN} ${docs}/Doxyfile
                   COMMAND ${CMAKE_COMMAND} -E cat ${docs}/warnings.txt
                   COMMAND ${CMAKE_COMMAND} -E make_directory ${docs}/html/mathjax
                   COMMAND ${CMAKE_COMMAND} -E copy ${HHTDAE_MATHJAX}/MathJax.js ${docs}/html/mathjax
                   ${mathjax}
                   COMMAND ${CMAKE_COMMAND} -E copy ${HHTDAE_MATHJAX}/jax/output/SVG/jax.js ${HHTDAE_MATHJAX}/jax/output/SVG/config.js ${docs}/html/mathjax/jax/output/SVG
                   DEPENDS ${docs_sources} ${integrator_sources} ${docs}/Doxyfile VERBATIM)
add_custom_target(docs DEPENDS ${docs}/html/index.html)
install(DIRECTORY ${docs}/html DESTINATION ${CMAKE_INSTALL_DOCDIR} OPTIONAL)
