#!/bin/sh
# check.sh BUILD [ctest options]: runs the tests and ends with the line "N passed, N failed", with ctest's exit status.
# Skipped tests count in neither number; they are named before that line.
set -u

build=$1
shift
results=$build/ctest.xml
rm -f "$results"
status=0
ctest --test-dir "$build" --output-on-failure --output-junit "$(cd "$build" && pwd)/ctest.xml" "$@" || status=$?

# The attributes of the <testsuite> element, which stand on lines of their own
count() { sed -n "s/^[[:space:]]*$1=\"\([0-9]*\)\".*/\1/p" "$results" 2>/dev/null | head -n 1; }
tests=$(count tests)
failures=$(count failures)
skipped=$(count skipped)
disabled=$(count disabled)
skipped=$((${skipped:-0} + ${disabled:-0}))
if [ "${tests:-0}" = 0 ]; then
  echo "check: ctest ran no tests"
  echo "0 passed, 1 failed"
  exit 1
fi
if [ "$skipped" != 0 ]; then
  echo "$skipped skipped:"
  sed -n 's/.*<testcase name="\([^"]*\)".*status="notrun".*/  \1/p' "$results"
fi
echo "$((tests - failures - skipped)) passed, $failures failed"
[ "$failures" = 0 ] || [ "$status" != 0 ] || status=1
exit "$status"
