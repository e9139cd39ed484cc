"""The plugin, loaded into a PETSc of another minor version than it was built for, or into one with complex scalars, says so at loading and is not used.

usage: plugin_version.py libhhtdae.so ex43 later_petsc.so complex_petsc.so version-of-PETSc
"""

import sys

from common import check, run, tutorial

library, program, later, complex_petsc, version = sys.argv[1], tutorial(sys.argv[2]), *sys.argv[3:6]
command = [program, "-dll_append", library, "-ts_type", "hhtdae", "-ts_max_steps", "5"]
major, minor = version.split(".")[:2]
other = "%s.%d.2" % (major, int(minor) + 7)

run(command)
message = run(command, fails=True, LD_PRELOAD=later)
check("built for PETSc %s.%s" % (major, minor) in message, "the version that the plugin was built for is not named: " + message[-2000:])
check("PETSc %s" % other in message and "runs" in message, "the version that runs is not named: " + message[-2000:])
check("PETSC_DIR" in message, "what to do is not said: " + message[-2000:])
check("No method step" not in message, "the type was registered all the same: " + message[-2000:])

message = run(command, fails=True, LD_PRELOAD=complex_petsc)
check("needs a PETSc with real scalars of double precision, and one with complex scalars runs" in message, "complex scalars are not named: " + message[-2000:])
check("No method step" not in message, "the type was registered all the same: " + message[-2000:])
