"""A program whose options are misspelt says so at its end, once, on any number of ranks."""

import re
import sys

from common import check, run

program, chain, mpiexec = sys.argv[1], sys.argv[2], sys.argv[3:]

out = run([program, "-ts_hhtdae_aplha", "-0.1", "-ts_hhtdae_form", "paper"])
check(out.count("-ts_hhtdae_aplha was not used: there is no such option; the nearest is -ts_hhtdae_alpha") == 1, out)
check(out.count("was not used") == 1, out)
check("was not used" not in run([program, "-ts_hhtdae_alpha", "-0.1"]), "a warning about an option that was used")

scene = [chain, "-n", "4", "-ts_max_steps", "5"]
# the lists are complete: every option that -help shows is found from a name that is off by one letter
names = sorted(set(re.findall(r"-((?:ts_hhtdae|scene)_[a-z_]+)", run(scene + ["-help"]))))
check(len(names) > 20, "-help shows " + str(names))
out = run(scene + [word for name in names for word in ("-" + name + "x", "1")])
for name in names:
    check("-%sx was not used: there is no such option; the nearest is -%s\n" % (name, name) in out, name + ": " + out)

out = run(scene + ["-scene_redundnt", "keep"])
check(out.count("the nearest is -scene_redundant") == 1, out)
if mpiexec:
    out = run(mpiexec + ["2"] + scene + ["-scene_redundnt", "keep", "-scene_redundant", "drop"])
    check(out.count("was not used") == 1, out)
