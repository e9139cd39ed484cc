"""Programs compiled for newer instructions or with a sanitizer use an installed library that was compiled without.

Numbers with derivatives, vectors and matrices of Eigen go in and out of the library; with -mavx or a sanitizer Eigen by itself would
align them in another way and free them by other means.
usage: instructions.py build-tree cmake configuration directory-of-PETSc.pc [directory-of-SLEPc.pc]
"""

import os
import re
import subprocess
import sys
import tempfile

from common import check, run

build, cmake, configuration = sys.argv[1:4]
packages = sys.argv[4:]
here = os.path.join(os.path.dirname(os.path.abspath(__file__)), "outside")

flavours = {"-fsanitize=address -O1": {"ASAN_OPTIONS": "detect_leaks=0"}, "-march=native -O1": {}}

with tempfile.TemporaryDirectory(prefix="instructions-", dir=build) as work:
    prefix = os.path.join(work, "prefix")
    run([cmake, "--install", build, "--prefix", prefix, "--config", configuration])
    libraries = next(folder for folder, _, files in os.walk(prefix) if "libhhtdae.so" in files)
    paths = os.pathsep.join([os.path.join(libraries, "pkgconfig"), *packages, os.environ.get("PKG_CONFIG_PATH", "")])
    programs = {"numbers": "hhtscene"}
    if os.path.exists(os.path.join(libraries, "libhhtflexible.so")):
        programs["flexible"] = "hhtflexible"

    def works(program, flavour, **environment):
        error = float(re.search(r"error (\S+)", run([program], **environment)).group(1))
        print("%s: error %g" % (flavour, error))
        check(error < 1e-4, "%s: off by %g" % (flavour, error))

    for name, library in programs.items():
        flags = run(["pkg-config", "--cflags", "--libs", library], PKG_CONFIG_PATH=paths).split()
        for flavour, environment in flavours.items():
            if name == "numbers" and "native" in flavour:
                continue  # with CMake, below
            program = os.path.join(work, name)
            run([os.environ.get("CXX", "c++"), "-std=c++17", *flavour.split(), os.path.join(here, name, "outside_%s.cpp" % name), "-o", program, *flags])
            works(program, name + " " + flavour, LD_LIBRARY_PATH=libraries, **environment)

    tree = os.path.join(work, "with-cmake")
    run([cmake, "-S", os.path.join(here, "numbers"), "-B", tree, "-DCMAKE_PREFIX_PATH=" + prefix, "-DCMAKE_CXX_FLAGS=-march=native -O1", "-DCMAKE_CXX_STANDARD=14"])
    run([cmake, "--build", tree])
    works(os.path.join(tree, "outside_numbers"), "with CMake, -march=native, and the C++ of a compiler that is older than the headers'")

    # Without the packages' flags hhtdae's headers see to it themselves, and refuse an Eigen that is there before them.
    bare = [flag for flag in run(["pkg-config", "--cflags", "hhtscene"], PKG_CONFIG_PATH=paths).split() if not flag.startswith("-DEIGEN")]
    for first, second, fits in (("hhtdae/types.h", "Eigen/Core", True), ("Eigen/Core", "hhtdae/types.h", False)):
        source = os.path.join(work, "order.cpp")
        with open(source, "w") as file:
            file.write("#include <%s>\n#include <%s>\n" % (first, second))
        done = subprocess.run([os.environ.get("CXX", "c++"), "-std=c++17", "-fsyntax-only", "-fsanitize=address", *bare, source],
                              capture_output=True, text=True)
        check((done.returncode == 0) == fits, "%s before %s: %s" % (first, second, done.stderr[-1000:]))
        check(fits or "EIGEN_MALLOC_ALREADY_ALIGNED=1" in done.stderr, "what to define is not said: " + done.stderr[-1000:])
