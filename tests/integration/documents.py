"""What is written in Markdown points at what is there: links at files, commands at targets of the makefile, programs at sources, options at their names.

usage: documents.py source-tree
"""

import os
import re
import sys

from common import check

tree = sys.argv[1]
files = [os.path.join(folder, name) for folder, _, names in os.walk(tree) if "/." not in folder[len(tree):] and "/build" not in folder[len(tree):]
         for name in names if name.endswith(".md")]
check(os.path.join(tree, "README.md") in files, "no README.md in " + tree)
with open(os.path.join(tree, "makefile.petsc")) as file:
    targets = set(re.findall(r"^([a-z0-9]+):", file.read(), re.M))
sources = {os.path.splitext(name)[0] for folder, _, names in os.walk(tree) for name in names if name.endswith((".cpp", ".c"))} | {"hhtreduce", "fuzz"}
options = set()
for name in ("src/integrator/type/unused.cpp", "src/scene/option_names.cpp"):
    with open(os.path.join(tree, name)) as file:
        options |= set(re.findall(r'"((?:ts_hhtdae|scene)_\w+)"', file.read()))
faults, links, programs = [], 0, 0
for path in sorted(files):
    with open(path) as file:
        text = file.read()
    name = os.path.relpath(path, tree)
    for link in re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", text):
        if "://" in link:
            continue
        links += 1
        if not os.path.exists(os.path.join(os.path.dirname(path), link)):
            faults.append("%s: the link %s leads nowhere" % (name, link))
    for target in re.findall(r"make -f makefile\.petsc ([a-z0-9]+)", text):
        if target not in targets:
            faults.append("%s: makefile.petsc has no target %s" % (name, target))
    for program in re.findall(r"build/bin/([a-z0-9_]+)", text):
        programs += 1
        if program not in sources and not program.endswith("_tests"):
            faults.append("%s: no source makes build/bin/%s" % (name, program))
    for option in re.findall(r"(?<![\w-])-((?:ts_hhtdae|scene)_[a-z0-9_]*[a-z0-9])", text):
        if option not in options:
            faults.append("%s: there is no option -%s" % (name, option))
with open(os.path.join(tree, "README.md")) as file:
    lines = len(file.readlines())
if lines > 150:
    faults.append("README.md has %d lines, more than 150" % lines)
check(not faults, "\n".join(faults))
check(links > 10 and programs > 10, "only %d links and %d programs were found" % (links, programs))
print("%d files, %d links, %d programs" % (len(files), links, programs))
