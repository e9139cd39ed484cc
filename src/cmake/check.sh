#!/bin/sh
# check.sh BUILD [ctest options]: runs the tests and ends with the line "N passed, N failed", with ctest's exit status.
# Skipped tests count in neither number; they are named before that line. A suite of GoogleTest is one test of ctest's (suites.cmake): how many
# tests it is, its own results tell, and one that ended without them has failed.
set -u

build=$1
shift
results=$build/ctest.xml
rm -rf "$results" "$build/suites"
status=0
ctest --test-dir "$build" --output-on-failure --output-junit "$(cd "$build" && pwd)/ctest.xml" "$@" || status=$?

if ! grep -q '<testcase ' "$results" 2>/dev/null; then
  echo "check: ctest ran no tests"
  echo "0 passed, 1 failed"
  exit 1
fi
awk -v suites="$build/suites" '
function value(name) { return match($0, " " name "=\"[^\"]*\"") ? substr($0, RSTART + length(name) + 3, RLENGTH - length(name) - 4) : "" }
function suite(file,    n, one) {
  n = failed_here = seen = 0
  while ((getline < file) > 0) {
    if (/<testcase /) {
      seen = one = 1
      if (value("result") == "completed") n++
      if (value("result") == "skipped") skipped[++skips] = name "." value("name")
    }
    if (/<failure/ && one) {
      failed_here++
      one = 0
    }
  }
  close(file)
  return n
}
/<testcase / {
  name = value("name")
  outcome = value("status")
  file = name
  gsub("/", ".", file)
  n = suite(suites "/" file ".xml")
  if (seen && (outcome == "run" || failed_here)) {
    passed += n - failed_here
    failed += failed_here
  } else if (outcome == "run") passed++
  else if (outcome == "fail") failed++
}
# What was not run has left by the code that says so, or could not be started.
/<skipped / {
  if (outcome == "disabled" || value("message") ~ /^SKIP/) skipped[++skips] = name
  else failed++
}
END {
  if (skips) print skips " skipped:"
  for (k = 1; k <= skips; k++) print "  " skipped[k]
  print passed + 0 " passed, " failed + 0 " failed"
  exit failed > 0
}' "$results" || [ "$status" != 0 ] || status=1
exit "$status"
