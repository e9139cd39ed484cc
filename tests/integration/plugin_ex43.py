"""PETSc's src/ts/tutorials/ex43.c, an oscillator u'' + 2 xi w u' + w^2 u = 0, run unmodified with the plug-in.

The program knows its exact solution; -ts_monitor_error prints the difference after every step.
usage: plugin_ex43.py libhhtdae.so ex43
"""

import math
import re
import sys

from common import check, run, tutorial

library, program = sys.argv[1], tutorial(sys.argv[2])
plugin = ["-dll_append", library, "-ts_type", "hhtdae"]


def errors(*options):
    """|u - exact| after every step"""
    out = run([program, *plugin, "-ts_monitor_error", *options])
    values = [float(x) for x in re.findall(r"2-norm of error (\S+)", out)]
    check(len(values) > 10, "ex43 printed no errors: " + out[-500:])
    return values


# The plug-in, and nothing else, makes the type known; it can come through the environment as well.
message = run([program, "-ts_type", "hhtdae"], fails=True)
check("Unknown TS type: hhtdae" in message, "without the plug-in ex43 failed for another reason: " + message[-500:])
view = ["-damping", "0.1", "-ts_max_steps", "20", "-ts_view"]
by_arguments = run([program, *plugin, *view])
by_environment = run([program, *view], PETSC_OPTIONS=" ".join(plugin))
check(re.search(r"type: hhtdae", by_arguments), "-ts_view does not show the type:\n" + by_arguments)
check(by_arguments == by_environment, "options from PETSC_OPTIONS gave another run:\n" + by_environment)

# Every step commits at most the tolerance, and about tol^(-1/3) steps add up to tol^(2/3) times a factor, which grows with
# the number of periods that are not damped away. The bounds are 1.7 times what alpha = -0.3 was measured to need.
# With damping 0 the program sets no I2Function but an IFunction F(t,U,U''), with 1e-12 an I2Function as with all others.
for damping, factor in (("0", 36), ("1e-12", 36), ("0.1", 7), ("1", 0.9), ("2", 0.45)):
    previous = None
    for tolerance in (1e-4, 1e-6, 1e-8):
        seen = errors("-damping", damping, "-ts_rtol", "0", "-ts_atol", str(tolerance))
        worst, steps = max(seen), len(seen)
        print("damping %-5s tolerance %g: error %.2e in %d steps" % (damping, tolerance, worst, steps))
        check(worst < factor * tolerance ** (2 / 3), "the error %g is too large" % worst)
        if previous:
            check(worst < previous[0] / 10, "a tolerance 100 times smaller made the error less than 10 times smaller")
            check(steps > 3 * previous[1], "a tolerance 100 times smaller took less than 3 times the steps")
        previous = worst, steps

    # Fixed steps: -ts_dt and -ts_adapt_type none have to be obeyed, and the order is 2.
    coarse, fine = (max(errors("-damping", damping, "-ts_adapt_type", "none", "-ts_dt", h)) for h in ("0.02", "0.01"))
    order = math.log2(coarse / fine)
    print("damping %-5s fixed steps: errors %.2e %.2e, order %.2f" % (damping, coarse, fine, order))
    check(abs(order - 2) < 0.1, "the order is %.2f instead of 2" % order)
