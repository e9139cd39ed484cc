"""Installs into an empty prefix, then builds and runs a small C program, and a scene in C++, that know nothing but that prefix.

Once with CMake's find_package(hhtdae), once with pkg-config hhtdae.
usage: install.py build-tree cmake configuration directory-of-PETSc.pc
"""

import os
import re
import shutil
import sys
import tempfile

from common import check, run

build, cmake, configuration, petsc_pc = sys.argv[1:]
here = os.path.dirname(os.path.abspath(__file__))


def works(program, **environment):
    """The program prints the exact solution's error and the type"""
    out = run([program], **environment)
    print(out.strip())
    check("type hhtdae" in out, "the type is not the installed one: " + out)
    error = float(re.search(r"error (\S+)", out).group(1))
    check(error < 1e-4, "the pendulum is off by %g" % error)


with tempfile.TemporaryDirectory(prefix="install-test-", dir=build) as work:
    prefix = os.path.join(work, "prefix")
    run([cmake, "--install", build, "--prefix", prefix, "--config", configuration])
    header = os.path.join(prefix, "include", "hhtdae", "hhtdae.h")
    check(os.path.exists(header), "no header at " + header)
    libdirs = [folder for folder, _, files in os.walk(prefix) if "libhhtdae.so" in files]
    check(len(libdirs) == 1, "libhhtdae.so is in %s" % libdirs)
    installed = [os.path.join(folder, name)[len(prefix):] for folder, _, files in os.walk(prefix) for name in files]
    foreign = [path for path in installed if not any(own in path for own in ("hhtdae", "hhtscene", "hhtflexible", "hhtreduce"))]
    check(not foreign, "foreign files were installed: %s" % foreign)

    # The outside project is copied, so that nothing can be found by a relative path.
    outside = shutil.copytree(os.path.join(here, "outside"), os.path.join(work, "outside"))
    with_cmake = os.path.join(work, "with-cmake")
    run([cmake, "-S", outside, "-B", with_cmake, "-DCMAKE_PREFIX_PATH=" + prefix])
    run([cmake, "--build", with_cmake])
    works(os.path.join(with_cmake, "outside"))

    paths = os.pathsep.join([os.path.join(libdirs[0], "pkgconfig"), petsc_pc, os.environ.get("PKG_CONFIG_PATH", "")])
    flags = run(["pkg-config", "--cflags", "--libs", "hhtdae"], PKG_CONFIG_PATH=paths).split()
    with_pkg_config = os.path.join(work, "with-pkg-config")
    run([os.environ.get("CC", "cc"), os.path.join(outside, "outside.c"), "-o", with_pkg_config, *flags, "-lm"])
    works(with_pkg_config, LD_LIBRARY_PATH=libdirs[0])
    other = os.path.join(work, "later")
    os.mkdir(other)
    with open(os.path.join(other, "PETSc.pc"), "w") as file:
        file.write("Name: PETSc\nDescription: a later one\nVersion: 99.0\n")
    refusal = run(["pkg-config", "--print-errors", "--libs", "hhtdae"], fails=True, PKG_CONFIG_PATH=os.pathsep.join([os.path.join(libdirs[0], "pkgconfig"), other]))
    check("PETSc <" in refusal, "pkg-config takes another PETSc: " + refusal)

    # A scene by its own pkg-config file; as a component of CMake's package: instructions.py
    flags = run(["pkg-config", "--cflags", "--libs", "hhtscene"], PKG_CONFIG_PATH=paths).split()
    with_pkg_config = os.path.join(work, "scene-with-pkg-config")
    run([os.environ.get("CXX", "c++"), "-std=c++17", os.path.join(outside, "scene", "outside_scene.cpp"), "-o", with_pkg_config, *flags])
    works(with_pkg_config, LD_LIBRARY_PATH=libdirs[0])

    # Flexible bodies, where the build has them, as a component; by their pkg-config file: instructions.py
    if not os.path.exists(os.path.join(libdirs[0], "libhhtflexible.so")):
        sys.exit()
    flexible = os.path.join(work, "flexible-with-cmake")
    run([cmake, "-S", os.path.join(outside, "flexible"), "-B", flexible, "-DCMAKE_PREFIX_PATH=" + prefix])
    run([cmake, "--build", flexible])
    works(os.path.join(flexible, "outside_flexible"))
    reduced = run([os.path.join(prefix, "bin", "hhtreduce"), "-help"])
    check("-attach" in reduced, "hhtreduce does not explain itself: " + reduced)
