"""What the scripts of this folder share: programs run with their processor time and memory, histories, errors, tables."""

import os
import re
import subprocess
import sys


def run(command, folder=".", seconds=7200, **environment):
    """Standard output, processor seconds (with those of children) and peak of resident memory (MB, of the largest process) of a program."""
    settings = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "HWLOC_COMPONENTS": "-gl,-opencl", **environment}
    with open(os.path.join(folder, "output"), "w+") as out:
        program = subprocess.Popen([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=out, stderr=subprocess.STDOUT, cwd=folder, env=settings)
        _, status, use = os.wait4(program.pid, 0)
        program.returncode = os.waitstatus_to_exitcode(status)
        out.seek(0)
        text = out.read()
    if program.returncode:
        sys.exit("%s\nFAILED, exit status %d: %s" % (text[-3000:], program.returncode, " ".join(map(str, command))))
    return text, use.ru_utime + use.ru_stime, 1024 * use.ru_maxrss / 1e6


def serial(command, **more):
    """One process without Open MPI's daemon"""
    return run(command, OMPI_MCA_ess_singleton_isolated="1", **more)


def numbers(text):
    """key=value pairs of what a program prints"""
    return {key: float(value) for key, value in re.findall(r"(\w+)=([-+0-9.eE]+)(?=\s|$)", text)}


def history(path):
    """Rows of numbers, the first one the time"""
    with open(path) as file:
        return [[float(word) for word in line.split()] for line in file]


def error(rows, reference, columns):
    """Largest difference at times of both, in parts of the largest reference; columns are those of one vector"""
    known = {round(row[0] * 1e9): row for row in reference}
    pairs = [(row, known[round(row[0] * 1e9)]) for row in rows if round(row[0] * 1e9) in known]
    if not pairs:
        sys.exit("the histories have no time in common")
    size = lambda v: sum(x * x for x in v) ** 0.5
    largest = max(size([r[c] for c in columns]) for r in reference)
    return max(size([a[c] - b[c] for c in columns]) for a, b in pairs) / largest


def table(head, rows):
    """Markdown"""
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(str(x) for x in row) + " |")
    sys.stdout.flush()
