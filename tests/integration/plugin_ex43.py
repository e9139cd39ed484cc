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
check("hhtdae" in message, "without the plug-in ex43 failed for another reason: " + message[-500:])
view = ["-damping", "0.1", "-ts_max_steps", "20", "-ts_view"]
by_arguments = run([program, *plugin, *view])
by_environment = run([program, *view], PETSC_OPTIONS=" ".join(plugin))
check(re.search(r"type: hhtdae", by_arguments), "-ts_view does not show the type:\n" + by_arguments)
check(by_arguments == by_environment, "options from PETSC_OPTIONS gave another run:\n" + by_environment)

# -damping 0 makes the program set an IFunction F(t,U,A) without velocity, anything else an I2Function.
for damping in ("0", "0.1", "1", "2"):
    # Every step commits at most the tolerance, and about tol^(-1/3) steps add up to tol^(2/3).
    previous = None
    for tolerance in (1e-4, 1e-6, 1e-8):
        seen = errors("-damping", damping, "-ts_rtol", "0", "-ts_atol", str(tolerance), "-ts_adapt_type", "basic")
        worst, steps = max(seen), len(seen)
        print("damping %-4s tolerance %g: error %.2e in %d steps" % (damping, tolerance, worst, steps))
        check(worst < ERROR_BOUND * tolerance ** (2 / 3), "the error %g is too large" % worst)
        if previous:
            check(worst < previous[0] / 5, "100 times the accuracy was asked for, the error fell by less than 5")
            check(steps > 2 * previous[1], "100 times the accuracy was asked for with less than twice the steps")
        previous = worst, steps

    # Fixed steps: the observed order, which -ts_dt and -ts_adapt_type none must reach undisturbed
    coarse, fine = (max(errors("-damping", damping, "-ts_adapt_type", "none", "-ts_dt", h)) for h in ("0.02", "0.01"))
    order = math.log2(coarse / fine)
    print("damping %-4s fixed steps: errors %.2e %.2e, order %.2f" % (damping, coarse, fine, order))
    check(abs(order - 2) < 0.1, "the order is %.2f instead of 2" % order)
