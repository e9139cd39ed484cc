"""Every example that knows a reference ends near it: what it prints behind "error:", by twice what was measured.

usage: examples.py BIN
"""

import os
import re
import sys

from common import check, run

bin = sys.argv[1]

# Programs, their options, and the largest of each number that they print as name=number
ERRORS = {
    "andrews": dict(q=4e-4, v=0.12, **{"lambda": 1.2e-3}),
    "bricard": dict(points=7e-3, closure=1e-6, energy=6e-3),
    "cam": dict(error=5e-6),
    "caraxis": dict(q=4e-3, v=0.35, **{"lambda": 0.1}),
    "doublependulum": dict(tip=5e-3, energy=0.05),
    "doublependulum_angles": dict(q=2e-4, v=3e-3),
    "elasticblock": dict(modal=8e-3, static=0.09),
    "fekete": dict(q=7e-6, v=2e-8),
    "flexcrank": dict(q=3e-6, slider=3e-8),
    "flyball": dict(slider=2.5e-3, tip=0.01),
    "fourbar": dict(q=0.045, v=0.11, **{"lambda": 0.07}),
    "heavytop": dict(x=1e-3, Omega=0.035, F=1.2, energy=0.3),
    "heavytop_quaternion": dict(q=0.012, v=0.02, **{"lambda": 2e-4}),
    "oscillators": dict(q=0.06, v=0.015),
    "pendulum": dict(q=5e-3, v=0.02, **{"lambda": 2.5e-3}),
    "quartercar": dict(heights=3e-4, tire=7e-3),
    "rolling": dict(q=1.2e-3, v=4e-4, **{"lambda": 0.2}),
    "rollingball": dict(x=1e-9, force=1e-8),
    "slidercrank": dict(q=1e-5, v=5e-4, **{"lambda": 7e-4}),
    "slidercrank3d": dict(slider=0.012, energy=4e-3),
    "springpendulum": dict(q=1.2e-3, v=3e-3),
    "uservars": dict(q=5e-4, v=2.5e-3, other=7e-3, **{"lambda": 1e-3}),
    "wheelset": dict(q=0.012, v=0.3, **{"lambda": 0.2}),
}


def there(name):
    return os.path.exists(os.path.join(bin, name))  # some need SLEPc


def output(name):
    return run([os.path.join(bin, name)])


for name, bounds in ERRORS.items():
    if not there(name):
        print("%s is not there: left out" % name)
        continue
    out = output(name)
    line = re.findall(r"^error:.*$", out, re.M)[-1]
    found = dict(re.findall(r"(\w+)=(\S+)", line)) or {"error": line.split()[-1]}
    check(found.keys() == bounds.keys(), "%s prints other errors: %s" % (name, line))
    for what, bound in bounds.items():
        check(0 <= float(found[what]) <= bound, "%s: the error of %s is %s, above %g" % (name, what, found[what], bound))
    print("%-22s %s" % (name, line))

if there("campbell"):
    differences = re.search(r"from Stodola's equation: (\S+), under the unbalance (\S+)", output("campbell"))
    check(max(map(float, differences.groups())) < 1e-12, "campbell: " + differences.group())
if there("platemodes"):
    off = [float(x) for x in re.findall(r"([+-]\d+\.\d+) %", output("platemodes"))]
    check(len(off) == 10 and max(map(abs, off)) < 0.8, "platemodes is off by %s %%" % off)
if there("masschain"):
    errors = re.search(r"errors of the positions (\S+), of the force on the last mass (\S+)", output("masschain"))
    check(float(errors.group(1)) < 1.1e-5 and float(errors.group(2)) < 2e-6, "masschain: " + errors.group())
