"""What the integration tests share: running programs, and failing with a message."""

import os
import subprocess
import sys

SKIPPED = 77  # ctest's SKIP_RETURN_CODE


def skip(why):
    print("skipped:", why)
    sys.exit(SKIPPED)


def check(condition, message):
    """assert, but also under python -O"""
    if not condition:
        sys.exit("FAILED: " + message)


def surroundings(command, **environment):
    """The environment for a command: a process that ctest starts by itself is told to be alone, which ranks are not."""
    own = {**os.environ, **environment}
    if os.path.basename(command[0]).startswith("mpi"):
        own.pop("OMPI_MCA_ess_singleton_isolated", None)
        own.pop("OMPI_MCA_orte_create_session_dirs", None)
    return own


def run(command, fails=False, cwd=None, seconds=300, **environment):
    """Standard output of a program; fails=True asks for a failure, and returns standard error instead."""
    command = [str(word) for word in command]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=seconds, cwd=cwd,
                          env=surroundings(command, **environment))
    if (done.returncode != 0) != fails:
        print(done.stdout[-4000:])
        print(done.stderr[-4000:])
        sys.exit("FAILED: %s\nexit status %d" % (" ".join(command), done.returncode))
    return done.stderr if fails else done.stdout


def tutorial(path):
    if not os.path.exists(path):
        skip("PETSc's tutorials are not installed (Debian: libpetsc3.18-dev-examples)")
    return path
