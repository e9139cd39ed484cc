"""Which PETSc, and what with it, a configuration takes: PETSC_DIR with none, a PETSc with complex scalars, the right one without a SLEPc of its own, with
examples and without, and another one in the same build tree. Some of these are there in name only.

usage: petsc_choice.py source-tree cmake directory-of-PETSc.pc
"""

import os
import re
import subprocess
import sys
import tempfile

from common import check

source, cmake, petsc_pc = sys.argv[1:]
with open(os.path.join(petsc_pc, "PETSc.pc")) as file:
    package = file.read()


def write(path, text):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write(text)


with tempfile.TemporaryDirectory(prefix="petsc-choice-") as work:
    build, slepc = os.path.join(work, "build"), os.path.join(work, "slepc")

    def configured(name, fits, *options):
        """What is said of a configuration with the PETSc of that name, as one line"""
        done = subprocess.run([cmake, "-S", source, "-B", build, "-DHHTDAE_WITH_PYTHON=OFF", "-DPETSC_ARCH=", "-DPETSC_DIR=" + os.path.join(work, name), *options],
                              capture_output=True, text=True, env={**os.environ, "PKG_CONFIG_PATH": "", "PKG_CONFIG_LIBDIR": work, "SLEPC_DIR": slepc})
        said = " ".join((done.stdout + done.stderr).split())
        check((done.returncode == 0) == fits, "%s: status %d: %s" % (name, done.returncode, said[-4000:]))
        return said

    def has(words, said):
        check(words in said, "not said: %s, but %s" % (words, said[-2000:]))

    for name, scalars in (("complex", "#define PETSC_USE_COMPLEX 1\n#define PETSC_USE_REAL_DOUBLE 1\n"), ("single", "#define PETSC_USE_REAL_SINGLE 1\n")):
        write(os.path.join(work, name, "include", "petscconf.h"), scalars)
        write(os.path.join(work, name, "lib", "pkgconfig", "PETSc.pc"), re.sub("^prefix=.*", "prefix=" + os.path.join(work, name), package, flags=re.MULTILINE))
    # The PETSc of this build, with a MUMPS that has a name of its own
    library = os.path.join(work, "real", "lib", "libdmumps_64.so")
    write(library, "")
    write(os.path.join(work, "real", "lib", "pkgconfig", "PETSc.pc"),
          re.sub("^Libs: ", "Libs: -L%s " % os.path.dirname(library), package, flags=re.MULTILINE).replace("-ldmumps", "-ldmumps_64"))
    # A SLEPc for the complex one
    version = re.search(r"^Version: *(\d+\.\d+)", package, flags=re.MULTILINE).group(1)
    write(os.path.join(slepc, "lib", "pkgconfig", "slepc.pc"), "Name: SLEPc\nDescription: of another PETSc\nVersion: %s.1\nCflags: -I%s\n" % (version, slepc))
    write(os.path.join(slepc, "slepcconf.h"), '#define SLEPC_PETSC_DIR "%s"\n#define SLEPC_PETSC_ARCH "complex"\n' % work)

    has("has no lib/pkgconfig/PETSc.pc", configured("none", False))
    has("are complex", configured("complex", False))
    has("not of double precision", configured("single", False))
    said = configured("real", True)
    has("is not for this PETSc", said)
    has("flexible bodies are left out", said)
    has("needs flexible bodies", subprocess.run([cmake, "--build", build, "--target", "atv_frame"], capture_output=True, text=True).stdout)
    with open(os.path.join(build, "CMakeCache.txt")) as file:
        mumps = re.search("^MUMPS_LIBRARY:.*=(.*)", file.read(), flags=re.MULTILINE)
    check(not mumps or "-ldmumps" not in package or mumps.group(1) == library, "MUMPS is not PETSc's: %s" % (mumps and mumps.group(1)))
    has("was configured for the PETSc in", configured("complex", False))
    configured("real", True, "-DHHTDAE_PROGRAMS=OFF")
