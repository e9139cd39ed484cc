"""Every example: writing checkpoints changes nothing, and a run resumed in its middle is the uninterrupted one, bit for bit.

usage: resume.py BIN DIRECTORY RANKS [PROGRAM...]
"""

import os
import sys

from common import check, run
from resuming import PLAIN, SCENES, command, content, states, summary

bin, directory, ranks = sys.argv[1], sys.argv[2], int(sys.argv[3])
names = sys.argv[4:] or (list(PLAIN) if ranks == 1 else []) + list(SCENES)  # the plain problems are written for one rank
os.makedirs(directory, exist_ok=True)


def record(name, kind, *options):
    """Output of a run, the states after its steps, and what it has recorded"""
    start = os.path.join(directory, "%s-%d-%s" % (name, ranks, kind))
    options = [*(PLAIN.get(name) or SCENES.get(name) or []), "-ts_monitor_solution", "binary:" + start + ".states", "-viewer_binary_skip_info", *options]
    out = run(command(bin, name, ranks) + options)
    return out, states(start + ".states")


def try_one(name):
    if not os.path.exists(os.path.join(bin, name)):
        print("%s is not there: left out" % name)
        return
    checkpoint = os.path.join(directory, "%s-%d.checkpoint" % (name, ranks))
    csv = [os.path.join(directory, "%s-%d-%s.balance" % (name, ranks, kind)) for kind in ("whole", "broken")]
    recording = [["-scene_balance", file] if name in SCENES else [] for file in csv]
    out, whole = record(name, "whole", *recording[0])
    counters = summary(out)
    steps = int(counters["steps"])
    middle = steps // 2 + 1
    out, writing = record(name, "writing", *recording[1], "-ts_hhtdae_checkpoint", checkpoint, "-ts_hhtdae_checkpoint_every", middle)
    check(writing == whole, "%s: a run that writes checkpoints has other bits" % name)
    check(summary(out) == counters, "%s: a run that writes checkpoints has other counters" % name)
    out, rest = record(name, "resumed", *recording[1], "-ts_hhtdae_resume", checkpoint)
    left = len(whole) - middle
    check(left <= len(rest) <= left + 1, "%s: %d states after the resumption, %d are left" % (name, len(rest), left))
    check(rest[-left:] == whole[-left:], "%s: the resumed run has other bits" % name)
    check(summary(out) == counters, "%s: the resumed run has other counters:\n%s\n%s" % (name, summary(out), counters))
    if name in SCENES:
        check(content(csv[0]) == content(csv[1]), "%s: the balance of the run that was resumed is another one" % name)
    print("%-22s %d ranks: %d steps, resumed after %d: the same bits" % (name, ranks, steps, middle))


for name in names:
    try_one(name)
