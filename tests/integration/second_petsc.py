"""A build with another PETSc than the first: it leaves out what that PETSc lacks and says so, and plugins do not mix.

HHTDAE_SECOND_PETSC_DIR and HHTDAE_SECOND_PETSC_ARCH name it; without them the test is skipped. A PETSc of another minor version
without HDF5 and MUMPS tests most.
usage: second_petsc.py source-tree cmake libhhtdae.so version-of-PETSc ex43.c
"""

import os
import re
import sys
import tempfile

from common import check, run, skip, tutorial

source, cmake, first_library, first_version = sys.argv[1:5]
directory, arch = os.environ.get("HHTDAE_SECOND_PETSC_DIR"), os.environ.get("HHTDAE_SECOND_PETSC_ARCH", "")
if not directory:
    skip("HHTDAE_SECOND_PETSC_DIR names no PETSc")
program_source = tutorial(sys.argv[5])

for folder in (os.path.join(directory, arch, "include"), os.path.join(directory, "include")):
    if os.path.exists(os.path.join(folder, "petscconf.h")):
        with open(os.path.join(folder, "petscconf.h")) as file:
            configuration = file.read()
pkg_config = os.pathsep.join([os.path.join(directory, arch, "lib", "pkgconfig"), os.path.join(directory, "lib", "pkgconfig")])
version = run(["pkg-config", "--modversion", "PETSc"], PKG_CONFIG_PATH=pkg_config).strip()

with tempfile.TemporaryDirectory(prefix="second-petsc-") as work:
    build = os.path.join(work, "build")
    said = run([cmake, "-S", source, "-B", build, "-G", "Unix Makefiles", "-DPETSC_DIR=" + directory, "-DPETSC_ARCH=" + arch,
                "-DHHTDAE_PROGRAMS=OFF", "-DBUILD_TESTING=OFF", "-DHHTDAE_TOGETHER=OFF"])
    for package in ("MUMPS", "HDF5"):
        has = re.search(r"^#define PETSC_HAVE_%s\s+1" % package, configuration, flags=re.MULTILINE)
        check(bool(has) != bool(re.search("PETSc has no %s: .*left out" % package, said)), "%s: %s" % (package, said))
    # The integrator, and of the scenes what needs HDF5
    run([cmake, "--build", build, "--parallel", "2", "--target", "hhtdae"], seconds=1500)
    run([cmake, "--build", build, "--target", "src/scene/output/files.o"])

    flags = run(["pkg-config", "--cflags", "--libs", "PETSc"], PKG_CONFIG_PATH=pkg_config).split()
    flags += ["-Wl,-rpath," + flag[2:] for flag in flags if flag.startswith("-L")]

    def tool(name):
        """of an MPI that this PETSc has built, or of the system's"""
        own = os.path.join(directory, arch, "bin", name)
        return own if os.path.exists(own) else name

    def compiled(path):
        program = os.path.join(work, os.path.basename(path)[:-2])
        run([tool("mpicc"), "-w", path, "-o", program, *flags, "-lm"])
        return program

    own_library = os.path.join(build, "lib", "libhhtdae.so")
    command = [compiled(program_source), "-ts_type", "hhtdae", "-ts_max_steps", "20", "-ts_view", "-dll_append"]
    view = run([*command, own_library])
    check(re.search("type: hhtdae", view), "-ts_view does not show the type: " + view)
    check(re.search(r"steps=20, .*restarts=1", view), "the run was not ours: " + view)

    # Many unknowns between two ranks, where MUMPS would be the choice: without it there is a factorization all the same.
    view = run([tool("mpiexec"), "-n", "2", compiled(os.path.join(os.path.dirname(os.path.abspath(__file__)), "lattice.c")), "-n", "16", "-ts_view",
                "-ts_rtol", "1e-3", "-ts_atol", "1e-3", "-dll_append", own_library])
    check(re.search("linear solver: (LU|LDL.T) with (kluparts|mumps)", view), "no direct solver: " + view)
    error = float(re.search(r"^error (\S+)", view, flags=re.MULTILINE).group(1))
    check(error < 0.02, "the lattice is off by %g" % error)

    minor, first_minor = (".".join(v.split(".")[:2]) for v in (version, first_version))
    if minor == first_minor:
        skip("the two PETSc have the same minor version %s: their plugins may mix" % minor)
    message = run([*command, first_library], fails=True)
    check("built for PETSc " + first_minor in message and re.search(r"PETSc \d+\.\d+\.\d+.* runs", message), "the plugin for %s in %s: %s"
          % (first_minor, version, message[-3000:]))
    print("PETSc %s: built, run, and the plugin for %s refused" % (version, first_version))
