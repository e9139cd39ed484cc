"""Runs and analyses under PETSc's -fp_trap, with which users look for the origin of numbers that are none."""

import sys

from common import run

for program in sys.argv[1:]:
    run([program, "-fp_trap"])
