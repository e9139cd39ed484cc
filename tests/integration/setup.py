"""What targets of makefile.petsc have installed, and what setup.sh does where the lists of packages cannot be fetched: with programs in place of Debian's.

usage: setup.py source-tree directory
"""

import os
import shutil
import sys

from common import check, run, skip

tree, directory = sys.argv[1], os.path.abspath(sys.argv[2])
if not shutil.which("make"):
    skip("no make")
shutil.rmtree(directory, ignore_errors=True)
os.makedirs(directory)


def asked(target):
    """Packages that a target has to have, and those that it takes where they are to be had"""
    script = [line for line in run(["make", "-n", "-f", "makefile.petsc", target, "PETSC_DIR="], cwd=tree, MAKEFLAGS="").splitlines() if "setup.sh" in line]
    check(len(script) == 1, "%s calls setup.sh %d times" % (target, len(script)))
    words = script[0].split("setup.sh", 1)[1].split("--later")[0].split("--optional")
    return set(words[0].split()), set("".join(words[1:]).split())


libraries, none = asked("bench")
check("libpetsc-real-dev" in libraries and not none, "bench: %s" % libraries)
for package in ("gmsh", "gnuplot-nox", "libgtest-dev", "python3", "calculix-ccx"):
    check(package not in libraries, "bench installs " + package)
for target in ("report", "stability", "soak"):
    check(asked(target) == (libraries | {"gnuplot-nox"}, set()), "%s: %s" % (target, asked(target)))
check(asked("fuzz") == (libraries | {"libgtest-dev"}, set()), "fuzz: %s %s" % asked("fuzz"))
check(asked("docs") == (libraries | {"doxygen", "libjs-mathjax", "python3"}, set()), "docs: %s %s" % asked("docs"))
required, python = asked("install")
check(required == libraries and "pybind11-dev" in python and "python3-mpi4py" not in python, "install: %s %s" % (required, python))

# Packages are missing, and root asks. apt-get goes by status 0 where a list could not be fetched unless it is told not to.
programs = {
    "id": "echo 0",
    "dpkg-query": "exit 1",
    "find": "",
    "touch": 'echo "touch $*" >>"$SEEN"',
    "apt-get": 'echo "apt-get $*" >>"$SEEN"; case "$*" in *Error-Mode=any*update) exit "$OFFLINE";; esac',
}
for name, text in programs.items():
    path = os.path.join(directory, name)
    with open(path, "w") as file:
        file.write("#!/bin/sh\n" + text + "\n")
    os.chmod(path, 0o755)
for offline in "0", "100":
    seen = os.path.join(directory, "seen" + offline)
    out = run(["sh", os.path.join(tree, "src/cmake/setup.sh"), "package"], PATH=directory + os.pathsep + os.environ["PATH"], SEEN=seen, OFFLINE=offline)
    with open(seen) as file:
        calls = file.read()
    print(out, calls, sep="")
    check("install -y --no-install-recommends package" in calls, "no package is installed: " + calls)
    check(("touch -d" in calls) == (offline != "0"), "lists that could not be fetched pass for new ones: " + calls)
    check(("update failed" in out) == (offline != "0"), "a list that could not be fetched: " + out)
