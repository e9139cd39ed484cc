#!/bin/sh
# andrews_table.sh BUILD [options for the program]: Andrews' squeezing mechanism with -ts_type hhtdae over several
# tolerances. Prints a table of the errors at the end and of the work, leaves it in BUILD/andrews.txt and draws
# BUILD/andrews.png where gnuplot is installed.
set -eu

build=$1
shift
table=$build/andrews.txt
export OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

# value KEY LINE: what stands behind "KEY=" in the program's output
value() { printf '%s\n' "$output" | sed -n "s/^$2:\(.* \)\{0,1\}$1=\([^ ]*\).*/\2/p"; }

format='%-9s %10s %10s %10s %8s %8s %8s %9s %9s\n'
# shellcheck disable=SC2059
line() { printf "$format" "$@" | tee -a "$table"; }

: >"$table"
line '#tolerance' error_q error_v error_l steps rejected newton jacobians time
for tolerance in 1e-3 1e-4 1e-5 1e-6 1e-7 1e-8; do
  # The runs are a few milliseconds long: the counts are those of the last one, the time is the median.
  times=
  for repetition in 1 2 3 4 5; do
    output=$("$build/bin/andrews" -ts_type hhtdae -ts_atol $tolerance -ts_rtol $tolerance -ts_hhtdae_summary "$@" \
      </dev/null) || {
      printf '%s\n' "$output"
      echo "andrews failed at tolerance $tolerance"
      exit 1
    }
    times="$times $(value time summary)"
  done
  median=$(printf '%s\n' $times | sort -g | sed -n 3p)
  if [ -z "$median" ] || [ -z "$(value q error)" ]; then
    printf '%s\n' "$output"
    echo "andrews printed no complete summary: and error: lines"
    exit 1
  fi
  line $tolerance "$(value q error)" "$(value v error)" "$(value lambda error)" "$(value steps summary)" \
    "$(value rejected summary)" "$(value newton summary)" "$(value jacobians summary)" "$median"
done

if ! command -v gnuplot >/dev/null; then
  echo "no picture: gnuplot is not installed (Debian: gnuplot-nox)"
  exit 0
fi
gnuplot <<END
set terminal pngcairo size 800,560
set output '$build/andrews.png'
set title "Andrews' squeezing mechanism, -ts\\\\_type hhtdae"
set logscale xy
set format x '10^{%L}'
set xlabel 'error at the end'
set ylabel 'time of the run [s], median of 5'
set grid
plot '$table' using 2:9 with linespoints pt 7 title 'position', \
     '' using 3:9 with linespoints pt 5 title 'velocity', \
     '' using 4:9 with linespoints pt 9 title 'multiplier'
END
echo "picture: $build/andrews.png"
