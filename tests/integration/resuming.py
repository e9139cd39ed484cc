"""What the tests of checkpoints share: programs, their solution after every step, and the comparison of files."""

import os
import re
import struct

from common import check, run

# Programs of examples/ with options that give them some hundred steps in about a second. The last entry: ranks.
PLAIN = {
    "andrews": [],
    "caraxis": [],
    "chain_planar": ["-n", "10"],
    "doublependulum_angles": [],
    "fourbar": [],
    "heavytop_quaternion": [],
    "masschain": ["-ts_hhtdae_summary"],
    "oscillators": [],
    "pendulum": [],
    "rolling": [],
    "slidercrank": [],
    "springpendulum": [],
    "uservars": [],
}
SCENES = {
    "bricard": [],
    "chain": ["-n", "12"],
    "doublependulum": [],
    "flyball": [],
    "heavytop": [],
    "quartercar": [],
    "rollingball": [],
    "slidercrank3d": [],
}


def command(bin, name, ranks):
    program = [os.path.join(bin, name)]
    return program if ranks == 1 else ["mpiexec", "-n", str(ranks), "--oversubscribe", *program]


def states(file):
    """The vectors of a file of -ts_monitor_solution binary:FILE, as bytes"""
    with open(file, "rb") as f:
        data = f.read()
    all, at = [], 0
    while at < len(data):
        kind, n = struct.unpack(">ii", data[at:at + 8])
        check(kind == 1211214, "%s is not a file of vectors" % file)
        all.append(data[at:at + 8 + 8 * n])
        at += 8 + 8 * n
    return all


def summary(text):
    """The counters of the summary line, without what is a clock's"""
    found = re.search(r"^summary: (.*)$", text, re.M)
    check(found, "no summary line:\n" + text[-2000:])
    return {k: v for k, v in (word.split("=") for word in found.group(1).split()) if k not in ("time", "cpu")}


def content(file):
    with open(file, "rb") as f:
        return f.read()
