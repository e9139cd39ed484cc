# One test of ctest for each suite of a GoogleTest program: starting MPI takes a quarter of a second, longer than most tests. Their number is read off
# what GoogleTest writes, see check.sh.
#   cmake -DPROGRAM=... -DROOM=... -DTIMEOUT=... -DENVIRONMENT=NAME=value|... -DRESULTS=folder -DOUTPUT=file -P suites.cmake
execute_process(COMMAND ${PROGRAM} --gtest_list_tests OUTPUT_VARIABLE listed COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "(^|\n)[^ \n.]+\\." suites "${listed}")
string(REPLACE "|" ";" ENVIRONMENT "${ENVIRONMENT}")
set(tests)
foreach(suite IN LISTS suites)
  string(REGEX REPLACE "[\n.]" "" suite "${suite}")
  string(REPLACE "/" "." file "${suite}")
  string(APPEND tests "add_test([=[${ROOM}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${suite}.*]=])\n"
                      "set_tests_properties([=[${ROOM}.${suite}]=] PROPERTIES TIMEOUT ${TIMEOUT} LABELS ${ROOM} "
                      "ENVIRONMENT [=[${ENVIRONMENT};GTEST_OUTPUT=xml:${RESULTS}/${ROOM}.${file}.xml]=])\n")
endforeach()
file(WRITE ${OUTPUT} "${tests}")
